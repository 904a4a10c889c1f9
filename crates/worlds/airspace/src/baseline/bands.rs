//! Track bands, as DAIDALUS computes them (Muñoz, Narkawicz, Hagen, Upchurch, Dutle, Consiglio and Chamberlain, "DAIDALUS:
//! Detect and Avoid Alerting Logic for Unmanned Systems", 2015), for airplanes that keep their speed.
//!
//! A *band* is a range of headings to which an airplane cannot turn without a conflict: it turns at its greatest rate and
//! then flies straight on, while every other airplane flies straight on as it does now (kinematic bands). The airplane
//! flies the heading nearest to that of its way-point that is in no band. Where all are, the bands are *saturated*, and it
//! flies the recovery: the heading with the largest miss distance, and among equal ones that which is out of the other's
//! zone soonest. Here a conflict is a loss of separation, times a margin; the others need not cooperate.

use super::{AircraftState, vector_length};
use crate::flight::Point;
use crate::settings::ReactiveSettings;
use sidestep_kernel::geometry::{dot, norm_squared, sub};
use sidestep_kernel::math;
use std::cmp::Ordering;

/// Number of headings that are looked at, evenly spaced from the present one on: 4 degrees apart.
const HEADINGS: u32 = 90;
/// Meters by which two miss distances are equal.
const EQUAL_M: f64 = 1e-6;

/// How near an airplane comes to all others on its way.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Clearance {
    /// The smallest distance to another one's zone, in meters; negative inside.
    margin_m: f64,
    /// Seconds in which it is in a zone, at the longest of all.
    lost_s: f64,
}

impl Clearance {
    const UNLIMITED: Self = Self { margin_m: f64::INFINITY, lost_s: 0.0 };

    fn is_free(&self) -> bool {
        self.margin_m >= 0.0
    }

    /// Returns both together, of two others at the same time.
    fn beside(self, other: Self) -> Self {
        Self { margin_m: self.margin_m.min(other.margin_m), lost_s: self.lost_s.max(other.lost_s) }
    }

    /// Returns both together, of two stretches after each other.
    fn then(self, next: Self) -> Self {
        Self { margin_m: self.margin_m.min(next.margin_m), lost_s: self.lost_s + next.lost_s }
    }
}

/// Another airplane, which flies straight on.
#[derive(Debug, Clone, Copy)]
struct Intruder {
    /// Its place as seen from where the airplane is now.
    at: Point,
    velocity: Point,
    zone_m: f64,
}

/// A straight stretch of the airplane's way, from where it is now at time 0.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    from_s: f64,
    until_s: f64,
    /// Place at its start.
    at: Point,
    velocity: Point,
}

impl Intruder {
    /// Returns how near the two come on a stretch.
    fn clearance(&self, stretch: &Stretch) -> Clearance {
        let Stretch { from_s, until_s, at, velocity } = *stretch;
        let [vx, vy] = self.velocity;
        let there = [self.at[0] + vx * from_s, self.at[1] + vy * from_s];
        let apart = sub(there, at);
        let relative = sub(self.velocity, velocity);
        let duration_s = until_s - from_s;
        let speed_m2_s2 = norm_squared(relative);
        let turning_s = if speed_m2_s2 > 0.0 { -dot(apart, relative) / speed_m2_s2 } else { 0.0 };
        let closest_s = turning_s.clamp(0.0, duration_s);
        let place = |t_s: f64| [apart[0] + relative[0] * t_s, apart[1] + relative[1] * t_s];
        let [x, y] = place(closest_s);
        let margin_m = math::hypot(x, y) - self.zone_m;
        Clearance {
            margin_m,
            lost_s: self.lost_s(place(turning_s), speed_m2_s2, turning_s, duration_s),
        }
    }

    /// Returns how long the airplane is in the zone, whose middle it passes at `closest` after `turning_s`.
    fn lost_s(&self, closest: Point, speed_m2_s2: f64, turning_s: f64, duration_s: f64) -> f64 {
        let spare_m2 = self.zone_m * self.zone_m - norm_squared(closest);
        if spare_m2 <= 0.0 {
            return 0.0;
        }
        if speed_m2_s2 == 0.0 {
            return duration_s;
        }
        let half_s = (spare_m2 / speed_m2_s2).sqrt();
        ((turning_s + half_s).min(duration_s) - (turning_s - half_s).max(0.0)).max(0.0)
    }
}

