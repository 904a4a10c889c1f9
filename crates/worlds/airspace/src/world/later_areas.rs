//! Areas that begin while airplanes fly through them.
//!
//! The stored fallback of an airplane keeps clear of such an area from its begin on (`shield/areas.rs`): where it is by then it
//! stays forever. So an airplane may be in the area before, as long as some fallback leads out of it in time. Those that
//! suffice among airplanes do so in small areas only. An airplane whose route leads through a larger one has longer ones,
//! too: straight on, until it has come through.

use super::AirspaceWorld;
use crate::areas::{Area, AreaKind, square_to_edge_m2};
use crate::shield::Fallback;
use std::sync::Arc;

impl AirspaceWorld {
    /// Returns fallbacks with longer ones beside them that lead out of areas that begin while an airplane flies.
    pub(super) fn with_escape_fallbacks(
        &self,
        i: usize,
        choices: Arc<[Fallback]>,
    ) -> Arc<[Fallback]> {
        let v_m_s = self.airplanes[i].model.v_m_s;
        let longest = choices.iter().map(|choice| choice.straight_cycles).max().unwrap_or(0);
        let dt_m = v_m_s * self.timing.dt_s;
        let longest_m = f64::from(longest) * dt_m;
        let crossed = self.areas.iter().filter(|area| self.is_crossed_before_begin(i, area));
        let radius_m = crossed.map(|area| area.shape.radius_m()).fold(0.0, f64::max);
        // From the middle of a smaller one, those lead out.
        if longest == 0 || radius_m <= longest_m {
            return choices;
        }
        // The orbit behind it has to be outside, too.
        let orbit_m = 2.0 * v_m_s / self.orbit_rad_s[i] + dt_m;
        Fallback::with_longer_straights(&choices, (2.0 * radius_m + orbit_m) / dt_m)
    }

    /// Returns whether the route of an airplane leads through an area that begins later, and stands in the air.
    fn is_crossed_before_begin(&self, i: usize, area: &Area) -> bool {
        let airplane = &self.airplanes[i];
        let is_later = area.from_s > airplane.appears_s && area.kind == AreaKind::Out;
        // No fallback is clear forever of one that moves relative to the air.
        let is_at_rest =
            !area.is_moving() && self.wind_m_s == [0.0; 2] && self.wind_field.is_none();
        if !is_later || !is_at_rest {
            return false;
        }
        let plane = area.plane_at(self.surface, area.from_s);
        let radius_m = area.shape.radius_m();
        let mut from = plane.to_area(airplane.start.at);
        for &way_point in &airplane.mission {
            let to = plane.to_area(way_point);
            if square_to_edge_m2([0.0; 2], [from, to]) < radius_m * radius_m {
                return true;
            }
            from = to;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use crate::shield::area_tests::unnamed_entries;
    use crate::shield::guarantee_tests::{lost_and_named, plane, run};
    use sidestep_kernel::Simulation;

    /// An area 8 km wide that begins at a time, and one airplane that is through it after six minutes.
    fn crossing(from_s: f64) -> crate::AirspaceRun {
        let area = format!(
            "[[airspace.areas]]\ncircle = {{ at_m = [0.0, 0.0], radius_m = 4000.0 }}\nfrom_s = {from_s:?}\n"
        );
        let airplanes = plane([-8000.0, 0.0], 0.0, [8000.0, 0.0], "");
        let mut run = run("method = \"none\"", &format!("{area}{airplanes}"));
        run.advance(400);
        run
    }

    #[test]
    fn an_area_is_open_to_those_that_are_through_it_before_it_begins() {
        let through = crossing(700.0);
        let metrics = through.metrics();
        assert_eq!((metrics.arrived, metrics.shield_overrides), (1, 0));
        assert!(through.world().airplanes[0].detours.is_empty());
        // It would come through too late, and flies around.
        let around = crossing(250.0);
        assert!(!around.world().airplanes[0].detours.is_empty());
        assert_eq!(around.metrics().arrived, 1);
        assert!(unnamed_entries(&around).is_empty());
    }

    #[test]
    fn two_that_cross_in_an_area_that_begins_later_keep_apart_and_leave_it() {
        let area = "[[airspace.areas]]\ncircle = { at_m = [0.0, 0.0], radius_m = 6000.0 }\nfrom_s = 600.0\n";
        for method in ["none", "pc", "mvp"] {
            let airplanes = plane([-7000.0, 0.0], 0.0, [8000.0, 0.0], "")
                + &plane([0.0, -7000.0], 90.0, [0.0, 8000.0], "")
                + &plane([7000.0, 300.0], 180.0, [-8000.0, 300.0], "");
            let keys = format!("method = \"{method}\"");
            let mut run = run(&keys, &format!("{area}{airplanes}"));
            run.advance(300);
            let (lost, named) = lost_and_named(&run);
            assert!(lost.is_empty() && named.is_empty(), "{method}: {lost:?} {named:?}");
            assert!(run.collector().counters.areas.is_empty(), "{method}");
        }
    }
}
