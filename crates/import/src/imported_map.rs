//! A map of boxes with the report of its file.

use super::report::ImportReport;
use sidestep_map::GridMap;

/// A map of boxes that was read from a file.
#[derive(Debug, Clone, PartialEq)]
pub struct ImportedMap {
    /// The boxes.
    pub map: GridMap,
    /// What became of the file.
    pub report: ImportReport,
}

impl ImportedMap {
    /// Completes the report of a map that is given in boxes.
    pub(super) fn of_boxes(map: GridMap, mut report: ImportReport) -> Self {
        let boxes = map.counts();
        let size_m = map.box_size_m;
        report.add_fact("boxes", format!("{} x {} of {size_m} m", map.width(), map.height()));
        report.add_kept("free boxes", boxes.free);
        report.add_kept("walls", boxes.wall);
        report.add_kept("unknown boxes", boxes.unknown);
        Self { map, report }
    }
}
