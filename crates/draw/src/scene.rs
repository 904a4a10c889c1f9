//! A map seen from above: walls, doors, bodies, and the tracks that robots left on it.

mod cells;
pub(crate) mod furniture;
mod ribbon;

use crate::error::DrawError;
use crate::legend::{end_mark, start_mark};
use crate::style::{FAINT_INK, INK, Style, series_color};
use crate::svg::{Anchor, Num, Rect, Svg, TextLook};
use furniture::{Area, Sheet};

/// The most boxes a map may have: 16384 x 16384.
const MOST_BOXES: u64 = 1 << 28;
/// A box is never drawn larger than this.
const LARGEST_BOX_PX: f64 = 28.0;
/// With more tracks than this, labels at the tracks' ends would cover each other.
const MOST_END_LABELS: usize = 12;

pub(crate) const WALL: &str = "#3C3C3C";
pub(crate) const UNKNOWN: &str = "#EDEBE6";
pub(crate) const ACTIVE: &str = "#A6A6A6";
pub(crate) const ACTIVE_RIM: &str = "#6E6E6E";

/// What a box of the map holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum CellShade {
    /// Nothing: white.
    #[default]
    Free,
    /// A wall or another thing that never moves: dark gray.
    Wall,
    /// Not known to the map: pale.
    Unknown,
}

/// A door: light gray where closed, an outline where open.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DoorRect {
    /// Leftmost column.
    pub col: u32,
    /// Lowest row.
    pub row: u32,
    /// Width in boxes.
    pub width: u32,
    /// Height in boxes.
    pub height: u32,
    /// Whether bodies can pass.
    pub open: bool,
}

/// The way a robot took, drawn as a ribbon as wide as the robot.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Track {
    /// The robot's width in boxes.
    pub width_boxes: f64,
    /// The body's center in boxes, from the map's lower left corner: a robot of one box in column
    /// 3 of row 0 is at `(3.5, 0.5)`. A point that is not a number interrupts the ribbon.
    pub points: Vec<(f64, f64)>,
    /// Written at the track's end and in the legend; may be empty.
    pub label: String,
    /// Drawn on top and more strongly than the others.
    pub highlighted: bool,
}

/// What a body is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyShade {
    /// A person or another moving thing that is no robot: light gray.
    Active,
    /// The robot of this number, in the color of the track of that number.
    Robot(usize),
}

/// A body as it stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BodyRect {
    /// Leftmost column.
    pub col: u32,
    /// Lowest row.
    pub row: u32,
    /// Width in boxes.
    pub width: u32,
    /// Height in boxes.
    pub height: u32,
    /// Quarter turns counter-clockwise from east (0 east, 1 north, 2 west, 3 south; taken modulo
    /// 4); drawn as an arrowhead.
    pub heading: Option<u8>,
    /// Person or robot.
    pub shade: BodyShade,
}

/// A map with everything on it. Rows count upward: row 0 is the lowest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct GridScene {
    /// Columns of the map.
    pub width: u32,
    /// Rows of the map.
    pub height: u32,
    /// Side of a box in meters.
    pub box_size_m: f64,
    /// World coordinates, in meters, of the map's lower left corner.
    pub origin_m: [f64; 2],
    /// `width` times `height` boxes: row 0 first, columns from the left.
    pub cells: Vec<CellShade>,
    /// Doors, as they stand.
    pub doors: Vec<DoorRect>,
    /// Robots' tracks; the number of a track is its color.
    pub tracks: Vec<Track>,
    /// Bodies, as they stand.
    pub bodies: Vec<BodyRect>,
    /// Heading of the picture; may be empty.
    pub title: String,
    /// Small print under the picture; may be empty.
    pub caption: String,
}

