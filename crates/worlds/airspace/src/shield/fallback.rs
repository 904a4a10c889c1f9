//! Fallbacks: paths that an airplane can fly forever, and a test of whether two of them stay apart.

use super::orbit::{Orbit, OrbitSide, stays_apart_for};
use crate::areas::PathPiece;
use crate::flight::{AircraftModel, PairPlane, Point, Pose2, RigidMotion};
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;
use sidestep_kernel::geometry::{add_scaled, dot, norm, norm_squared, sub};
use sidestep_kernel::math;
use std::sync::Arc;

/// Lengths of straight flight before an orbit, in times that the airplane takes for its separation: in the shorter one two
/// that are side by side pass each other, in the longer one two that are in each other's way ahead.
const STRAIGHT_SEPARATIONS: [f64; 2] = [1.5, 4.5];
/// Turns before that, in radians: one with which an airplane gets out of another's way, and one away from it.
const TURNS_RAD: [f64; 2] =
    [25.0 * std::f64::consts::PI / 180.0, 60.0 * std::f64::consts::PI / 180.0];
/// Length of straight flight after a turn, in the same unit.
const STRAIGHT_SEPARATIONS_AFTER_TURN: f64 = 3.0;

/// A path that an airplane can fly forever: it may turn for some `dt` and fly straight on for some, and then it orbits.
///
/// Straight on, two airplanes that pass each other, or fly beside each other, stay apart where their orbits would meet.
/// The orbit after it keeps the path within reach, so that those far away need not mind it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(from = "u16", into = "u16")]
pub struct Fallback {
    /// The side to which it turns first.
    pub turn_side: OrbitSide,
    /// Number of `dt` of that turn, at most [`Self::MAX_CYCLES`].
    pub turn_cycles: u8,
    /// Number of `dt` of straight flight after it, at most [`Self::MAX_CYCLES`].
    pub straight_cycles: u8,
    /// The side of the orbit.
    pub orbit_side: OrbitSide,
}

impl Fallback {
    /// Largest number of `dt` of a turn, and of straight flight.
    pub const MAX_CYCLES: u8 = u8::MAX >> 1;

    /// Returns an orbit that begins at once.
    pub const fn from_side(orbit_side: OrbitSide) -> Self {
        Self { turn_side: OrbitSide::Left, turn_cycles: 0, straight_cycles: 0, orbit_side }
    }

    /// Returns an orbit that begins after some `dt` of straight flight.
    pub const fn after_straight(straight_cycles: u8, orbit_side: OrbitSide) -> Self {
        Self { straight_cycles, ..Self::from_side(orbit_side) }
    }

    /// Returns what is left of it after one `dt`.
    #[must_use]
    pub fn after_cycle(self) -> Self {
        match self {
            Self { turn_cycles: 0, straight_cycles, orbit_side, .. } => {
                Self::after_straight(straight_cycles.saturating_sub(1), orbit_side)
            }
            // The side of a turn that is over means nothing.
            Self { turn_cycles: 1, straight_cycles, orbit_side, .. } => {
                Self::after_straight(straight_cycles, orbit_side)
            }
            _ => Self { turn_cycles: self.turn_cycles - 1, ..self },
        }
    }

    /// Returns the number of `dt` until it orbits.
    pub fn cycles_until_orbit(self) -> u32 {
        u32::from(self.turn_cycles) + u32::from(self.straight_cycles)
    }

    /// Returns whether it orbits in the next `dt`.
    pub fn is_orbiting(self) -> bool {
        self.cycles_until_orbit() == 0
    }

    /// Returns the turn rate of the next `dt` in radians per second, for turns and orbits at a rate.
    pub fn omega_rad_s(self, orbit_rad_s: f64) -> f64 {
        if self.turn_cycles > 0 {
            self.turn_side.sign() * orbit_rad_s
        } else if self.straight_cycles > 0 {
            0.0
        } else {
            self.orbit_side.sign() * orbit_rad_s
        }
    }

