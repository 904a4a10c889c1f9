//! The map section -> boxes.

use super::*;

/// Farthest corner of a map: poses are recorded with 15 bits per coordinate.
const MAX_SIDE: u32 = (1 << 15) - 2 * MAX_PATH as u32;

/// The map of a scenario, and the doors that a generated office has.
///
/// # Errors
/// When it cannot be read, is absurdly large, or has no free box.
pub(super) fn load_map(
    source: &Source,
    section: &Spanned<MapSection>,
) -> Result<(Arc<GridMap>, Vec<Rect>), InputError> {
    let s = section.get_ref();
    let size_span = s.box_size_m.as_ref().map_or(section.span(), Spanned::span);
    let box_size_m = s.box_size_m.as_ref().map_or(0.25, |b| *b.get_ref());
    if !(box_size_m > 0.0 && box_size_m <= 1000.0) {
        let cause = format!("boxes of {box_size_m} m");
        return Err(source.error(
            Some(size_span),
            cause,
            "give a side above 0 m, typically 0.1 to 0.5",
        ));
    }
    let (map, doors) = match (&s.file, &s.ascii, &s.office) {
        (Some(file), None, None) => {
            let path = source.path(file.get_ref());
            (sidestep_import::map_file(&path, box_size_m, s.unknown)?, Vec::new())
        }
        (None, Some(art), None) => {
            let map = sidestep_import::ascii::parse(
                &format!("{} (map.ascii)", source.place),
                art.get_ref(),
                box_size_m,
            )?;
            (map.with_unknown(s.unknown), Vec::new())
        }
        (None, None, Some(spec)) => {
            let office = spec.get_ref().build(box_size_m).map_err(|e| {
                source.error(Some(spec.span()), format!("{}: {}", e.place(), e.cause()), e.remedy())
            })?;
            (office.map, office.doors)
        }
        _ => {
            return Err(source.error(
                Some(section.span()),
                "the map needs exactly one of `file`, `ascii` and `office`",
                "write e.g. [map] with file = \"building.yaml\"",
            ));
        }
    };
    if map.width() > MAX_SIDE || map.height() > MAX_SIDE {
        let cause = format!("a map of {} x {} boxes", map.width(), map.height());
        return Err(source.error(
            Some(section.span()),
            cause,
            format!("use larger boxes: at most {MAX_SIDE} a side"),
        ));
    }
    if map.count(Cell::Free) == 0 {
        return Err(source.error(
            Some(section.span()),
            "the map has no free box",
            "use smaller boxes, another map, or unknown = \"free\"",
        ));
    }
    Ok((Arc::new(map), doors))
}

/// The map with its border, one byte per box, as states begin.
pub(super) fn padded(map: &GridMap, border: u32, stride: u32, rows: u32) -> Vec<u8> {
    use crate::state::{FREE, WALL};
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
