//! The paths to the errands of robots with tasks, for looking at their progress and at who is in their way.

use sidestep_map::planning::{FlowField, FreeSpace};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Most boxes of a floor on which robots with tasks are looked at: a path to each errand takes as long as the floor is
/// large, and most errands are gone to by one robot alone.
pub(crate) const MAX_WATCHED_BOXES: usize = 1 << 14;
/// Most fields that are kept: some 100 MB on the largest floor.
const MAX_FIELDS: usize = 4096;

/// The paths to the errands of a team. They depend on the floor alone; what is forgotten is computed again.
#[derive(Debug)]
pub(crate) struct ErrandFields {
    free: FreeSpace,
    size: u32,
    fields: BTreeMap<(u32, u32), Arc<FlowField>>,
}

impl ErrandFields {
    /// Creates them for bodies of `size` x `size` boxes; none on a floor that is too large.
    pub(crate) fn new(free: &FreeSpace, size: u32) -> Option<Self> {
        let boxes = free.width() as usize * free.height() as usize;
        let is_watched = boxes <= MAX_WATCHED_BOXES;
        is_watched.then(|| Self { free: free.clone(), size, fields: BTreeMap::new() })
    }

    /// Returns the paths to an errand.
    pub(crate) fn field(&mut self, errand: (u32, u32)) -> Arc<FlowField> {
        if self.fields.len() >= MAX_FIELDS && !self.fields.contains_key(&errand) {
            self.fields.pop_first();
        }
        let Self { free, size, fields } = self;
        let field = fields
            .entry(errand)
            .or_insert_with(|| Arc::new(FlowField::to_nearest(free, *size, &[errand])));
        Arc::clone(field)
    }
}