    /// Returns the fallbacks that the plans of an airplane may end with, in the order in which they are tried: orbits
    /// first, which take the least room. None takes longer than `max_lead_s` until it orbits.
    pub(crate) fn choices(
        model: &AircraftModel,
        orbit_rad_s: f64,
        dt_s: f64,
        max_lead_s: f64,
    ) -> Arc<[Self]> {
        let separation_s = model.separation_m / model.v_m_s;
        // The conversion saturates.
        let cycles = |seconds: f64| ((seconds / dt_s).round() as u8).min(Self::MAX_CYCLES);
        let max_cycles = ((max_lead_s / dt_s).max(0.0) as u8).min(Self::MAX_CYCLES);
        let mut choices = OrbitSide::BOTH.map(Self::from_side).to_vec();
        for separations in STRAIGHT_SEPARATIONS {
            let straight_cycles = cycles(separations * separation_s).min(max_cycles);
            choices.extend(OrbitSide::BOTH.map(|side| Self::after_straight(straight_cycles, side)));
        }
        for turn_rad in TURNS_RAD {
            // A coarse `dt` may turn it farther.
            let turn_cycles = cycles(turn_rad / orbit_rad_s).max(1).min(max_cycles);
            let straight_cycles = cycles(STRAIGHT_SEPARATIONS_AFTER_TURN * separation_s)
                .min(max_cycles - turn_cycles);
            for orbit_side in OrbitSide::BOTH {
                for turn_side in OrbitSide::BOTH {
                    choices.push(Self { turn_side, turn_cycles, straight_cycles, orbit_side });
                }
            }
        }
        let mut different: Vec<Self> = Vec::with_capacity(choices.len());
        for choice in choices {
            // Without time for a turn its side means nothing.
            let choice = match choice.turn_cycles {
                0 => Self::after_straight(choice.straight_cycles, choice.orbit_side),
                _ => choice,
            };
            if !different.contains(&choice) {
                different.push(choice);
            }
        }
        different.into()
    }
}

impl Fallback {
    /// Returns fallbacks with others beside them that fly straight on, each twice as far as the one before, until they fly as
    /// many `dt`, or as many as they may.
    pub(crate) fn with_longer_straights(choices: &[Self], straight_cycles: f64) -> Arc<[Self]> {
        let longest = choices.iter().map(|choice| choice.straight_cycles).max().unwrap_or(0);
        // The conversion saturates.
        let enough = (straight_cycles.ceil() as u8).min(Self::MAX_CYCLES);
        let mut all = choices.to_vec();
        let mut straight_cycles = longest.max(1);
        while straight_cycles < enough {
            straight_cycles = straight_cycles.saturating_mul(2).min(enough);
            all.extend(OrbitSide::BOTH.map(|side| Self::after_straight(straight_cycles, side)));
        }
        all.into()
    }
}

impl From<u16> for Fallback {
    fn from(code: u16) -> Self {
        let [low, high] = code.to_le_bytes();
        Self {
            turn_side: OrbitSide::from_bits(high),
            turn_cycles: high >> 1,
            straight_cycles: low >> 1,
            orbit_side: OrbitSide::from_bits(low),
        }
    }
}

impl From<Fallback> for u16 {
    fn from(fallback: Fallback) -> Self {
        let Fallback { turn_side, turn_cycles, straight_cycles, orbit_side } = fallback;
        let low = straight_cycles << 1 | orbit_side.to_bits();
        let high = turn_cycles << 1 | turn_side.to_bits();
        // An orbit, the most frequent one, is the smallest number, and takes the fewest bytes in messages.
        Self::from_le_bytes([low, high])
    }
}

impl Packed for Fallback {
    type Bits = u16;

    #[inline(always)]
    fn to_bits(self) -> u16 {
        self.into()
    }

    #[inline(always)]
    fn from_bits(code: u16) -> Self {
        code.into()
    }
}

/// The path of a fallback from a pose, in a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FallbackPath {
    start: Pose2,
    v_m_s: f64,
    /// Turn rate of the turn, in radians per second.
    turn_rad_s: f64,
    /// Seconds of the turn.
    turn_s: f64,
    /// The pose at the end of the turn.
    turn_end: Pose2,
    /// Seconds until the orbit begins.
    lead_s: f64,
    /// The orbit, with times that start with it.
    orbit: Orbit,
}

impl FallbackPath {
    /// Returns the path of a fallback from a pose, with turns and orbits at `orbit_rad_s`.
    pub(crate) fn new(
        start: Pose2,
        v_m_s: f64,
        orbit_rad_s: f64,
        fallback: Fallback,
        dt_s: f64,
    ) -> Self {
        let turn_rad_s = fallback.turn_side.sign() * orbit_rad_s;
        let turn_s = f64::from(fallback.turn_cycles) * dt_s;
        let straight_s = f64::from(fallback.straight_cycles) * dt_s;
        let turn_end = start.step(v_m_s, turn_rad_s, turn_s);
        let orbit_start = turn_end.step(v_m_s, 0.0, straight_s);
        let orbit = Orbit::from_pose(orbit_start, v_m_s, fallback.orbit_side.sign() * orbit_rad_s);
        Self { start, v_m_s, turn_rad_s, turn_s, turn_end, lead_s: turn_s + straight_s, orbit }
    }

