//! Tests of a map's picture, pixel by pixel, and of how large it may become.

use image::{Rgba, RgbaImage};
use sidestep_draw::{PictureOptions, draw, to_png};
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{
    Body, BodyCondition, BodyId, BodyKind, DOOR_COLOR, Frame, Isometry2, MOBILE_COLOR, Occupancy,
    OccupancyGrid, Pose, Scenery, Shape, Trail, Vec3, WALL_COLOR,
};
use sidestep_robots::kinds::{DOOR, PERSON, ROBOT};

const WHITE: [u8; 3] = [255, 255, 255];
/// The first robot's blue at 50 % on white.
const RIBBON: [u8; 3] = [127, 184, 216];
/// Side of a box.
const BOX_M: f64 = 0.25;

/// The content of a floor.
#[derive(Clone)]
struct Scene {
    floor: OccupancyGrid,
    bodies: Vec<Body>,
    trails: Vec<Trail>,
}

impl Scene {
    fn svg(&self) -> String {
        let scenery = Scenery {
            name: String::new(),
            dimensions: 2,
            cycle_s: 1.0,
            floor: Some(self.floor.clone()),
            bodies: Vec::new(),
            names: Vec::new(),
            groups: Vec::new(),
            earth: Default::default(),
            traffic: None,
        };
        let frame = Frame { bodies: self.bodies.clone(), ..Frame::default() };
        draw(&scenery, &frame, &self.trails, &PictureOptions::page(&scenery, "")).unwrap()
    }
}

/// A picture at one pixel per SVG pixel, with its map's place read from the SVG.
struct Picture {
    pixels: RgbaImage,
    left: f64,
    bottom: f64,
    px: f64,
}

impl Picture {
    fn from_scene(scene: &Scene) -> Self {
        let svg = scene.svg();
        let size = |name: &str| number_after(&svg, &format!("{name}=\""));
        let longer = size("width").max(size("height"));
        let png = to_png(&svg, longer as u32).unwrap();
        Self {
            pixels: image::load_from_memory(&png).unwrap().to_rgba8(),
            left: number_after(&svg, "translate("),
            bottom: number_after(svg.split("translate(").nth(1).unwrap(), " "),
            px: number_after(&svg, "scale("),
        }
    }

    /// Returns the color at a point in boxes.
    fn at(&self, col: f64, row: f64) -> [u8; 3] {
        let (x, y) = (self.left + col * self.px, self.bottom - row * self.px);
        let Rgba([r, g, b, _]) = *self.pixels.get_pixel(x as u32, y as u32);
        [r, g, b]
    }
}

fn number_after(text: &str, mark: &str) -> f64 {
    let start = text.find(mark).unwrap() + mark.len();
    let number = text[start..].split(|c: char| !(c.is_ascii_digit() || c == '.')).next();
    number.unwrap().parse().unwrap()
}

/// A room of 20 x 20 boxes with walls around it.
fn room() -> Scene {
    let occupancy = |at: u32| match (at % 20, at / 20) {
        (0 | 19, _) | (_, 0 | 19) => Occupancy::Wall,
        _ => Occupancy::Free,
    };
    floor(20, (0..400).map(occupancy).collect())
}

fn floor(side: u32, boxes: Vec<Occupancy>) -> Scene {
    let floor = OccupancyGrid {
        width: side,
        height: side,
        box_m: BOX_M,
        plane: Isometry2 { origin_m: [-3.0, 2.0], yaw_rad: 0.0 },
        boxes,
    };
    Scene { floor, bodies: Vec::new(), trails: Vec::new() }
}

/// A point in boxes.
fn place((col, row): (f64, f64)) -> Vec3 {
    [-3.0 + BOX_M * col, 2.0 + BOX_M * row, 0.0]
}

