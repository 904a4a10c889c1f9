//! Remarks on a valid scenario: what will surprise its author. `sidestep check` shows them.

use super::scenario::Compiled;
use sidestep_scenario::Remark;

/// Returns the remarks, warnings first.
pub(super) fn remarks(compiled: &Compiled) -> Vec<Remark> {
    let mut remarks = compiled.remarks.clone();
    // Sorting is stable: among equals the order of the scenario stays.
    remarks.sort_by_key(|remark| remark.severity);
    remarks
}
