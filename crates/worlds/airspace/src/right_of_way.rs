//! Right of way: which of two airplanes gives way, and what that means to each method.
//!
//! | Method | One that has right of way | One that gives way |
//! |---|---|---|
//! | `mvp` | does not see the other | resolves the conflict, as it always does |
//! | `orca` | does not see the other | resolves all of the conflict, not its half |
//! | `bands` | does not see the other | keeps out of its bands, as it always does |
//! | `pc` | its deviations cost 100 times as much | |
//! | shield | of two with different priorities it goes first | |
//!
//! An airplane of a higher priority has right of way over all of a lower one. Between others it follows from the rules of
//! the air where the scenario asks for them (ICAO Annex 2, 3.2.2): of two that converge the one that has the other on
//! its right gives way; one that overtakes gives way; of two head-on neither has right of way. Or it follows from phases of
//! flight, as with `PRIORULES` of BlueSky: those that cruise have right of way over those that climb or descend, or the
//! other way round, and of two in one phase neither has. It follows from what all see and what is filed, so
//! all agree on it without a word, unless each sees others by tracks of its own. `decide/deviation_weights.rs` has the weights of `pc`.
//!
//! By phases, the rules of BlueSky 1.1.1 decide on the vertical part of a resolution by `mvp`, too
//! ([`RightOfWayRule::vertical_share`]). An airplane that has right of way flies its plan here; there it keeps its
//! track, speed and vertical speed for as long as the conflict lasts.

use crate::baseline::AircraftState;
use crate::flight::CLIMB_M_S;
use crate::flight::{AirplaneStart, FlightOrder, FlightTask, KnownAircraft};
use crate::settings::RightOfWayRule;
use crate::world::AirspaceWorld;
use sidestep_kernel::EntitySlot;
use sidestep_kernel::geometry::{dot, norm_squared, sub};
use sidestep_kernel::math;
use std::f64::consts::PI;

/// An airplane overtakes another one that it approaches from within this angle of straight behind, in radians: less
/// than 70 degrees by the rules of the air.
const MAX_OVERTAKING_RAD: f64 = 70.0 * PI / 180.0;
/// Two whose headings differ from opposite ones by less are head-on, in radians. The rules say "approximately"; 20
/// degrees is our choice.
const MAX_HEAD_ON_RAD: f64 = 20.0 * PI / 180.0;

/// Vertical speed in meters per second below which an airplane cruises; else it climbs or descends. BlueSky's value.
const MAX_CRUISE_CLIMB_M_S: f64 = 0.1;

/// Which of two airplanes gives way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Yielding {
    /// The first one alone.
    First,
    /// The second one alone.
    Second,
    /// Both: neither has right of way.
    Both,
}

impl Yielding {
    /// Returns the same for the two in the other order.
    pub(crate) fn swapped(self) -> Self {
        match self {
            Self::First => Self::Second,
            Self::Second => Self::First,
            Self::Both => Self::Both,
        }
    }

    /// Returns the second airplane as the first one has to mind it: not at all if it gives way, and as one that does not
    /// give way if it has right of way.
    pub(crate) fn as_minded(self, second: AircraftState) -> Option<AircraftState> {
        match self {
            Self::First => Some(AircraftState { yields: false, ..second }),
            Self::Second => None,
            Self::Both => Some(second),
        }
    }
}

impl RightOfWayRule {
    /// Returns which of two airplanes gives way, each as it is seen in one plane.
    fn yielding(self, first: &AircraftState, second: &AircraftState) -> Yielding {
        match self {
            Self::None => Yielding::Both,
            Self::RulesOfTheAir => rules_of_the_air(first, second),
            Self::CruisingFirst | Self::CruisingFirstHorizontal => cruising_first(first, second),
            Self::ClimbingFirst | Self::ClimbingFirstHorizontal => {
                cruising_first(first, second).swapped()
            }
        }
    }

