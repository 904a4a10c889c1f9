//! Tests of pictures: which parts they show, where, and in which colors.

use super::{PictureOptions, draw};
use crate::raster::to_png;
use crate::style::hex;
use crate::testing::{ball, moment, open};
use sidestep_airspace::kinds::{AIRPLANE, START, ZONE};
use sidestep_chain::kinds::{CONNECTOR, RODS};
use sidestep_kernel::view::{
    BODY_COLORS, Body, BodyCondition, BodyKind, Frame, Pose, Scenery, Shape, Vec3, WALL_COLOR,
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
    let svg = picture(&open(3), &frame);
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