    /// Returns two paths, each in a frame of its own, in the plane of the pair.
    pub(crate) fn both_in_plane(plane: &PairPlane, [a, b]: [Self; 2]) -> [Self; 2] {
        match plane.motions() {
            None => [a, b],
            Some([first, second]) => [a.moved(first), b.moved(second)],
        }
    }

    fn moved(&self, motion: &RigidMotion) -> Self {
        Self {
            start: motion.pose(self.start),
            turn_end: motion.pose(self.turn_end),
            orbit: self.orbit.moved(motion),
            ..*self
        }
    }

    /// Returns the orbit at its end.
    pub(crate) fn orbit(&self) -> &Orbit {
        &self.orbit
    }

    /// Returns its speed through the air in meters per second.
    pub(super) fn v_m_s(&self) -> f64 {
        self.v_m_s
    }

    /// Returns the time until the orbit begins, in seconds.
    pub(crate) fn lead_s(&self) -> f64 {
        self.lead_s
    }

    /// Returns its pieces, of which the first begins `after_s` seconds from now.
    pub(super) fn pieces(&self, after_s: f64) -> [PathPiece; 3] {
        let Self { start, v_m_s, turn_rad_s, turn_s, turn_end, lead_s, .. } = *self;
        let piece = |start: Pose2, omega_rad_s: f64, from_s: f64, until_s: f64| PathPiece {
            start,
            v_m_s,
            omega_rad_s,
            from_s: after_s + from_s,
            until_s: after_s + until_s,
        };
        let orbit_start = turn_end.step(v_m_s, 0.0, lead_s - turn_s);
        [
            piece(start, turn_rad_s, 0.0, turn_s),
            piece(turn_end, 0.0, turn_s, lead_s),
            piece(orbit_start, self.orbit.omega_rad_s(), lead_s, f64::INFINITY),
        ]
    }

    /// Returns the position on it after some seconds.
    pub(super) fn at(&self, t_s: f64) -> Point {
        if t_s < self.turn_s {
            self.start.step(self.v_m_s, self.turn_rad_s, t_s).at
        } else if t_s < self.lead_s {
            self.turn_end.step(self.v_m_s, 0.0, t_s - self.turn_s).at
        } else {
            self.orbit.at(t_s - self.lead_s)
        }
    }

    /// Returns whether two paths stay `gap_m` meters apart for all time.
    pub(crate) fn stays_apart(&self, other: &Self, gap_m: f64) -> bool {
        let until_s = self.lead_s.max(other.lead_s);
        let [own, others] = [self, other].map(|path| path.orbit.after(until_s - path.lead_s));
        own.stays_apart(&others, gap_m) && self.stays_apart_until(other, until_s, gap_m)
    }

    /// Returns the same until both orbit, `until_s` seconds from the start.
    fn stays_apart_until(&self, other: &Self, until_s: f64, gap_m: f64) -> bool {
        let turns_s = self.turn_s.max(other.turn_s);
        let straight_until_s = self.lead_s.min(other.lead_s).max(turns_s);
        let apart_m = |t_s: f64| norm(sub(self.at(t_s), other.at(t_s)));
        let closing_m_s = self.v_m_s + other.v_m_s;
        let stays_apart_between = |from_s: f64, to_s: f64| {
            from_s >= to_s
                || stays_apart_for(&|t_s| apart_m(from_s + t_s), to_s - from_s, closing_m_s, gap_m)
        };
        stays_apart_between(0.0, turns_s)
            && self.nearest_m(other, turns_s, straight_until_s) >= gap_m
            && stays_apart_between(straight_until_s, until_s)
    }

    /// Returns the smallest distance in meters from one time to another, between which both fly straight on.
    fn nearest_m(&self, other: &Self, from_s: f64, to_s: f64) -> f64 {
        if from_s >= to_s {
            return f64::INFINITY;
        }
        let from = sub(other.at(from_s), self.at(from_s));
        let velocity_m_s = sub(other.straight_velocity_m_s(), self.straight_velocity_m_s());
        let speed_squared = norm_squared(velocity_m_s);
        let nearest_s = if speed_squared > 0.0 {
            (-dot(from, velocity_m_s) / speed_squared).clamp(0.0, to_s - from_s)
        } else {
            0.0
        };
        norm(add_scaled(from, velocity_m_s, nearest_s))
    }