    /// Returns the part of the vertical change that resolves a conflict which an airplane flies by `mvp`. In BlueSky it is
    /// half of it, also beside one that has right of way, or nothing; without a rule by phases one flies all of it beside
    /// another one that does not give way. Nobody has right of way over one that avoids nobody.
    pub(crate) fn vertical_share(self, own: &AircraftState, other: &AircraftState) -> f64 {
        let share = if other.yields { 0.5 } else { 1.0 };
        let gives_way = other.is_cooperative && self.yielding(own, other) == Yielding::First;
        match self {
            Self::None | Self::RulesOfTheAir => share,
            Self::CruisingFirst if gives_way => 0.5,
            Self::ClimbingFirst if gives_way => 0.0,
            Self::CruisingFirst | Self::ClimbingFirst => share,
            Self::CruisingFirstHorizontal | Self::ClimbingFirstHorizontal => 0.0,
        }
    }
}

/// Returns which of two airplanes gives way if those that cruise have right of way.
fn cruising_first(first: &AircraftState, second: &AircraftState) -> Yielding {
    match [is_cruising(first), is_cruising(second)] {
        [true, false] => Yielding::Second,
        [false, true] => Yielding::First,
        _ => Yielding::Both,
    }
}

/// Returns whether an airplane neither climbs nor descends.
fn is_cruising(one: &AircraftState) -> bool {
    one.climb_m_s.abs() < MAX_CRUISE_CLIMB_M_S
}

/// Returns which of two airplanes gives way by the rules of the air, each as it is seen in one plane.
fn rules_of_the_air(first: &AircraftState, second: &AircraftState) -> Yielding {
    let is_overtaking = [overtakes(first, second), overtakes(second, first)];
    match is_overtaking {
        [true, false] => return Yielding::First,
        [false, true] => return Yielding::Second,
        _ => {}
    }
    let turn_rad = math::wrap_angle(second.heading_rad - first.heading_rad);
    if PI - turn_rad.abs() < MAX_HEAD_ON_RAD {
        return Yielding::Both;
    }
    match [is_on_right(first, second), is_on_right(second, first)] {
        [true, false] => Yielding::First,
        [false, true] => Yielding::Second,
        _ => Yielding::Both,
    }
}

/// Returns whether an airplane approaches another one from behind.
fn overtakes(own: &AircraftState, other: &AircraftState) -> bool {
    let from_other = sub(own.at, other.at);
    let closing = sub(own.velocity, other.velocity);
    let bearing_rad = math::atan2(from_other[1], from_other[0]);
    let off_tail_rad = PI - math::wrap_angle(bearing_rad - other.heading_rad).abs();
    off_tail_rad < MAX_OVERTAKING_RAD && dot(from_other, closing) < 0.0
        // One that is faster; of two that converge from one side both are behind each other's wings.
        && norm_squared(own.velocity) > norm_squared(other.velocity)
}

/// Returns whether an airplane has another one on its right, ahead or abeam.
fn is_on_right(own: &AircraftState, other: &AircraftState) -> bool {
    let [dx, dy] = sub(other.at, own.at);
    let bearing_rad = math::wrap_angle(math::atan2(dy, dx) - own.heading_rad);
    bearing_rad < 0.0
}

impl AirspaceWorld {
    /// Returns which of two airplanes gives way, the first one with the smaller slot, as they are seen in one plane.
    pub(crate) fn yielding(&self, first: &AircraftState, second: &AircraftState) -> Yielding {
        let [a, b] = [first, second].map(|one| self.priority(one.slot));
        match a.cmp(&b) {
            std::cmp::Ordering::Less => Yielding::First,
            std::cmp::Ordering::Greater => Yielding::Second,
            std::cmp::Ordering::Equal => self.right_of_way.yielding(first, second),
        }
    }

