//! Compilation of the map section to boxes.

use super::*;
use sidestep_import::{GridOptions, ImportReport, ImportedMap};

/// Longest side of a map: poses are recorded with 15 bits per coordinate, and the border takes some of that on
/// both sides.
const MAX_SIDE_BOXES: u32 = (1 << 15) - 2 * MAX_PATH_STEPS as u32;

/// The map of a scenario.
pub(super) struct LoadedMap {
    pub(super) map: Arc<GridMap>,
    /// The doors that a generated office has.
    pub(super) doors: Vec<Rect>,
    /// What will surprise about the map's file.
    pub(super) remarks: Vec<Remark>,
}

/// Returns the map of a scenario.
///
/// # Errors
/// When the map cannot be read, is absurdly large, or has no free box.
pub(super) fn load_map(
    source: &Source,
    section: &Spanned<MapSection>,
) -> Result<LoadedMap, InputError> {
    let (imported, doors) = read_map(source, section)?;
    let ImportedMap { map, report } = imported;
    if map.width() > MAX_SIDE_BOXES || map.height() > MAX_SIDE_BOXES {
        let cause = format!("a map of {} x {} boxes", map.width(), map.height());
        let remedy = format!("use larger boxes: at most {MAX_SIDE_BOXES} a side");
        return Err(source.error(section.span(), cause, remedy));
    }
    if map.count(Cell::Free) == 0 {
        let remedy = "use smaller boxes, another map, or unknown = \"free\"";
        return Err(source.error(section.span(), "the map has no free box", remedy));
    }
    let mut remarks = report.remarks("map.file");
    remarks.extend(unknown_remark(source, section.get_ref(), &report));
    Ok(LoadedMap { map: Arc::new(map), doors, remarks })
}

/// Returns a note on the key `unknown` of a map in which nothing is unknown.
fn unknown_remark(source: &Source, s: &MapSection, report: &ImportReport) -> Option<Remark> {
    let is_given = source.keys("map").iter().any(|key| key.name == "unknown");
    let is_drawn = s.ascii.as_ref().is_some_and(|art| art.contains('?'));
    let is_read = report.kept.iter().any(|item| item.noun.starts_with("unknown") && item.count > 0);
    let words = "has no effect: nothing of the map is unknown";
    (is_given && !is_drawn && !is_read).then(|| Remark::note("map.unknown", words))
}

fn read_map(
    source: &Source,
    section: &Spanned<MapSection>,
) -> Result<(ImportedMap, Vec<Rect>), InputError> {
    let s = section.get_ref();
    if let (Some(_), None) = (&s.resolution_m, &s.file) {
        let cause = "`resolution_m` is the side of a pixel, and there is no image";
        return Err(source.error(
            section.span(),
            cause,
            "leave it out, or give an image as `file`",
        ));
    }
    // By default the paper's robot, 0.53 m across, covers 2 x 2 boxes.
    let box_size_m = s.box_size_m.map_or(0.25, f64::from);
    match (&s.file, &s.ascii, &s.office) {
        (Some(file), None, None) => {
            let resolution_m = s.resolution_m.map(f64::from);
            let boxes = GridOptions { box_size_m, resolution_m, unknown: s.unknown };
            let imported = sidestep_import::import_map(&source.path(file.get_ref()), boxes);
            let imported = imported.map_err(|error| source.with_key_at(file.span(), error))?;
            Ok((imported, Vec::new()))
        }
        (None, Some(art), None) => {
            let place = format!("{} (map.ascii)", source.place);
            let map = sidestep_import::ascii::parse(&place, art, box_size_m)?;
            Ok((without_report(map.with_unknown(s.unknown)), Vec::new()))
        }
        (None, None, Some(spec)) => {
            let office = spec.get_ref().build(box_size_m);
            let office = office.map_err(|error| source.error_from(spec.span(), &error))?;
            Ok((without_report(office.map), office.doors))
        }
        _ => {
            let cause = "the map needs exactly one of `file`, `ascii` and `office`";
            let remedy = "write e.g. [map] with file = \"building.yaml\"";
            Err(source.error(section.span(), cause, remedy))
        }
    }
}

/// Returns a map that is from no file.
fn without_report(map: GridMap) -> ImportedMap {
    ImportedMap { map, report: ImportReport::default() }
}

/// Returns the map with its border, one byte per box, in the form in which states start.
pub(super) fn padded(map: &GridMap, border: u32, stride: u32, rows: u32) -> Vec<u8> {
    use crate::sensor::{FREE, WALL};
    let mut grid = vec![WALL; stride as usize * rows as usize];
    let width = map.width() as usize;
    for (row, cells) in map.cells().chunks(width.max(1)).enumerate() {
        let first = (row + border as usize) * stride as usize + border as usize;
        for (to, &cell) in grid[first..first + width].iter_mut().zip(cells) {
            *to = if cell == Cell::Free { FREE } else { WALL };
        }
    }
    grid
}