    fn straight_velocity_m_s(&self) -> Point {
        let heading_rad = self.turn_end.heading_rad;
        [self.v_m_s * math::cos(heading_rad), self.v_m_s * math::sin(heading_rad)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::distance_m;
    use proptest::prelude::*;

    const DT_S: f64 = 5.0;

    fn some_fallback() -> impl Strategy<Value = Fallback> {
        (0u8..8, 0u8..12, any::<bool>(), any::<bool>()).prop_map(
            |(turn_cycles, straight_cycles, turns_right, orbits_right)| Fallback {
                turn_side: OrbitSide::BOTH[usize::from(turns_right)],
                turn_cycles,
                straight_cycles,
                orbit_side: OrbitSide::BOTH[usize::from(orbits_right)],
            },
        )
    }

    fn some_path() -> impl Strategy<Value = FallbackPath> {
        let number = || -3000.0f64..3000.0;
        (number(), number(), -3.1f64..3.1, 20.0f64..60.0, any::<bool>(), some_fallback()).prop_map(
            |(x, y, heading_rad, v_m_s, is_slow, fallback)| {
                let orbit_rad_s = if is_slow { 0.035 } else { 0.07 };
                FallbackPath::new(
                    Pose2 { at: [x, y], heading_rad },
                    v_m_s,
                    orbit_rad_s,
                    fallback,
                    DT_S,
                )
            },
        )
    }

    fn model(v_m_s: f64) -> AircraftModel {
        AircraftModel { v_m_s, omega_max_rad_s: 0.07, separation_m: 500.0, turns: 5 }
    }

    #[test]
    fn choices_are_different_begin_with_orbits_and_orbit_in_time() {
        for (v_m_s, dt_s, max_lead_s, count) in [
            (35.0, 5.0, 90.0, 14),
            (35.0, 5.0, 0.0, 2),
            (1.0, 5.0, 1e9, 12),
            (300.0, 60.0, 59.0, 2),
        ] {
            let choices = Fallback::choices(&model(v_m_s), 0.07, dt_s, max_lead_s);
            assert_eq!(choices.len(), count, "{v_m_s} {max_lead_s} {choices:?}");
            assert_eq!(choices[..2], OrbitSide::BOTH.map(Fallback::from_side));
            for (i, choice) in choices.iter().enumerate() {
                assert!(f64::from(choice.cycles_until_orbit()) * dt_s <= max_lead_s, "{choice:?}");
                assert!(!choices[..i].contains(choice), "{choice:?}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn a_fallback_is_the_same_after_it_was_packed(fallback in some_fallback()) {
            prop_assert_eq!(Fallback::from_bits(fallback.to_bits()), fallback);
        }

        /// Never wrongly yes: dense sampling finds no nearer moment.
        #[test]
        fn paths_that_are_found_apart_are_apart(a in some_path(), b in some_path(), gap_m in 200.0f64..900.0) {
            if a.stays_apart(&b, gap_m) {
                for t in 0..2000 {
                    let t_s = 0.25 * f64::from(t);
                    let apart_m = distance_m(a.at(t_s), b.at(t_s));
                    prop_assert!(apart_m >= gap_m - 1e-6, "{apart_m} after {t_s} s");
                }
            }
            prop_assert_eq!(a.stays_apart(&b, gap_m), b.stays_apart(&a, gap_m));
        }

        /// Two that fly straight on for long: wrongly no only where they come near.
        #[test]
        fn paths_that_stay_far_apart_are_found_apart(
            a in some_path(), b in some_path(), straight_cycles in 0u8..12,
        ) {
            let straight = |path: &FallbackPath| {
                let fallback = Fallback::after_straight(straight_cycles, OrbitSide::Left);
                FallbackPath::new(path.start, path.v_m_s, 0.035, fallback, DT_S)
            };
            let (a, b) = (straight(&a), straight(&b));
            let nearest_m = (0..4000)
                .map(|t| distance_m(a.at(0.25 * f64::from(t)), b.at(0.25 * f64::from(t))))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(a.stays_apart(&b, nearest_m - 0.5 * (a.v_m_s + b.v_m_s)));
        }

        /// After each `dt` of a fallback, what is left of it is the rest of the same path.
        #[test]
        fn the_rest_of_a_path_is_the_path_of_the_rest(
            path in some_path(), fallback in some_fallback(), t_s in 0.0f64..200.0,
        ) {
            let orbit_rad_s = 0.05;
            let mut fallback = fallback;
            let path_of = |pose: Pose2, fallback: Fallback| {
                FallbackPath::new(pose, path.v_m_s, orbit_rad_s, fallback, DT_S)
            };
            let whole = path_of(path.start, fallback);
            let mut pose = path.start;
            for cycle in 0..22 {
                let rest = path_of(pose, fallback);
                let at = whole.at(DT_S * f64::from(cycle) + t_s);
                prop_assert!(distance_m(rest.at(t_s), at) < 1e-6);
                pose = pose.step(path.v_m_s, fallback.omega_rad_s(orbit_rad_s), DT_S);
                fallback = fallback.after_cycle();
            }
            prop_assert!(fallback.is_orbiting());
        }
    }
}