/// The turns of an airplane, left and right, and how near the others come in them.
struct TurnTree<'a> {
    own: &'a AircraftState,
    intruders: &'a [Intruder],
    omega_max_rad_s: f64,
    look_ahead_s: f64,
    v_m_s: f64,
}

/// A turn up to some moment.
#[derive(Debug, Clone, Copy)]
struct Turn {
    /// Angle turned, positive to the left.
    angle_rad: f64,
    until_s: f64,
    /// Place at its end, as seen from where it began.
    at: Point,
    /// How near the others came.
    clearance: Clearance,
}

impl TurnTree<'_> {
    fn start(&self) -> Turn {
        Turn { angle_rad: 0.0, until_s: 0.0, at: [0.0; 2], clearance: Clearance::UNLIMITED }
    }

    /// Returns a turn that goes on to a larger angle, of at most a few degrees more: so short an arc is its chord. It ends
    /// with the look-ahead.
    fn extended(&self, turn: &Turn, angle_rad: f64) -> Turn {
        let duration_s = (angle_rad - turn.angle_rad).abs() / self.omega_max_rad_s;
        let until_s = (turn.until_s + duration_s).min(self.look_ahead_s);
        let duration_s = until_s - turn.until_s;
        if duration_s <= 0.0 {
            return Turn { angle_rad, ..*turn };
        }
        let half_turn_rad = 0.5 * (angle_rad - turn.angle_rad).abs();
        let sinc =
            if half_turn_rad < 1e-4 { 1.0 } else { math::sin(half_turn_rad) / half_turn_rad };
        let along_rad = self.own.heading_rad + 0.5 * (turn.angle_rad + angle_rad);
        let speed_m_s = self.v_m_s * sinc;
        let velocity = [speed_m_s * math::cos(along_rad), speed_m_s * math::sin(along_rad)];
        let chord = Stretch { from_s: turn.until_s, until_s, at: turn.at, velocity };
        Turn {
            angle_rad,
            until_s,
            at: [turn.at[0] + velocity[0] * duration_s, turn.at[1] + velocity[1] * duration_s],
            clearance: turn.clearance.then(self.clearance(&chord)),
        }
    }

    fn clearance(&self, stretch: &Stretch) -> Clearance {
        let each = self.intruders.iter().map(|intruder| intruder.clearance(stretch));
        each.fold(Clearance::UNLIMITED, Clearance::beside)
    }

    /// Returns how near the others come if the airplane flies straight on after a turn.
    fn straight_after(&self, turn: &Turn) -> Clearance {
        let heading_rad = self.own.heading_rad + turn.angle_rad;
        let velocity = [self.v_m_s * math::cos(heading_rad), self.v_m_s * math::sin(heading_rad)];
        let straight =
            Stretch { from_s: turn.until_s, until_s: self.look_ahead_s, at: turn.at, velocity };
        turn.clearance.then(self.clearance(&straight))
    }
}

/// A heading, by the angle that is turned to it.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    angle_rad: f64,
    clearance: Clearance,
}

/// Returns the heading in radians that an airplane should fly among the others; `None` if it may fly to its way-point.
pub(crate) fn heading_rad<'a>(
    own: &AircraftState,
    others: impl Iterator<Item = &'a AircraftState>,
    settings: ReactiveSettings,
    omega_max_rad_s: f64,
) -> Option<f64> {
    let intruders: Vec<Intruder> = others
        .map(|other| Intruder {
            at: sub(other.at, own.at),
            velocity: other.velocity,
            zone_m: own.zone_m(other, settings),
        })
        .collect();
    let tree = TurnTree {
        own,
        intruders: &intruders,
        omega_max_rad_s,
        look_ahead_s: settings.look_ahead_s,
        v_m_s: vector_length(own.velocity),
    };
    let wish_rad = math::wrap_angle(own.preferred_rad - own.heading_rad);
    let candidates = tree.candidates(wish_rad);
    let best = candidates
        .iter()
        .copied()
        .reduce(|best, one| if is_better(&one, &best, wish_rad) { one } else { best })?;
    // The wish itself is among them, and no other is as near to it.
    let is_wish = best.clearance.is_free() && best.angle_rad == wish_rad;
    (!is_wish).then_some(own.heading_rad + best.angle_rad)
}