/// A body of this many boxes around a point in boxes, with a heading in quarter turns.
fn body(kind: BodyKind, number: u32, at: (f64, f64), size: (f64, f64), quarters: u8) -> Body {
    let size_m = [BOX_M * size.0, BOX_M * size.1, 0.1];
    let heading_rad = f64::from(quarters) * std::f64::consts::FRAC_PI_2;
    let pose = Pose::from_heading(place(at), heading_rad);
    Body::new(kind, number, pose, Shape::Cuboid { size_m })
}

/// A robot of that many boxes' width at the end of its way.
fn moved_robot(number: u32, width: f64, way: &[(f64, f64)]) -> (Body, Trail) {
    // All in one cycle, so that the whole trail has one shade.
    let places = way.iter().map(|&at| (0 as Cycle, place(at))).collect();
    let robot = body(ROBOT, number, way[way.len() - 1], (width, width), 0);
    (robot, Trail { of: BodyId::new(ROBOT, number, None), points: places })
}

/// Returns the room with robots that have gone ways.
fn ways(ways: &[(f64, &[(f64, f64)])]) -> Scene {
    let ways = ways.iter().zip(0..).map(|((width, way), number)| moved_robot(number, *width, way));
    let (bodies, trails) = ways.unzip();
    Scene { bodies, trails, ..room() }
}

/// Makes all of a trail the newest: with a newer cycle elsewhere, it would be drawn as old.
fn newest(mut scene: Scene) -> Scene {
    for trail in &mut scene.trails {
        trail.points.insert(0, (0, trail.points[0].1));
        trail.points[1..].iter_mut().for_each(|(cycle, _)| *cycle = 40);
    }
    scene
}

#[test]
fn walls_doors_people_and_tracks_have_their_colors_at_their_places() {
    let mut scene = newest(ways(&[(3.0, &[(3.5, 3.5), (3.5, 12.5), (10.5, 12.5)])]));
    let door = |col: f64| body(DOOR, col as u32, (col, 6.5), (1.0, 3.0), 0);
    scene.bodies.extend([
        door(0.5),
        door(19.5).with_condition_if(true, BodyCondition::Open),
        body(PERSON, 9, (16.0, 16.0), (2.0, 2.0), 0),
    ]);
    let picture = Picture::from_scene(&scene);
    assert_eq!(picture.at(0.5, 0.5), WALL_COLOR);
    assert_eq!(picture.at(10.5, 19.5), WALL_COLOR);
    assert_eq!(picture.at(0.5, 6.5), DOOR_COLOR);
    assert_ne!(picture.at(19.5, 6.5), DOOR_COLOR);
    assert_eq!(picture.at(16.0, 16.0), MOBILE_COLOR);
    assert_eq!(picture.at(12.5, 5.5), WHITE);
    assert_eq!(picture.at(3.5, 8.5), RIBBON);
    assert_eq!(picture.at(7.5, 12.5), RIBBON);
}

#[test]
fn row_zero_is_at_the_bottom() {
    let mut scene = room();
    scene.floor.boxes[20 + 5] = Occupancy::Wall;
    let picture = Picture::from_scene(&scene);
    assert_eq!(picture.at(5.5, 1.5), WALL_COLOR);
    assert_eq!(picture.at(5.5, 18.5), WHITE);
}

#[test]
fn a_ribbon_covers_the_boxes_the_body_covered_and_no_others() {
    let picture =
        Picture::from_scene(&newest(ways(&[(3.0, &[(12.5, 9.5), (3.5, 9.5), (12.5, 9.5)])])));
    // Slightly inside and slightly outside the three rows and the first column.
    for (row, color) in [(7.97, WHITE), (8.03, RIBBON), (10.97, RIBBON), (11.03, WHITE)] {
        assert_eq!(picture.at(8.5, row), color, "row {row}");
    }
    for (col, color) in [(1.96, WHITE), (2.04, RIBBON), (14.04, WHITE)] {
        assert_eq!(picture.at(col, 8.5), color, "column {col}");
    }
}