    /// Returns the rate of climb of an airplane in meters per second, as far as its altitude and its filed levels say: 0 on
    /// one of these. Which orders it has carried out nobody has to know for that.
    pub(crate) fn filed_climb_m_s(&self, known: KnownAircraft) -> f64 {
        if known.command.level.is_some() {
            return self.known_segment(known).signed_climb_m_s(known.altitude_m);
        }
        let AirplaneStart { altitude_m, orders, .. } = &self.airplanes[known.slot as usize];
        let is_order_to_level = |order: &FlightOrder| matches!(order.task, FlightTask::Altitude { altitude_m, .. } if altitude_m == known.altitude_m);
        let is_on_filed_level =
            known.altitude_m == *altitude_m || orders.iter().any(is_order_to_level);
        if is_on_filed_level { 0.0 } else { CLIMB_M_S }
    }

    /// Returns the priority of an airplane.
    pub(crate) fn priority(&self, slot: EntitySlot) -> u8 {
        self.airplanes[slot as usize].priority
    }

    /// Returns whether any airplane ever has right of way over another one.
    pub(crate) fn may_have_right_of_way(&self) -> bool {
        let first = self.airplanes.first().map(|airplane| airplane.priority);
        self.right_of_way != RightOfWayRule::None
            || self.airplanes.iter().any(|airplane| Some(airplane.priority) != first)
    }
}