/// Draws a map: walls dark gray, active objects lighter, tracks as ribbons as wide as the robot.
///
/// The picture stays small on large maps: all walls are one path of merged rectangles, and a track
/// that runs to and fro is drawn once.
///
/// # Errors
/// [`DrawError::Length`] if `cells` has not one entry per box; [`DrawError::TooLarge`] above 2^28
/// boxes; [`DrawError::Value`] if there is no box, a box or a track has no positive, finite size, the origin is not
/// finite, or the style is impossible.
pub fn to_svg(scene: &GridScene, style: &Style) -> Result<String, DrawError> {
    style.check()?;
    check(scene)?;
    let px = pixels_per_box(scene, style);
    let area = Area {
        origin_m: scene.origin_m,
        boxes: [scene.width, scene.height].map(f64::from),
        box_size_m: scene.box_size_m,
        title: &scene.title,
        caption: &scene.caption,
    };
    let mut svg = Svg::default();
    let sheet = Sheet::open(&mut svg, &area, style, px);
    draw_map(&mut svg, scene, &sheet);
    draw_marks(&mut svg, scene, &sheet, style);
    sheet.close(svg, &area, furniture::entries(scene), style)
}

fn check(scene: &GridScene) -> Result<(), DrawError> {
    let boxes = u64::from(scene.width) * u64::from(scene.height);
    if boxes > MOST_BOXES {
        return Err(DrawError::TooLarge {
            what: "boxes of the map",
            found: boxes,
            limit: MOST_BOXES,
        });
    }
    DrawError::some("number of the map's boxes", boxes as usize)?;
    DrawError::length("boxes of the map", boxes as usize, scene.cells.len())?;
    DrawError::positive("box size in m", scene.box_size_m)?;
    for value in scene.origin_m {
        if !value.is_finite() {
            return Err(DrawError::Value { what: "origin in m", value, must: "finite" });
        }
    }
    for track in &scene.tracks {
        DrawError::positive("track width in boxes", track.width_boxes)?;
    }
    Ok(())
}

/// The scale at which the map fits the style's room; a whole number where boxes are large, so
/// that walls have sharp edges.
fn pixels_per_box(scene: &GridScene, style: &Style) -> f64 {
    let across = style.width_px / f64::from(scene.width);
    let upward = style.height_px / f64::from(scene.height);
    let px = across.min(upward).min(LARGEST_BOX_PX);
    if px >= 2.0 { px.floor() } else { px }
}