#[test]
fn a_place_crossed_often_is_no_darker() {
    let to_and_fro: Vec<_> = (0..50).map(|i| (if i % 2 == 0 { 3.5 } else { 12.5 }, 9.5)).collect();
    let square = [(3.5, 3.5), (9.5, 3.5), (9.5, 6.5), (6.5, 6.5), (6.5, 2.5)];
    assert_eq!(Picture::from_scene(&newest(ways(&[(1.0, &to_and_fro)]))).at(8.5, 9.5), RIBBON);
    assert_eq!(Picture::from_scene(&newest(ways(&[(1.0, &square)]))).at(6.5, 3.5), RIBBON);
}

#[test]
fn a_robot_that_never_moved_covers_its_boxes() {
    let mut scene = newest(ways(&[(3.0, &[(9.5, 9.5)])]));
    // Moved slightly aside, so that the place where it was is visible.
    scene.bodies[0] = body(ROBOT, 0, (15.5, 15.5), (3.0, 3.0), 0);
    let picture = Picture::from_scene(&scene);
    assert_eq!(picture.at(8.1, 8.1), RIBBON);
    assert_eq!(picture.at(10.9, 10.9), RIBBON);
    assert_eq!(picture.at(11.1, 9.5), WHITE);
}

#[test]
fn an_arrowhead_points_where_the_robot_heads() {
    for heading in 0..=5 {
        let robot = body(ROBOT, 0, (10.0, 10.0), (4.0, 4.0), heading);
        let picture = Picture::from_scene(&Scene { bodies: vec![robot], ..room() });
        // The tip is white, the same distance behind the middle is not.
        let (x, y) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][usize::from(heading) % 4];
        assert_eq!(picture.at(10.0 + 1.1 * x, 10.0 + 1.1 * y), WHITE, "{heading}");
        assert_ne!(picture.at(10.0 - 1.1 * x, 10.0 - 1.1 * y), WHITE, "{heading}");
    }
}

#[test]
fn what_is_longer_ago_is_paler() {
    let mut scene = ways(&[(1.0, &[(2.5, 9.5), (16.5, 9.5)])]);
    let way = (0..=40).map(|k| (k, place((2.5 + 0.35 * k as f64, 9.5))));
    scene.trails[0].points = way.collect();
    let picture = Picture::from_scene(&scene);
    let reds: Vec<u8> = [3.0, 7.0, 11.0, 14.0].map(|col| picture.at(col, 9.3)[0]).to_vec();
    assert!(reds.windows(2).all(|pair| pair[0] > pair[1]), "{reds:?}");
}

#[test]
fn a_map_of_four_million_boxes_with_long_tracks_is_a_small_file() {
    let mut state = 1_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 16
    };
    let occupancy = |_| if random() % 3 == 0 { Occupancy::Wall } else { Occupancy::Free };
    let boxes = (0..4_000_000).map(occupancy).collect();
    let mut walk = |start: f64| -> Vec<(f64, f64)> {
        let mut at = (start, start);
        let step = |_| {
            let (dx, dy) =
                [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][random() as usize % 4];
            at = (at.0 + dx, at.1 + dy);
            at
        };
        (0..100_000).map(step).collect()
    };
    let walks = [500.5, 1000.5, 1500.5].map(&mut walk);
    let walked = walks.iter().zip(0..).map(|(way, number)| moved_robot(number, 3.0, way));
    let (bodies, trails) = walked.unzip();
    let svg = Scene { bodies, trails, ..floor(2000, boxes) }.svg();
    assert!(svg.matches('<').count() < 150, "{} elements", svg.matches('<').count());
    assert!(svg.len() < 6_000_000, "{} bytes", svg.len());
    assert!(to_png(&svg, 1000).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn boxes_smaller_than_a_pixel_still_show() {
    let wall = |at: u32| if at % 2000 == 1000 { Occupancy::Wall } else { Occupancy::Free };
    let picture = Picture::from_scene(&floor(2000, (0..4_000_000).map(wall).collect()));
    let [r, ..] = picture.at(1000.5, 800.0);
    assert!(r < 200, "{r}");
}