impl TurnTree<'_> {
    /// Returns the headings that an airplane may turn to, that of its wish among them.
    fn candidates(&self, wish_rad: f64) -> Vec<Candidate> {
        let spacing_rad = std::f64::consts::TAU / f64::from(HEADINGS);
        let straight = self.start();
        let mut candidates =
            vec![Candidate { angle_rad: 0.0, clearance: self.straight_after(&straight) }];
        for side in [-1.0, 1.0] {
            let mut turn = straight;
            for k in 1..=HEADINGS / 2 {
                let angle_rad = side * spacing_rad * f64::from(k);
                let is_wish_between =
                    wish_rad * side > turn.angle_rad * side && wish_rad * side < angle_rad * side;
                if is_wish_between {
                    let to_wish = self.extended(&turn, wish_rad);
                    let clearance = self.straight_after(&to_wish);
                    candidates.push(Candidate { angle_rad: wish_rad, clearance });
                }
                turn = self.extended(&turn, angle_rad);
                candidates.push(Candidate { angle_rad, clearance: self.straight_after(&turn) });
            }
        }
        candidates
    }
}

/// Returns whether a heading is better than another one: it is free, or both are and it is nearer to the wish; where
/// neither is, it is the better recovery. Among equals the one on the right is, as the rules of the air have it.
fn is_better(one: &Candidate, other: &Candidate, wish_rad: f64) -> bool {
    let [is_free, is_other_free] = [one, other].map(|candidate| candidate.clearance.is_free());
    if is_free != is_other_free {
        return is_free;
    }
    if !is_free {
        match compare_recoveries(&one.clearance, &other.clearance) {
            Ordering::Equal => {}
            ordering => return ordering == Ordering::Greater,
        }
    }
    let [off_rad, other_off_rad] =
        [one, other].map(|candidate| math::wrap_angle(candidate.angle_rad - wish_rad).abs());
    off_rad < other_off_rad || (off_rad == other_off_rad && one.angle_rad < other.angle_rad)
}

/// Compares two headings of saturated bands: the larger miss distance is better, and then the shorter time in a zone.
fn compare_recoveries(one: &Clearance, other: &Clearance) -> Ordering {
    if (one.margin_m - other.margin_m).abs() > EQUAL_M {
        return one.margin_m.total_cmp(&other.margin_m);
    }
    other.lost_s.total_cmp(&one.lost_s)
}

#[cfg(test)]
mod tests {
    use super::super::test_aircraft;
    use super::*;
    use proptest::prelude::*;

    const SETTINGS: ReactiveSettings =
        ReactiveSettings { look_ahead_s: 60.0, margin: 1.0, resolution_factor: 1.0 };
    const OMEGA_RAD_S: f64 = 4.0 * std::f64::consts::PI / 180.0;

    /// Returns the smallest margin of a turn to a heading and the straight flight after it, by small steps.
    fn simulated_margin_m(own: &AircraftState, others: &[AircraftState], angle_rad: f64) -> f64 {
        let step_s = 0.005;
        let turn_s = angle_rad.abs() / OMEGA_RAD_S;
        let mut at = own.at;
        let mut margin_m = f64::INFINITY;
        for k in 0..=(SETTINGS.look_ahead_s / step_s) as u32 {
            let t_s = f64::from(k) * step_s;
            for other in others {
                let [vx, vy] = other.velocity;
                let there = [other.at[0] + vx * t_s, other.at[1] + vy * t_s];
                margin_m =
                    margin_m.min(vector_length(sub(there, at)) - own.zone_m(other, SETTINGS));
            }
            let turned_rad = angle_rad.signum() * (t_s + 0.5 * step_s).min(turn_s) * OMEGA_RAD_S;
            let heading_rad = own.heading_rad + turned_rad;
            at[0] += 35.0 * step_s * math::cos(heading_rad);
            at[1] += 35.0 * step_s * math::sin(heading_rad);
        }
        margin_m
    }

    fn tree<'a>(own: &'a AircraftState, intruders: &'a [Intruder]) -> TurnTree<'a> {
        let look_ahead_s = SETTINGS.look_ahead_s;
        TurnTree { own, intruders, omega_max_rad_s: OMEGA_RAD_S, look_ahead_s, v_m_s: 35.0 }
    }

