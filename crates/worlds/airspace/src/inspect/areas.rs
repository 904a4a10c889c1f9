//! The areas around an airplane.

use super::Inspector;
use crate::areas::AreaKind;
use sidestep_kernel::view::{FactSection, FactTable, FactValue, Inspection};

/// Number of areas that are listed: the nearest ones.
const MAX_AREAS: usize = 5;

impl Inspector<'_> {
    /// Adds the nearest areas that last now, and whether the airplane is exempt from them.
    pub(super) fn add_areas_section(&self, inspection: &mut Inspection) {
        let Self { world, before, now, id, .. } = *self;
        if world.areas.is_empty() {
            return;
        }
        let now_s = world.cycle_start_s(now);
        let current = &before.airplanes[id as usize];
        let at = current.pose().at;
        let mut near: Vec<(f64, usize)> = world
            .areas
            .iter()
            .enumerate()
            .filter(|(_, area)| area.lasts_at(now_s))
            .map(|(k, area)| (area.clearance_m(area.plane_at(world.surface, now_s).to_area(at)), k))
            .collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        let exempt = self.exempt_areas();
        let mut table =
            FactTable::new(["area", "airplanes stay", "clear of it by", "on its levels", "exempt"]);
        for &(clearance_m, k) in near.iter().take(MAX_AREAS) {
            let area = &world.areas[k];
            let stay = match area.kind {
                AreaKind::Out => "outside",
                AreaKind::In => "inside",
            };
            let altitude_m = current.altitude_m.get();
            let is_on_levels = area.levels.low_m < altitude_m && altitude_m < area.levels.high_m;
            table.push_row([
                area.display_name(k).into(),
                stay.into(),
                FactValue::meters(clearance_m),
                is_on_levels.into(),
                exempt.contains(&(k as u32)).into(),
            ]);
        }
        inspection.add_section(
            FactSection::new("Areas")
                .fact("at this time", FactValue::count(near.len()))
                .table(table),
        );
    }

    /// Returns the numbers of the areas from which it is exempt.
    fn exempt_areas(&self) -> Vec<u32> {
        let Some(aircraft) = &self.trace.aircraft else { return Vec::new() };
        let near = aircraft.areas.as_deref().unwrap_or_default();
        let exempt = near.iter().filter(|area| {
            area.is_on_levels(&aircraft.levels) && aircraft.stored_conflict_s(area) < f64::INFINITY
        });
        exempt.map(|area| area.number).collect()
    }
}
