//! Tests of pictures: which parts they show, where, and in which colors.

use super::{PictureOptions, TrailChoice, describe, draw};
use crate::error::DrawError;
use crate::raster::to_png;
use crate::style::hex;
use crate::testing::{ball, moment, open, plane};
use sidestep_airspace::kinds::{AIRPLANE, START, ZONE};
use sidestep_chain::kinds::{CONNECTOR, RODS};
use sidestep_kernel::view::{
    AgentGroup, AgentNumber, BODY_COLORS, Body, BodyCondition, BodyKind, Frame, Pose, Scenery,
    Shape, Trail, Vec3, WALL_COLOR,
};
use sidestep_robots::kinds::{DOOR, PERSON, ROBOT};

fn picture(scenery: &Scenery, frame: &Frame) -> String {
    draw(scenery, frame, &[], &PictureOptions::page(scenery, "")).unwrap()
}

/// Two marks that make the shown area 10 meters square, apart from the margin.
fn corners() -> Vec<Body> {
    [[-2.0, 0.0, 0.0], [8.0, 10.0, 0.0]].map(|at| ball(BodyKind::GOAL, 0, at, 0.0)).to_vec()
}

fn numbers(text: &str) -> Vec<f64> {
    let is_number = |c: char| c.is_ascii_digit() || c == '.' || c == '-';
    text.split(|c| !is_number(c)).filter_map(|word| word.parse().ok()).collect()
}

/// Returns the center of the circle with this color, and its radius.
fn circle(svg: &str, color: &str) -> [f64; 3] {
    let is_it = |line: &&str| line.starts_with("<circle") && line.contains(color);
    let line = svg.lines().find(is_it).expect("a circle");
    let values = numbers(line.split(" fill").next().unwrap());
    [values[0], values[1], values[2]]
}

/// Returns the colors of a picture of ten meters square at places in meters.
fn colors<const N: usize>(
    bodies: Vec<Body>,
    still: Vec<Body>,
    places: [[f64; 2]; N],
) -> [[u8; 3]; N] {
    let scenery = Scenery { bodies: [corners(), still].concat(), name: String::new(), ..open(2) };
    let svg = picture(&scenery, &moment(bodies));
    let head = numbers(svg.lines().next().unwrap().split("width").nth(1).unwrap());
    let size = numbers(&svg.lines().next().unwrap().split("viewBox").nth(1).unwrap()[..30]);
    assert!(!head.is_empty());
    let longer = size[2].max(size[3]) as u32;
    let picture = image::load_from_memory(&to_png(&svg, longer).unwrap()).unwrap().to_rgba8();
    let clip = svg.split("clip_").nth(1).unwrap().split('"').next().unwrap();
    let map: Vec<f64> = clip.split('_').map(|n| n.parse().unwrap()).collect();
    // Three percent of margin on each side.
    let px = map[2] / 10.6;
    places.map(|[x, y]| {
        let at = (map[0] + (x + 2.3) * px, map[1] + map[3] - (y + 0.3) * px);
        let pixel = picture.get_pixel(at.0 as u32, at.1 as u32).0;
        [pixel[0], pixel[1], pixel[2]]
    })
}

fn obstacle(pose: Pose, shape: Shape) -> Body {
    Body::new(BodyKind::OBSTACLE, 0, pose, shape)
}

#[test]
fn shapes_are_where_they_are() {
    let turned = Pose::from_heading([0.0, 5.0, 0.0], 0.8_f64.atan2(0.6));
    let pole = Shape::Line { points_m: vec![[0.0, 1.0, 0.0], [3.0, 1.0, 0.0]], thickness_m: 0.8 };
    let still = || {
        vec![
            ball(BodyKind::OBSTACLE, 0, [5.0, 5.0, 0.0], 1.0),
            obstacle(turned, Shape::Cuboid { size_m: [2.0, 1.0, 0.1] }),
            obstacle(Pose::from_position([0.0; 3]), pole.clone()),
        ]
    };
    let inside = [[5.0, 5.9], [0.5, 5.6], [-0.3, 1.0], [3.0, 1.3]];
    assert_eq!(colors(vec![], still(), inside), [WALL_COLOR; 4]);
    let outside = [[5.8, 5.8], [0.8, 5.0], [-0.5, 1.2], [3.0, 1.5]];
    assert_eq!(colors(vec![], still(), outside), [[255; 3]; 4]);
}

/// Two connectors and the rod between them.
fn pair() -> Vec<Body> {
    let ends = [[4.0, 5.0, 0.0], [2.0, 5.0, 0.0]];
    let rod = Shape::Line { points_m: ends.to_vec(), thickness_m: 0.4 };
    let connector = |part: u32| {
        let ball = ball(CONNECTOR, 0, ends[part as usize], 0.5);
        ball.with_part(part).with_condition_if(part == 0, BodyCondition::Leading)
    };
    vec![Body::new(RODS, 0, Pose::from_position([0.0; 3]), rod), connector(0), connector(1)]
}