/// Draws everything that has its place in boxes, in a group whose unit is one box, y upward.
fn draw_map(svg: &mut Svg, scene: &GridScene, sheet: &Sheet) {
    let map = sheet.map;
    svg.open_clip(map);
    let (x, y, px) = (Num(map.x), Num(map.bottom()), sheet.px);
    svg.raw(format_args!(r#"<g transform="translate({x} {y}) scale({px} -{px})">"#));
    cells::draw(svg, scene, CellShade::Unknown, UNKNOWN);
    cells::draw(svg, scene, CellShade::Wall, WALL);
    for door in &scene.doors {
        draw_door(svg, door, px);
    }
    for (index, track) in in_drawing_order(&scene.tracks) {
        ribbon::draw(svg, track, series_color(index));
    }
    for body in &scene.bodies {
        draw_body(svg, body, px);
    }
    svg.close_group();
    svg.close_group();
    svg.rect(map, format_args!(r#"fill="none" stroke="{INK}""#));
}

/// The tracks with their numbers, highlighted ones last.
fn in_drawing_order(tracks: &[Track]) -> impl Iterator<Item = (usize, &Track)> {
    let pick = |highlighted| move |(_, track): &(usize, &Track)| track.highlighted == highlighted;
    let plain = tracks.iter().enumerate().filter(pick(false));
    plain.chain(tracks.iter().enumerate().filter(pick(true)))
}

fn boxes((col, row): (u32, u32), (width, height): (u32, u32)) -> Rect {
    Rect { x: col.into(), y: row.into(), width: width.into(), height: height.into() }
}

fn draw_door(svg: &mut Svg, door: &DoorRect, px: f64) {
    let place = boxes((door.col, door.row), (door.width, door.height));
    let rim = Fine(1.0 / px);
    let (fill, dash) = match door.open {
        true => ("none", format!(r#" stroke-dasharray="{} {}""#, Fine(3.0 / px), Fine(2.0 / px))),
        false => (ACTIVE, String::new()),
    };
    let look = format!(r#"fill="{fill}" stroke="{ACTIVE_RIM}" stroke-width="{rim}"{dash}"#);
    // The rim stays inside the door.
    svg.rect(place.grown(-0.5 / px), look);
}

fn draw_body(svg: &mut Svg, body: &BodyRect, px: f64) {
    let (fill, rim) = match body.shade {
        BodyShade::Active => (ACTIVE, ACTIVE_RIM),
        BodyShade::Robot(index) => (series_color(index), INK),
    };
    let place = boxes((body.col, body.row), (body.width, body.height));
    let look = format!(r#"fill="{fill}" stroke="{rim}" stroke-width="{}""#, Fine(1.0 / px));
    svg.rect(place.grown(-0.5 / px), look);
    if let Some(quarters) = body.heading {
        draw_arrowhead(svg, place, quarters);
    }
}

/// An arrowhead over the middle of `place`, in units of boxes.
fn draw_arrowhead(svg: &mut Svg, place: Rect, quarters: u8) {
    let (x, y) = (place.x + place.width / 2.0, place.y + place.height / 2.0);
    let size = 0.34 * place.width.min(place.height);
    let degrees = 90 * (u32::from(quarters) % 4);
    let data = format!(
        "M{} 0L-{} {}V-{}Z",
        Fine(size),
        Fine(0.7 * size),
        Fine(0.8 * size),
        Fine(0.8 * size)
    );
    let turn = format!(r#"transform="translate({} {}) rotate({degrees})""#, Num(x), Num(y));
    svg.path(&data, format_args!(r##"{turn} fill="#FFFFFF""##));
}

/// A length in boxes, to a thousandth of a pixel even where boxes are large.
struct Fine(f64);

impl std::fmt::Display for Fine {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", (self.0 * 1e4).round() / 1e4)
    }
}

/// Start and end of every track, and its label, in pixels. Where the robot itself is drawn it needs
/// no mark of its track's end.
fn draw_marks(svg: &mut Svg, scene: &GridScene, sheet: &Sheet, style: &Style) {
    let labeled = scene.tracks.len() <= MOST_END_LABELS;
    for (index, track) in in_drawing_order(&scene.tracks) {
        let Some((start, end)) = ribbon::ends(track) else { continue };
        let stands = scene.bodies.iter().any(|body| body.shade == BodyShade::Robot(index));
        let half_px = 0.5 * track.width_boxes * sheet.px;
        let radius = (0.56 * half_px).clamp(3.0, 6.0);
        let color = series_color(index);
        start_mark(svg, sheet.at(start), radius, color);
        if !stands {
            end_mark(svg, sheet.at(end), radius, color);
        }
        if labeled && sheet.shows(end) {
            let clear_px = if stands { half_px } else { radius };
            write_label(svg, sheet, sheet.at(end), clear_px, &track.label, style);
        }
    }
}

/// Writes a track's label beside its end, `clear_px` away, on the side where the map has room.
fn write_label(
    svg: &mut Svg,
    sheet: &Sheet,
    (x, y): (f64, f64),
    clear_px: f64,
    label: &str,
    style: &Style,
) {
    let size = style.small_px();
    let width = crate::text::width(label, size, crate::text::Weight::Bold);
    let fits_right = x + clear_px + 4.0 + width <= sheet.map.right();
    let (anchor, side) = if fits_right { (Anchor::Start, 1.0) } else { (Anchor::End, -1.0) };
    let look =
        TextLook { halo: true, weight: crate::text::Weight::Bold, ..TextLook::new(size, anchor) };
    svg.text(x + side * (clear_px + 4.0), y + look.middle_px(), label, &look);
}

/// Small print's look.
fn faint(size_px: f64) -> TextLook<'static> {
    TextLook { fill: FAINT_INK, ..TextLook::new(size_px, Anchor::Start) }
}
