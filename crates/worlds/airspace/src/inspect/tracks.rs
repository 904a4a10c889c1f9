//! The tracks of an airplane, and how far they are off.

use super::{Inspector, airplane};
use sidestep_kernel::view::{FactSection, FactTable, FactValue, Inspection, MarkRole, MarkShape};

impl Inspector<'_> {
    /// Adds the tracks that it has of others by the reports that it has received; nothing where all see all.
    pub(super) fn add_tracks_section(&self, inspection: &mut Inspection) {
        let Some(tracks) = &self.trace.tracks else { return };
        let mut table = FactTable::new(["airplane", "last report", "off by"]);
        for track in tracks {
            let at = track.present_position(self.world);
            let current = &self.before.airplanes[track.slot as usize];
            let off_m = self.world.surface.distance_m(at, current.pose().at);
            table.push_row([
                airplane(track.slot).into(),
                FactValue::number(track.age_s, "s"),
                FactValue::meters(off_m),
            ]);
            let label = format!("track of {}", self.world.display_name(track.slot));
            let at_m = self.point_on_level(at);
            inspection.add_mark(MarkRole::Known, label, MarkShape::Point { at_m });
        }
        inspection.add_section(
            FactSection::new("Tracks")
                .fact("airplanes", FactValue::count(tracks.len()))
                .table(table),
        );
    }
}