    fn intruders(own: &AircraftState, others: &[AircraftState]) -> Vec<Intruder> {
        let as_seen = |other: &AircraftState| Intruder {
            at: sub(other.at, own.at),
            velocity: other.velocity,
            zone_m: own.zone_m(other, SETTINGS),
        };
        others.iter().map(as_seen).collect()
    }

    proptest! {
        /// Every heading has the clearance that a simulation of its turn in small steps finds, and so the bands are those of
        /// the simulation but for their edges.
        #[test]
        fn clearances_are_those_of_simulated_turns(
            x in prop::array::uniform2(-4000.0f64..4000.0), y in prop::array::uniform2(-4000.0f64..4000.0),
            heading_rad in prop::array::uniform2(-3.1f64..3.1), wish_rad in -3.1f64..3.1,
        ) {
            let own = test_aircraft(0, [100.0, -50.0], 0.4);
            let others = [0, 1].map(|k| test_aircraft(1 + k as u32, [x[k], y[k]], heading_rad[k]));
            let intruders = intruders(&own, &others);
            let candidates = tree(&own, &intruders).candidates(wish_rad);
            prop_assert!(candidates.iter().any(|one| one.angle_rad == wish_rad));
            for candidate in candidates.iter().step_by(7) {
                let simulated_m = simulated_margin_m(&own, &others, candidate.angle_rad);
                let off_m = candidate.clearance.margin_m - simulated_m;
                prop_assert!(off_m.abs() < 1.5, "{candidate:?}: {simulated_m}");
            }
        }

        /// The heading that is flown is free if any is, and no free one is nearer to the wish.
        #[test]
        fn the_resolution_is_the_free_heading_nearest_to_the_wish(
            x in 600.0f64..4000.0, y in -1500.0f64..1500.0, heading_rad in -3.1f64..3.1,
        ) {
            let own = test_aircraft(0, [0.0, 0.0], 0.0);
            let others = [test_aircraft(1, [x, y], heading_rad)];
            let intruders = intruders(&own, &others);
            let candidates = tree(&own, &intruders).candidates(0.0);
            let nearest = candidates
                .iter()
                .filter(|one| one.clearance.is_free())
                .map(|one| one.angle_rad.abs())
                .reduce(f64::min);
            let flown = super::heading_rad(&own, others.iter(), SETTINGS, OMEGA_RAD_S);
            match nearest {
                Some(nearest_rad) => {
                    let off_rad = flown.map_or(0.0, |rad| math::wrap_angle(rad).abs());
                    prop_assert!((off_rad - nearest_rad).abs() < 1e-9, "{flown:?}, {nearest_rad}");
                }
                None => prop_assert!(flown.is_some(), "saturated bands have a recovery"),
            }
        }
    }

    #[test]
    fn a_head_on_pair_turns_to_the_right() {
        let own = test_aircraft(0, [0.0, 0.0], 0.0);
        let other = test_aircraft(1, [3000.0, 0.0], std::f64::consts::PI);
        let heading_rad = heading_rad(&own, [other].iter(), SETTINGS, OMEGA_RAD_S);
        assert!(heading_rad.is_some_and(|rad| (-0.8..0.0).contains(&rad)), "{heading_rad:?}");
    }

    #[test]
    fn without_a_conflict_it_flies_to_its_way_point() {
        let own = test_aircraft(0, [0.0, 0.0], 0.0);
        let beside = test_aircraft(1, [0.0, 800.0], 0.0);
        assert_eq!(heading_rad(&own, [beside].iter(), SETTINGS, OMEGA_RAD_S), None);
        assert_eq!(heading_rad(&own, [].iter(), SETTINGS, OMEGA_RAD_S), None);
    }

    #[test]
    fn saturated_bands_have_the_recovery_that_leaves_the_zone_soonest() {
        let own = test_aircraft(0, [0.0, 0.0], 0.0);
        // Side by side, 300 m apart: it has to turn away.
        let beside = test_aircraft(1, [0.0, 300.0], 0.0);
        let heading_rad = heading_rad(&own, [beside].iter(), SETTINGS, OMEGA_RAD_S);
        assert!(heading_rad.is_some_and(|rad| math::wrap_angle(rad) < -0.5), "{heading_rad:?}");
    }
}