#[test]
fn a_leader_is_a_ring_and_its_followers_are_discs() {
    let places = [[4.25, 5.0], [2.0, 5.3], [3.0, 5.15], [3.0, 5.3]];
    let [leader, follower, rod, beside] = colors(pair(), vec![], places);
    assert_eq!((leader, beside), ([255; 3], [255; 3]));
    assert_eq!((follower, rod), (BODY_COLORS[0], BODY_COLORS[0]));
}

#[test]
fn the_legend_shows_a_target_as_the_picture_does() {
    let target = Body { part: Some(0), ..ball(BodyKind::GOAL, 0, [3.0, 3.0, 0.0], 0.1) };
    let scenery = Scenery { bodies: corners().into_iter().chain([target]).collect(), ..open(2) };
    let svg = picture(&scenery, &Frame::default());
    assert_eq!(svg.matches(r#"class="target""#).count(), 2, "in the picture and in the legend");
    assert!(svg.contains(">goal<"), "{svg}");
}

#[test]
fn walls_are_one_path_and_only_what_moves_has_an_arrow() {
    let wall = |k: u32| {
        let points_m = [0.0, 9.0].map(|y| [f64::from(k), y, 0.0]).to_vec();
        obstacle(Pose::from_position([0.0; 3]), Shape::Line { points_m, thickness_m: 0.0 })
    };
    let arrows = |more: Vec<Body>| {
        let bodies = corners().into_iter().chain((0..8).map(wall)).chain(more).collect();
        let svg = picture(&Scenery { bodies, ..open(2) }, &Frame::default());
        assert_eq!(svg.matches(r#"class="walls""#).count(), 1);
        svg.matches(r#"class="arrow""#).count()
    };
    let mover =
        |x_m_s: f64| ball(BodyKind::OBSTACLE, 0, [0.0; 3], 0.1).with_velocity([x_m_s, 0.0, 0.0]);
    assert_eq!(arrows(vec![mover(0.0)]), 0);
    assert_eq!(arrows(vec![mover(1.0), mover(0.01)]), 1, "too short an arrow is none");
}

#[test]
fn near_things_are_drawn_over_far_ones() {
    // From near to far; the view looks along the opposite of this.
    let to_eye = super::canvas::Camera::CORNER.to_eye;
    let at = |k: u32| -> Vec3 { to_eye.map(|x| x * -f64::from(k)) };
    let frame = moment((0..4).map(|k| ball(CONNECTOR, k, at(k), 1.0).with_part(1)).collect());
    let scenery = open(3);
    // The angles of that direction.
    let view = "-53.13,36.87".parse().unwrap();
    let options = PictureOptions { view, ..PictureOptions::page(&scenery, "") };
    let svg = draw(&scenery, &frame, &[], &options).unwrap();
    let place =
        |k: usize| svg.find(&format!(r#"fill="{}""#, hex(BODY_COLORS[k]))).expect("a connector");
    assert!((0..3).all(|k| place(k) > place(k + 1)), "{svg}");
}

#[test]
fn a_meter_is_as_long_in_every_direction_however_long_the_picture_is() {
    for (width_m, height_m) in [(10.0, 10.0), (40_000.0, 9000.0), (3.0, 70.0)] {
        let far = f64::max(width_m, height_m);
        let at = [[0.0, 0.0, 0.0], [width_m, 0.0, 0.0], [0.0, height_m, 0.0]];
        let balls =
            (0..).zip(at).map(|(k, at)| ball(CONNECTOR, k, at, 0.01 * far).with_part(1)).collect();
        let svg = picture(&open(2), &moment(balls));
        let [origin, east, north] = [0, 1, 2].map(|k| circle(&svg, &hex(BODY_COLORS[k])));
        let (across, upward) = ((east[0] - origin[0]) / width_m, (origin[1] - north[1]) / height_m);
        assert!((across / upward - 1.0).abs() < 1e-3, "{across} and {upward} px per m");
        assert!((origin[2] / (0.01 * far * across) - 1.0).abs() < 1e-2, "radii are true as well");
    }
}

#[test]
fn every_kind_has_the_colors_of_the_table() {
    let kinds =
        [ROBOT, PERSON, DOOR, CONNECTOR, AIRPLANE, ZONE, BodyKind::OBSTACLE, BodyKind::GOAL, START];
    for kind in kinds {
        for state in [BodyCondition::Plain, BodyCondition::Touching, BodyCondition::Failed] {
            let body = ball(kind, 1, [0.0; 3], 1.0).with_part(1).with_condition_if(true, state);
            let look = body.appearance(2);
            let svg = picture(&open(2), &moment(vec![body]));
            let fill = format!(r#"fill="{}""#, hex(look.color));
            let circle = svg.lines().find(|line| line.starts_with("<circle")).expect("drawn");
            assert!(circle.contains(&fill), "{kind} {state:?}: {circle}");
            let opacity = format!(r#"fill-opacity="{}""#, look.opacity);
            assert_eq!(circle.contains(&opacity), look.opacity < 1.0, "{kind} {state:?}: {circle}");
        }
    }
}

#[test]
fn thick_parts_in_space_have_a_seam_and_thin_ones_none() {
    let rods = |thickness_m: f64| {
        let points_m = vec![[0.0, 0.0, 0.0], [1.0, 1.0, 1.0]];
        Body::new(RODS, 0, Pose::from_position([0.0; 3]), Shape::Line { points_m, thickness_m })
    };
    let seams = |dimensions: u8, thickness_m: f64| {
        let svg = picture(&open(dimensions), &moment(vec![rods(thickness_m)]));
        svg.matches(r##"stroke="#FFFFFF" stroke-width"##).count()
    };
    assert_eq!([seams(3, 0.1), seams(3, 0.001), seams(2, 0.1)], [1, 0, 0]);
}

/// Robots in two groups, on a floor.
fn two_groups() -> (Scenery, Frame) {
    let group = |name: &str, numbers| AgentGroup { name: name.into(), kind: ROBOT, numbers };
    let groups = vec![group("couriers", 0..2), group("cleaners", 2..5)];
    let robot = |k: u32| {
        let shape = Shape::Cuboid { size_m: [1.0; 3] };
        Body::new(ROBOT, k, Pose::from_position([2.0 * f64::from(k) + 1.0, 2.0, 0.5]), shape)
    };
    (Scenery { groups, ..plane(12, 6) }, moment((0..5).map(robot).collect()))
}

fn count(svg: &str, words: &str) -> usize {
    svg.matches(words).count()
}

#[test]
fn robots_have_the_color_of_their_group_and_the_legend_names_it() {
    let (scenery, frame) = two_groups();
    let svg = picture(&scenery, &frame);
    let fill = |index: usize| format!("fill=\"{}\"", hex(BODY_COLORS[index]));
    // Each robot, and the legend.
    assert_eq!((count(&svg, &fill(0)), count(&svg, &fill(1))), (3, 4), "{svg}");
    assert!(svg.contains(">couriers (2 robots)<") && svg.contains(">cleaners (3 robots)<"));
    assert!(!svg.contains(">robot 0<"));
    let one = Scenery { groups: scenery.groups[..1].to_vec(), ..scenery };
    let svg = picture(&one, &frame);
    assert_eq!(count(&svg, &fill(2)), 1, "a single group does not make all alike: {svg}");
}

#[test]
fn chosen_agents_stand_out_from_the_others() {
    let (scenery, frame) = two_groups();
    let agents = vec![AgentNumber { number: 3, part: None }];
    let trails = TrailChoice { agents, from: Some(7) };
    let way = (0..20).map(|cycle| (cycle, [7.0, 1.0 + 0.2 * cycle as f64, 0.5])).collect();
    let trail = Trail { of: frame.bodies[3].id(), points: way };
    let other = Trail { of: frame.bodies[0].id(), points: vec![(9, [1.0, 2.0, 0.5])] };
    let options = PictureOptions { trails: trails.clone(), ..PictureOptions::page(&scenery, "") };
    let svg = draw(&scenery, &frame, &[trail.clone(), other.clone()], &options).unwrap();
    assert!(svg.contains(">cleaners: robot 3<") && svg.contains(">other robots (4)<"), "{svg}");
    assert_eq!(count(&svg, "class=\"trail\""), 1, "only the chosen one has a trail");
    assert_eq!(count(&svg, &format!("fill=\"{}\"", hex(BODY_COLORS[1]))), 2, "it, and the legend");
    let words = describe(&scenery, &frame, &[trail, other], &trails);
    assert_eq!(words, "Tracks of 1 of 5 robots (the others pale), cycles 7 to 0.");
}

#[test]
fn a_picture_of_some_size_has_exactly_that_and_all_of_its_words() {
    let (scenery, frame) = two_groups();
    for size_px in [[900, 500], [300, 700], [1800, 1000]] {
        let page = PictureOptions::page(&scenery, "Small print.");
        let options = PictureOptions { size_px: Some(size_px), ..page };
        let svg = draw(&scenery, &frame, &[], &options).unwrap();
        let [width, height] = size_px;
        assert!(svg.contains(&format!("width=\"{width}\" height=\"{height}\"")), "{svg}");
        assert!(svg.contains("Small print.") && svg.contains(">couriers (2 robots)<"), "{svg}");
        let png = to_png(&svg, width.max(height)).unwrap();
        let picture = image::load_from_memory(&png).unwrap().to_rgb8();
        assert_eq!(picture.dimensions(), (width, height));
        assert_eq!(picture.get_pixel(0, 0).0, [255; 3], "the ground covers all of it");
    }
}

#[test]
fn a_picture_that_may_grow_has_its_width_and_shows_more() {
    let (scenery, frame) = two_groups();
    let page = PictureOptions::page(&scenery, "Small print.");
    let fixed = PictureOptions { size_px: Some([400, 260]), ..page };
    let grown = PictureOptions { may_grow: true, ..fixed.clone() };
    let map_px = |options: &PictureOptions| {
        let svg = draw(&scenery, &frame, &[], options).unwrap();
        assert!(svg.contains("width=\"400\""), "{svg}");
        let clip = svg.split("clip_").nth(1).unwrap().split('"').next().unwrap().to_string();
        clip.split('_').nth(2).unwrap().parse::<f64>().unwrap()
    };
    assert!(map_px(&grown) > 1.2 * map_px(&fixed));
}

/// Balls at the corners of a cube of 4 m, each of its own number.
fn cube() -> (Scenery, Frame) {
    let at = |k: u32| [0, 1, 2].map(|axis| 4.0 * f64::from(k >> axis & 1));
    let bodies = (0..8).map(|k| ball(CONNECTOR, k, at(k), 0.5)).collect();
    (Scenery { name: String::new(), ..open(3) }, moment(bodies))
}

#[test]
fn named_views_show_two_axes_with_a_scale_and_others_three() {
    let (scenery, frame) = cube();
    let shown = |view: &str| {
        let view = view.parse().unwrap();
        let options = PictureOptions { view, ..PictureOptions::page(&scenery, "") };
        draw(&scenery, &frame, &[], &options).unwrap()
    };
    for (view, axes) in [("top", ["x", "y"]), ("side", ["y", "z"]), ("front", ["x", "z"])] {
        let svg = shown(view);
        assert!(axes.iter().all(|axis| svg.contains(&format!(">{axis} (m)<"))), "{view}: {svg}");
        assert_eq!(count(&svg, " (m)<"), 2, "{view}");
        assert!(svg.contains("scale-bar"), "{view}");
    }
    assert_eq!(count(&shown("30,20"), " (m)<"), 3);
    // Seen from the front, what is far has a higher y; from the other side it is in front.
    let order =
        |svg: &str, index: usize| svg.find(&format!("fill=\"{}\"", hex(BODY_COLORS[index])));
    let front = shown("front");
    assert!(order(&front, 2) < order(&front, 0), "far ones are drawn first");
    let back = shown("90,0.1");
    assert!(order(&back, 2) > order(&back, 0));
    let flat = Scenery { dimensions: 2, ..scenery.clone() };
    let side = PictureOptions { view: "side".parse().unwrap(), ..PictureOptions::page(&flat, "") };
    assert!(matches!(draw(&flat, &frame, &[], &side), Err(DrawError::FlatView(_))));
}

#[test]
fn balls_before_a_snake_let_it_show_through_and_all_cast_shadows() {
    let snake: Vec<Body> =
        (0..10).map(|k| ball(CONNECTOR, 0, [f64::from(k), 0.0, 0.0], 0.1).with_part(k)).collect();
    let at = |k: u32, place| ball(BodyKind::OBSTACLE, k, place, 0.4);
    let near = vec![at(0, [3.0, -0.8, 0.0]), at(1, [6.0, 0.8, 0.0])];
    let far = (2..100).map(|k| at(k, [f64::from(k % 10), f64::from(k / 10) + 5.0, 3.0]));
    let scenery = Scenery { bodies: near.into_iter().chain(far).collect(), ..open(3) };
    let view = "-90,5".parse().unwrap();
    let options = PictureOptions { view, ..PictureOptions::page(&scenery, "") };
    let svg = draw(&scenery, &moment(snake), &[], &options).unwrap();
    assert_eq!((count(&svg, "class=\"hides\""), count(&svg, "class=\"ball\"")), (1, 1), "{svg}");
    assert!(svg.contains("Of 100 balls, the 2 within 0.80 m of an agent are drawn"), "{svg}");
    assert_eq!(count(&svg, "class=\"shadow\""), 1, "the shadows of balls are one path");
    assert_eq!(count(&svg, "class=\"floor\""), 1);
}