#[cfg(test)]
mod bluesky_tests;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::baseline::test_aircraft;
    use crate::{AirspaceRun, airspace_run};
    use proptest::prelude::*;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    fn aircraft(slot: EntitySlot, at: [f64; 2], heading_deg: f64) -> AircraftState {
        test_aircraft(slot, at, heading_deg.to_radians())
    }

    #[test]
    fn beside_an_airplane_that_avoids_nobody_one_resolves_a_conflict_by_itself_whatever_the_phases()
    {
        let own = aircraft(0, [0.0, 0.0], 0.0);
        let climbing = AircraftState { climb_m_s: 5.0, ..aircraft(1, [4000.0, 0.0], 180.0) };
        let intruder = AircraftState { yields: false, is_cooperative: false, ..climbing };
        let rule = RightOfWayRule::ClimbingFirst;
        assert_eq!(rule.vertical_share(&own, &climbing), 0.0);
        assert_eq!(rule.vertical_share(&own, &intruder), 1.0);
        let climbing_own = AircraftState { climb_m_s: 5.0, ..own };
        let cruising = AircraftState { climb_m_s: 0.0, ..intruder };
        assert_eq!(RightOfWayRule::CruisingFirst.vertical_share(&climbing_own, &cruising), 1.0);
    }

    #[test]
    fn who_has_the_other_on_its_right_or_overtakes_gives_way() {
        let east = aircraft(0, [0.0, 0.0], 0.0);
        let fast =
            |one: AircraftState| AircraftState { velocity: one.velocity.map(|v| 2.0 * v), ..one };
        let cases = [
            // From its right, from its left, and at an angle.
            (aircraft(1, [2000.0, -2000.0], 90.0), Yielding::First),
            (aircraft(1, [2000.0, 2000.0], -90.0), Yielding::Second),
            (aircraft(1, [2000.0, 1500.0], -130.0), Yielding::Second),
            // Head-on, exactly and nearly.
            (aircraft(1, [4000.0, 0.0], 180.0), Yielding::Both),
            (aircraft(1, [4000.0, -100.0], 170.0), Yielding::Both),
            // It is overtaken, from straight behind and from its right.
            (fast(aircraft(1, [-3000.0, 10.0], 0.0)), Yielding::Second),
            (fast(aircraft(1, [-3000.0, -2000.0], 30.0)), Yielding::Second),
            // From its right, and not from behind.
            (fast(aircraft(1, [0.0, -3000.0], 80.0)), Yielding::First),
        ];
        for (other, expected) in cases {
            assert_eq!(rules_of_the_air(&east, &other), expected, "{other:?}");
        }
    }

    proptest! {
        /// Each of two comes to the same, however they lie.
        #[test]
        fn two_never_both_have_right_of_way(
            x in -5000.0f64..5000.0, y in -5000.0f64..5000.0, heading_deg in -180.0f64..180.0, factor in 0.5f64..2.0,
        ) {
            let one = aircraft(0, [0.0, 0.0], 0.0);
            let other = aircraft(1, [x, y], heading_deg);
            let other = AircraftState { velocity: other.velocity.map(|v| factor * v), ..other };
            prop_assert_eq!(rules_of_the_air(&one, &other), rules_of_the_air(&other, &one).swapped());
        }
    }

    /// Flies two that meet at right angles, airplane 1 from the right of airplane 0. Returns how far each has strayed
    /// from its straight way, in meters, and the run.
    fn crossing(keys: &str, [first, second]: [&str; 2]) -> ([f64; 2], AirspaceRun) {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\n{keys}\n\
             [[airplanes]]\nat_m = [-4000, 0]\nheading_deg = 0\nway_points_m = [[6000, 0]]\n{first}\n\
             [[airplanes]]\nat_m = [0, -4000]\nheading_deg = 90\nway_points_m = [[0, 6000]]\n{second}\n"
        );
        let mut run = airspace_run(&Source::new("crossing", text, ""), 1).expect("a scenario");
        let mut strayed_m = [0.0f64; 2];
        for _ in 0..45 {
            run.advance(1);
            let airplanes = &run.state().airplanes;
            strayed_m[0] = strayed_m[0].max(airplanes[0].pose().at[1].abs());
            strayed_m[1] = strayed_m[1].max(airplanes[1].pose().at[0].abs());
        }
        assert_eq!(run.metrics().losses_of_separation, 0, "{keys}");
        (strayed_m, run)
    }

    #[test]
    fn with_every_method_the_one_from_the_right_keeps_its_way() {
        for method in ["pc", "mvp", "orca", "bands"] {
            for shield in ["on", "off"] {
                let keys = format!(
                    "method = \"{method}\"\nshield = \"{shield}\"\nright_of_way = \"rules-of-the-air\""
                );
                let (strayed_m, _) = crossing(&keys, ["", ""]);
                // `pc` weighs the deviations of both, and the shield may ask for a little.
                assert!(strayed_m[1] < 80.0, "{method} {shield}: {strayed_m:?}");
                assert!(strayed_m[0] > 5.0 * strayed_m[1], "{method} {shield}: {strayed_m:?}");
            }
        }
    }

    #[test]
    fn a_higher_priority_has_right_of_way_whatever_the_rules() {
        for method in ["pc", "mvp", "orca", "bands"] {
            for rule in ["", "right_of_way = \"rules-of-the-air\"\n"] {
                let keys = format!("method = \"{method}\"\n{rule}");
                let (strayed_m, _) = crossing(&keys, ["priority = 1", ""]);
                assert!(strayed_m[0] < 20.0, "{method} {rule}: {strayed_m:?}");
                assert!(strayed_m[1] > 100.0, "{method} {rule}: {strayed_m:?}");
            }
        }
    }

    #[test]
    fn every_deployment_gives_way_alike_to_the_bit() {
        for method in ["pc", "mvp"] {
            let digest = |deployment: &str| {
                let keys = format!(
                    "method = \"{method}\"\ndeployment = \"{deployment}\"\nright_of_way = \"rules-of-the-air\"\n\
                     [airspace.generator]\nkind = \"superconflict\"\nn = 4\nradius_m = 3000.0\n"
                );
                crossing(&keys, ["priority = 2", ""]).1.digest()
            };
            let direct = digest("direct");
            for deployment in ["team", "compact-team", "replica-team", "pim"] {
                assert_eq!(digest(deployment), direct, "{method} {deployment}");
            }
        }
    }

    #[test]
    fn equal_priorities_change_nothing() {
        let (_, plain) = crossing("", ["", ""]);
        let (_, equal) = crossing("", ["priority = 3", "priority = 3"]);
        assert_eq!(plain.digest(), equal.digest());
    }
}
