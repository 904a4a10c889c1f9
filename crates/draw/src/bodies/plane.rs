//! Bodies seen from above.

use std::fmt::Write as _;

use super::{BodyScene, Obstacle, Shape, Strand, thinned};
use crate::error::DrawError;
use crate::legend::{Symbol, start_mark};
use crate::scene::furniture::{Area, Sheet};
use crate::scene::{ACTIVE, ACTIVE_RIM, WALL};
use crate::style::{INK, Style, series_color};
use crate::svg::{Num, Svg};

/// Thinner lines than this would vanish.
const LEAST_LINE_PX: f64 = 1.2;

/// Legend symbols of what stands still, and of what moves.
const LOOKS: [Symbol; 2] = [
    Symbol::Swatch { fill: WALL, rim: "none", opacity: 1.0 },
    Symbol::Swatch { fill: ACTIVE, rim: ACTIVE_RIM, opacity: 1.0 },
];

type Px = (f64, f64);

pub(super) fn draw(scene: &BodyScene<2>, style: &Style) -> Result<String, DrawError> {
    style.check()?;
    scene.check()?;
    let [lo, hi] = scene.shown()?;
    let extent_m = [hi[0] - lo[0], hi[1] - lo[1]];
    let px = (style.width_px / extent_m[0]).min(style.height_px / extent_m[1]);
    let area = Area {
        origin_m: lo,
        boxes: extent_m,
        box_size_m: 1.0,
        title: &scene.title,
        caption: &scene.caption,
    };
    let mut svg = Svg::default();
    let sheet = Sheet::open(&mut svg, &area, style, px);
    let view = View { sheet: &sheet, origin_m: lo, px };
    svg.open_clip(sheet.map);
    view.walls(&mut svg, scene);
    for obstacle in scene.obstacles.iter().filter(|o| !is_wall(o)) {
        view.obstacle(&mut svg, obstacle);
    }
    for trail in &scene.trails {
        let points = thinned(trail.points.iter().map(|p| view.at(*p)));
        let color = series_color(trail.color);
        let look =
            format!(r#"fill="none" stroke="{color}" stroke-opacity="0.5" stroke-width="1.5""#);
        svg.path(&path_data(&points), look);
    }
    for (index, strand) in scene.strands.iter().enumerate() {
        view.strand(&mut svg, strand, series_color(index));
    }
    svg.close_group();
    svg.rect(sheet.map, format_args!(r#"fill="none" stroke="{INK}""#));
    sheet.close(svg, &area, scene.entries(LOOKS), style)
}

/// Whether it is a wall without thickness that stands still.
fn is_wall(obstacle: &Obstacle<2>) -> bool {
    matches!(obstacle.shape, Shape::Capsule { radius_m: 0.0, .. }) && !obstacle.moves()
}

/// From meters to pixels.
struct View<'a> {
    sheet: &'a Sheet,
    origin_m: [f64; 2],
    px: f64,
}

impl View<'_> {
    fn at(&self, [x, y]: [f64; 2]) -> Px {
        self.sheet.at((x - self.origin_m[0], y - self.origin_m[1]))
    }

    /// All walls, as one path.
    fn walls(&self, svg: &mut Svg, scene: &BodyScene<2>) {
        let mut data = String::new();
        for obstacle in scene.obstacles.iter().filter(|o| is_wall(o)) {
            if let Shape::Capsule { ends, .. } = obstacle.shape {
                data += &path_data(&ends.map(|p| self.at(p)));
            }
        }
        if !data.is_empty() {
            let look = r#"fill="none" stroke-width="1.5" stroke-linecap="round""#;
            svg.path(&data, format_args!(r#"class="walls" stroke="{WALL}" {look}"#));
        }
    }

    fn obstacle(&self, svg: &mut Svg, obstacle: &Obstacle<2>) {
        let moves = obstacle.moves();
        let (fill, rim) = if moves { (ACTIVE, ACTIVE_RIM) } else { (WALL, WALL) };
        let look = format!(r#"fill="{fill}" stroke="{rim}" stroke-width="0.8""#);
        match obstacle.shape {
            Shape::Ball { center, radius_m } => {
                svg.circle(self.at(center), (radius_m * self.px).max(LEAST_LINE_PX), look);
            }
            Shape::Capsule { ends: [a, b], radius_m } => {
                let width = Num((2.0 * radius_m * self.px).max(LEAST_LINE_PX));
                let look = format_args!(
                    r#"stroke="{fill}" stroke-width="{width}" stroke-linecap="round""#
                );
                svg.line(self.at(a), self.at(b), look);
            }
            Shape::Cuboid { .. } => {
                let corners = obstacle.shape.corners();
                let around = [0, 1, 3, 2].map(|k| self.at(corners[k]));
                svg.path(&format!("{}Z", path_data(&around)), look);
            }
        }
        if moves {
            let [from, to] = obstacle.arrow().map(|p| self.at(p));
            arrow(svg, from, to);
        }
    }

    fn strand(&self, svg: &mut Svg, strand: &Strand<2>, color: &str) {
        let points: Vec<Px> = strand.points.iter().map(|p| self.at(*p)).collect();
        let Some(&leader) = points.first() else { return };
        let width = Num((2.0 * strand.rod_radius_m * self.px).max(LEAST_LINE_PX));
        let ends = r#"stroke-linecap="round" stroke-linejoin="round""#;
        let rods = format!(r#"fill="none" stroke="{color}" stroke-width="{width}" {ends}"#);
        svg.path(&path_data(&points), rods);
        let radius = (strand.connector_radius_m * self.px).max(LEAST_LINE_PX);
        let body =
            format!(r##"fill="{color}" fill-opacity="0.75" stroke="#FFFFFF" stroke-width="0.6""##);
        for &at in &points {
            svg.circle(at, radius, &body);
        }
        start_mark(svg, leader, (0.7 * radius).max(3.0), color);
    }
}

/// An arrow; shorter than its head it is not drawn.
pub(super) fn arrow(svg: &mut Svg, from: Px, to: Px) {
    const HEAD_PX: f64 = 6.0;
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let length = (dx * dx + dy * dy).sqrt();
    if length <= HEAD_PX {
        return;
    }
    let (ux, uy) = (HEAD_PX * dx / length, HEAD_PX * dy / length);
    let neck = (to.0 - ux, to.1 - uy);
    svg.line(from, neck, format_args!(r#"stroke="{INK}" stroke-width="1.3""#));
    let wings =
        [(neck.0 - 0.5 * uy, neck.1 + 0.5 * ux), to, (neck.0 + 0.5 * uy, neck.1 - 0.5 * ux)];
    svg.path(&format!("{}Z", path_data(&wings)), format_args!(r#"fill="{INK}""#));
}

/// A line through points.
pub(super) fn path_data(points: &[Px]) -> String {
    let mut data = String::new();
    for (index, &(x, y)) in points.iter().enumerate() {
        let command = if index == 0 { 'M' } else { 'L' };
        // Writing into a String cannot fail.
        let _ = write!(data, "{command}{} {}", Num(x), Num(y));
    }
    data
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::raster::to_png;

    fn obstacle(shape: Shape<2>, velocity_m_s: [f64; 2]) -> Obstacle<2> {
        Obstacle { shape, velocity_m_s }
    }

    fn wall(ends: [[f64; 2]; 2]) -> Obstacle<2> {
        obstacle(Shape::Capsule { ends, radius_m: 0.0 }, [0.0; 2])
    }

    /// Ten meters square.
    fn scene() -> BodyScene<2> {
        let view_m = Some([[-2.0, 0.0], [8.0, 10.0]]);
        BodyScene { view_m, ..BodyScene::default() }
    }

    /// The colors of a picture at places in meters.
    fn colors<const N: usize>(scene: &BodyScene<2>, places: [[f64; 2]; N]) -> [[u8; 3]; N] {
        let svg = scene.to_svg(&Style::MAP).unwrap();
        let number_after = |mark: &str| -> f64 {
            let rest = svg.split(mark).nth(1).unwrap();
            rest.split('"').next().unwrap().parse().unwrap()
        };
        let (width, height) = (number_after(r#"width=""#), number_after(r#"height=""#));
        let longer = width.max(height) as u32;
        let picture = image::load_from_memory(&to_png(&svg, longer).unwrap()).unwrap().to_rgba8();
        let clip = svg.split("clip_").nth(1).unwrap().split('"').next().unwrap();
        let map: Vec<f64> = clip.split('_').map(|n| n.parse().unwrap()).collect();
        let px = map[2] / 10.0;
        places.map(|[x, y]| {
            let at = (map[0] + (x + 2.0) * px, map[1] + map[3] - y * px);
            let pixel = picture.get_pixel(at.0 as u32, at.1 as u32).0;
            [pixel[0], pixel[1], pixel[2]]
        })
    }

    #[test]
    fn shapes_are_where_they_are() {
        let turned = [[0.6, 0.8], [-0.8, 0.6]];
        let cuboid = Shape::Cuboid { center: [0.0, 5.0], axes: turned, half_m: [1.0, 0.5] };
        let scene = BodyScene {
            obstacles: vec![
                obstacle(Shape::Ball { center: [5.0, 5.0], radius_m: 1.0 }, [0.0; 2]),
                obstacle(cuboid, [0.0; 2]),
                obstacle(
                    Shape::Capsule { ends: [[0.0, 1.0], [3.0, 1.0]], radius_m: 0.4 },
                    [0.0; 2],
                ),
            ],
            ..scene()
        };
        let (dark, white) = ([0x3C; 3], [255; 3]);
        let inside = [[5.0, 5.9], [0.5, 5.6], [-0.3, 1.0], [3.0, 1.3]];
        assert_eq!(colors(&scene, inside), [dark; 4]);
        let outside = [[5.8, 5.8], [0.8, 5.0], [-0.5, 1.2], [3.0, 1.5]];
        assert_eq!(colors(&scene, outside), [white; 4]);
    }

    #[test]
    fn a_leader_is_a_ring_and_its_followers_are_discs() {
        let strand = Strand {
            points: vec![[4.0, 5.0], [2.0, 5.0]],
            connector_radius_m: 0.5,
            rod_radius_m: 0.2,
            label: "pair".into(),
        };
        let scene = BodyScene { strands: vec![strand], ..scene() };
        let [leader, follower, rod, beside] =
            colors(&scene, [[4.0, 5.0], [2.0, 5.3], [3.0, 5.15], [3.0, 5.3]]);
        assert_eq!((leader, beside, rod), ([255; 3], [255; 3], [0x00, 0x72, 0xB2]));
        assert!(follower[2] > follower[0] + 60, "{follower:?}");
    }

    #[test]
    fn walls_are_one_path_and_only_what_moves_has_an_arrow() {
        let line = |k: u32| wall([[f64::from(k), 0.0], [f64::from(k), 9.0]]);
        let ball = |velocity| obstacle(Shape::Ball { center: [0.0; 2], radius_m: 0.1 }, velocity);
        let arrows = |scene: &BodyScene<2>| {
            let svg = scene.to_svg(&Style::MAP).unwrap();
            assert!(svg.matches(r#"class="walls""#).count() <= 1);
            svg.matches(r#"stroke-width="1.3""#).count()
        };
        let still =
            BodyScene { obstacles: (0..8).map(line).chain([ball([0.0; 2])]).collect(), ..scene() };
        assert_eq!(arrows(&still), 0);
        let moving = BodyScene { obstacles: vec![ball([1.0, 0.0]), ball([0.01, 0.0])], ..scene() };
        assert_eq!(arrows(&moving), 1, "too short an arrow is none");
    }
}
