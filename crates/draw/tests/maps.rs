//! What a map's picture shows, pixel by pixel, and how large it may become.

use image::{Rgba, RgbaImage};
use sidestep_draw::{
    BodyRect, BodyShade, CellShade, DoorRect, GridScene, Style, Track, to_png, to_svg,
};

const WHITE: [u8; 3] = [255, 255, 255];
const WALL: [u8; 3] = [0x3C, 0x3C, 0x3C];
const ACTIVE: [u8; 3] = [0xA6, 0xA6, 0xA6];
/// The first track's blue at 40 % on white.
const RIBBON: [u8; 3] = [153, 199, 224];

/// A picture at one pixel per SVG pixel, with its map's place read from the SVG.
struct Picture {
    pixels: RgbaImage,
    left: f64,
    bottom: f64,
    px: f64,
}

impl Picture {
    fn of(scene: &GridScene) -> Self {
        let svg = to_svg(scene, &Style::MAP).unwrap();
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

    /// The color at a point in boxes.
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
fn room() -> GridScene {
    let shade = |at: u32| match (at % 20, at / 20) {
        (0 | 19, _) | (_, 0 | 19) => CellShade::Wall,
        _ => CellShade::Free,
    };
    let cells = (0..400).map(shade).collect();
    GridScene { width: 20, height: 20, box_size_m: 0.25, cells, ..GridScene::default() }
}

fn track(width_boxes: f64, points: Vec<(f64, f64)>) -> Track {
    Track { width_boxes, points, ..Track::default() }
}

#[test]
fn walls_doors_people_and_tracks_have_their_colors_at_their_places() {
    let person =
        BodyRect { col: 15, row: 15, width: 2, height: 2, heading: None, shade: BodyShade::Active };
    let scene = GridScene {
        doors: vec![
            DoorRect { col: 0, row: 5, width: 1, height: 3, open: false },
            DoorRect { col: 19, row: 5, width: 1, height: 3, open: true },
        ],
        bodies: vec![person],
        tracks: vec![track(3.0, vec![(3.5, 3.5), (3.5, 12.5), (10.5, 12.5)])],
        ..room()
    };
    let picture = Picture::of(&scene);
    assert_eq!(picture.at(0.5, 0.5), WALL);
    assert_eq!(picture.at(10.5, 19.5), WALL);
    assert_eq!(picture.at(0.5, 6.5), ACTIVE);
    assert_eq!(picture.at(16.0, 16.0), ACTIVE);
    assert_eq!(picture.at(12.5, 5.5), WHITE);
    assert_eq!(picture.at(3.5, 8.5), RIBBON);
    assert_eq!(picture.at(8.5, 12.5), RIBBON);
}

#[test]
fn row_zero_is_at_the_bottom() {
    let mut scene = room();
    scene.cells[20 + 5] = CellShade::Wall;
    let picture = Picture::of(&scene);
    assert_eq!(picture.at(5.5, 1.5), WALL);
    assert_eq!(picture.at(5.5, 18.5), WHITE);
}

#[test]
fn a_ribbon_covers_the_boxes_the_body_covered_and_no_others() {
    let scene = GridScene { tracks: vec![track(3.0, vec![(3.5, 9.5), (12.5, 9.5)])], ..room() };
    let picture = Picture::of(&scene);
    // A little inside and a little outside of the three rows and of the first and last column.
    for (row, color) in [(7.97, WHITE), (8.03, RIBBON), (10.97, RIBBON), (11.03, WHITE)] {
        assert_eq!(picture.at(8.5, row), color, "row {row}");
    }
    for (col, color) in [(1.96, WHITE), (2.04, RIBBON), (13.96, RIBBON), (14.04, WHITE)] {
        assert_eq!(picture.at(col, 8.5), color, "column {col}");
    }
}

#[test]
fn a_place_crossed_often_is_no_darker() {
    let to_and_fro = (0..50).map(|i| (if i % 2 == 0 { 3.5 } else { 12.5 }, 9.5)).collect();
    let square = vec![(3.5, 3.5), (9.5, 3.5), (9.5, 6.5), (6.5, 6.5), (6.5, 2.5)];
    let scene = GridScene { tracks: vec![track(1.0, to_and_fro)], ..room() };
    assert_eq!(Picture::of(&scene).at(8.5, 9.5), RIBBON);
    let scene = GridScene { tracks: vec![track(1.0, square)], ..room() };
    assert_eq!(Picture::of(&scene).at(6.5, 3.5), RIBBON);
}

#[test]
fn a_robot_that_never_moved_covers_its_boxes() {
    let scene = GridScene { tracks: vec![track(3.0, vec![(9.5, 9.5)])], ..room() };
    let picture = Picture::of(&scene);
    assert_eq!(picture.at(8.1, 8.1), RIBBON);
    assert_eq!(picture.at(10.9, 10.9), RIBBON);
    assert_eq!(picture.at(11.1, 9.5), WHITE);
}

#[test]
fn an_arrowhead_points_where_the_robot_heads() {
    for heading in 0..=5 {
        let shade = BodyShade::Robot(0);
        let body = BodyRect { col: 8, row: 8, width: 4, height: 4, heading: Some(heading), shade };
        let picture = Picture::of(&GridScene { bodies: vec![body], ..room() });
        // The tip is white, the same distance behind the middle is not.
        let (x, y) = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][usize::from(heading) % 4];
        assert_eq!(picture.at(10.0 + 1.1 * x, 10.0 + 1.1 * y), WHITE, "{heading}");
        assert_ne!(picture.at(10.0 - 1.1 * x, 10.0 - 1.1 * y), WHITE, "{heading}");
    }
}

#[test]
fn a_map_of_four_million_boxes_with_long_tracks_is_a_small_file() {
    let mut state = 1_u32;
    let mut random = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 16
    };
    let cells = (0..4_000_000)
        .map(|_| if random() % 3 == 0 { CellShade::Wall } else { CellShade::Free })
        .collect();
    let walk = |start: f64, random: &mut dyn FnMut() -> u32| {
        let mut at = (start, start);
        let step = |_| {
            let (dx, dy) =
                [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)][random() as usize % 4];
            at = (at.0 + dx, at.1 + dy);
            at
        };
        track(3.0, (0..100_000).map(step).collect())
    };
    let tracks = [500.5, 1000.5, 1500.5].map(|start| walk(start, &mut random)).to_vec();
    let scene = GridScene {
        width: 2000,
        height: 2000,
        box_size_m: 0.05,
        cells,
        tracks,
        ..GridScene::default()
    };
    let svg = to_svg(&scene, &Style::MAP).unwrap();
    assert!(svg.matches('<').count() < 150, "{} elements", svg.matches('<').count());
    assert!(svg.len() < 6_000_000, "{} bytes", svg.len());
    assert!(to_png(&svg, 1000).unwrap().starts_with(b"\x89PNG"));
}

#[test]
fn boxes_smaller_than_a_pixel_still_show() {
    let wall = |at: u32| if at % 2000 == 1000 { CellShade::Wall } else { CellShade::Free };
    let cells = (0..4_000_000).map(wall).collect();
    let scene =
        GridScene { width: 2000, height: 2000, box_size_m: 0.05, cells, ..GridScene::default() };
    let picture = Picture::of(&scene);
    let [r, ..] = picture.at(1000.5, 800.0);
    assert!(r < 200, "{r}");
}
