//! The shield: separation that is proved, not hoped for.
//!
//! A filter between any method and the airplanes. Every airplane stores a *fallback* that it can
//! fly for ever: an orbit at its largest turn rate, to the left or to the right.
//!
//! **Invariant.** The stored fallbacks of all airplanes are pairwise at least `R` apart, from now
//! on and for all time.
//!
//! Each `dt` every airplane is given a *plan*: some way for `dt`, and then an orbit from where
//! that ends. Plans are *compatible* when they stay `R` apart during `dt` and on the orbits ever
//! after. [`filter`] hands out plans that are pairwise compatible:
//!
//! 1. *Start.* If the fallbacks are apart, staying on them for `dt` and ever after is a plan for
//!    each, and these plans are pairwise compatible: they are the same motions as the invariant
//!    speaks of. So an assignment of compatible plans exists.
//! 2. *Search.* Everybody begins with what the method proposes. While some pair is not
//!    compatible, one of the two, the one with the lower rank unless it is on its fallback
//!    already, takes another plan that is compatible with all present ones, or its fallback. The
//!    first lowers the number of incompatible pairs, the second raises the number of airplanes on
//!    fallbacks, and nobody leaves a fallback during the search, so it ends. It can only end
//!    without an incompatible pair: two airplanes on fallbacks are compatible by the invariant.
//! 3. *Better again.* Whoever has fallen back may take another plan if that is compatible with
//!    all present ones. Compatibility of all pairs is kept by each such exchange.
//! 4. *Step.* All fly `dt` of their plans, and store the orbit at its end. The plans were
//!    compatible, so nobody came nearer than `R` during `dt`, and the stored orbits keep the
//!    invariant.
//!
//! By induction over `dt` there is never a loss of separation once the first fallbacks are apart
//! ([`first_fallbacks`] chooses them). Where they are not, the pair is left to the method until
//! they are, and the induction is about all other pairs. An airplane that leaves the world keeps every other pair
//! as it was. A wind that all know moves everybody alike and changes no distance. Each step is
//! a property test below.
//!
//! Numbers: `orbit.rs` never says wrongly that motions stay apart. New plans must keep
//! [`SLACK_M`] more than `R`, so that rounding never adds up to a loss.

use super::airplane::{Pose, distance_m};
use super::levels::Levels;
use super::orbit::{Orbit, stays_apart};
use serde::{Deserialize, Serialize};
use sidestep_kernel::EntityId;

pub use super::orbit::Side;

/// Metres that new plans keep beyond the separation.
pub const SLACK_M: f64 = 0.01;
/// What the shield knows of an airplane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flyer {
    /// Whose orbit this is. Where it is not sure on which of several an airplane is, it takes
    /// part with each of them.
    pub id: EntityId,
    /// Where it is.
    pub pose: Pose,
    /// Airspeed.
    pub v_m_s: f64,
    /// Largest turn rate.
    pub omega_max_rad_s: f64,
    /// Its separation; of two airplanes the larger one counts.
    pub separation_m: f64,
    /// The levels it keeps or passes in the next `dt`,
    pub levels: Levels,
    /// and how far above each other airplanes need not mind each other.
    pub vertical_m: f64,
    /// Its stored fallback.
    pub fallback: Side,
    /// Whether it came in too close to another: with that one it is left to the method until
    /// their fallbacks are apart.
    pub came_too_close: bool,
    /// Higher ranks keep what they want; unique.
    pub rank: u64,
}

impl Flyer {
    /// Whether two airplanes that came in too close are still without fallbacks that are apart.
    /// Falling back would bring these two together, so they are left to the method until they
    /// have such fallbacks. For all other pairs the invariant holds all the same.
    fn is_left_alone_with(&self, other: &Self) -> bool {
        let orbit = |f: &Self| Orbit::from(f.pose, f.v_m_s, f.fallback.sign() * f.omega_max_rad_s);
        let gap_m = self.separation_m.max(other.separation_m);
        self.came_too_close
            && other.came_too_close
            && !orbit(self).stays_apart(&orbit(other), gap_m)
    }

    fn is_on_level(&self, other: &Self) -> bool {
        let vertical_m = self.vertical_m.max(other.vertical_m);
        self.id != other.id && self.levels.meets(&other.levels, vertical_m)
    }

    /// Whether the shield keeps two airplanes apart.
    pub(super) fn minds(&self, other: &Self) -> bool {
        self.is_on_level(other) && !self.is_left_alone_with(other)
    }
}

/// Motion for one `dt`: a turn rate per step of `dtau`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Way {
    /// Turn rate in each step.
    pub omegas_rad_s: Vec<f64>,
}

/// What an airplane flies, and where it can wait after that.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Plan {
    flyer: Flyer,
    /// Poses at the beginning of each step, and at the end.
    poses: Vec<Pose>,
    omegas_rad_s: Vec<f64>,
    dtau_s: f64,
    orbit: Orbit,
    /// Number of the candidate, `None` for the fallback.
    candidate: Option<usize>,
    side: Side,
}

impl Plan {
    /// A way, and then an orbit to a side.
    pub(super) fn new(flyer: Flyer, way: &Way, dtau_s: f64, side: Side) -> Self {
        Self::of(flyer, way.omegas_rad_s.clone(), dtau_s, (None, side))
    }

    fn of(flyer: Flyer, omegas_rad_s: Vec<f64>, dtau_s: f64, orbit: (Option<usize>, Side)) -> Self {
        let mut poses = vec![flyer.pose];
        for &omega in &omegas_rad_s {
            let last = poses[poses.len() - 1];
            poses.push(last.step(flyer.v_m_s, omega, dtau_s));
        }
        let (candidate, side) = orbit;
        let end = poses[poses.len() - 1];
        let orbit = Orbit::from(end, flyer.v_m_s, side.sign() * flyer.omega_max_rad_s);
        Self { flyer, poses, omegas_rad_s, dtau_s, orbit, candidate, side }
    }

    /// The stored fallback, for some steps and ever after.
    pub(super) fn fallback(flyer: Flyer, steps: usize, dtau_s: f64) -> Self {
        let omega = flyer.fallback.sign() * flyer.omega_max_rad_s;
        Self::of(flyer, vec![omega; steps], dtau_s, (None, flyer.fallback))
    }

    /// Where `dt` ends.
    pub(super) fn end(&self) -> Pose {
        self.poses[self.poses.len() - 1]
    }

    /// The side of the orbit.
    pub(super) fn side(&self) -> Side {
        self.side
    }

    /// Whether two plans stay apart during `dt` and on the orbits ever after.
    pub(super) fn is_compatible(&self, other: &Self) -> bool {
        if !self.flyer.minds(&other.flyer) {
            return true;
        }
        let gap_m = self.flyer.separation_m.max(other.flyer.separation_m) + SLACK_M;
        let reach = |plan: &Self| {
            let dt_s = plan.dtau_s * plan.omegas_rad_s.len() as f64;
            plan.flyer.v_m_s * dt_s + 2.0 * plan.orbit.radius_m
        };
        let now_m = distance_m(self.poses[0].at, other.poses[0].at);
        if now_m >= gap_m + reach(self) + reach(other) {
            return true;
        }
        self.orbit.stays_apart(&other.orbit, gap_m) && self.ways_stay_apart(other, gap_m)
    }

    fn ways_stay_apart(&self, other: &Self, gap_m: f64) -> bool {
        let closing_m_s = self.flyer.v_m_s + other.flyer.v_m_s;
        (0..self.omegas_rad_s.len()).all(|k| {
            let at = |plan: &Self, t_s: f64| {
                plan.poses[k].step(plan.flyer.v_m_s, plan.omegas_rad_s[k], t_s).at
            };
            let apart = |t_s: f64| distance_m(at(self, t_s), at(other, t_s));
            stays_apart(&apart, (0.0, self.dtau_s), closing_m_s, gap_m)
        })
    }

    fn is_fallback(&self) -> bool {
        self.candidate.is_none()
    }
}

/// What the shield has decided for one airplane.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Decision {
    /// Number of the candidate to fly, `None` for the stored fallback.
    pub candidate: Option<usize>,
    /// The fallback to store after that.
    pub fallback: Side,
}

/// How sure it is that everybody will fly the plan it is given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Certainty {
    /// Everybody will.
    Sure,
    /// Each may fly its stored fallback instead: plans have to keep apart from those of others
    /// too. They are compatible in whatever mixture they are flown.
    Mixable,
}

/// Decides for airplanes whose stored fallbacks are pairwise apart. `candidates[i]` are the ways
/// that airplane `i` may fly, the one it wants first, `steps` of `dtau_s` each; with none it
/// stays on its fallback.
pub fn filter(
    flyers: &[Flyer],
    candidates: &[Vec<Way>],
    frame: (usize, f64),
    certainty: Certainty,
) -> Vec<Decision> {
    let mut search = Search::new(flyers, candidates, frame, certainty);
    search.until_compatible();
    search.better_again();
    search.plans.iter().map(|p| Decision { candidate: p.candidate, fallback: p.side }).collect()
}

struct Search<'a> {
    flyers: &'a [Flyer],
    candidates: &'a [Vec<Way>],
    dtau_s: f64,
    certainty: Certainty,
    plans: Vec<Plan>,
    fallbacks: Vec<Plan>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
}

impl<'a> Search<'a> {
    fn new(
        flyers: &'a [Flyer],
        candidates: &'a [Vec<Way>],
        (steps, dtau_s): (usize, f64),
        certainty: Certainty,
    ) -> Self {
        let fallbacks: Vec<Plan> =
            flyers.iter().map(|flyer| Plan::fallback(*flyer, steps, dtau_s)).collect();
        let first = |((flyer, ways), fallback): ((&Flyer, &Vec<Way>), &Plan)| match ways.first() {
            Some(way) => {
                Plan::of(*flyer, way.omegas_rad_s.clone(), dtau_s, (Some(0), flyer.fallback))
            }
            None => fallback.clone(),
        };
        let plans = flyers.iter().zip(candidates).zip(&fallbacks).map(first).collect();
        let mut by_rank: Vec<usize> = (0..flyers.len()).collect();
        by_rank.sort_unstable_by_key(|&i| flyers[i].rank);
        Self { flyers, candidates, dtau_s, certainty, plans, fallbacks, by_rank }
    }

    /// Whether a plan of airplane `i` goes with what `j` may fly.
    fn fits(&self, i: usize, plan: &Plan, j: usize) -> bool {
        plan.is_compatible(&self.plans[j])
            && (self.certainty == Certainty::Sure
                || (plan.is_compatible(&self.fallbacks[j])
                    && self.fallbacks[i].is_compatible(&self.plans[j])))
    }

    fn until_compatible(&mut self) {
        let mut pairs = self.incompatible_pairs();
        while let Some(loser) = self.loser(&pairs) {
            let other = self.another_plan(loser);
            self.plans[loser] = other.unwrap_or_else(|| self.fallbacks[loser].clone());
            pairs.retain(|&(i, j)| i != loser && j != loser);
            pairs.extend(self.incompatible_with(loser));
        }
    }

    /// The airplane of lowest rank that has to give way in some pair.
    fn loser(&self, pairs: &[(usize, usize)]) -> Option<usize> {
        let gives_way = |i: usize| {
            !self.plans[i].is_fallback()
                && pairs.iter().any(|&(a, b)| {
                    let other = if a == i { b } else { a };
                    (a == i || b == i)
                        && (self.plans[other].is_fallback()
                            || self.flyers[other].rank > self.flyers[i].rank)
                })
        };
        self.by_rank.iter().copied().find(|&i| gives_way(i))
    }

    fn incompatible_pairs(&self) -> Vec<(usize, usize)> {
        let n = self.plans.len();
        let all = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j)));
        all.filter(|&(i, j)| !self.fits(i, &self.plans[i], j)).collect()
    }

    fn incompatible_with(&self, i: usize) -> Vec<(usize, usize)> {
        let others = (0..self.plans.len()).filter(|&j| j != i);
        others.filter(|&j| !self.fits(i, &self.plans[i], j)).map(|j| (i, j)).collect()
    }

    /// The first plan of an airplane that is compatible with all present ones.
    fn another_plan(&self, i: usize) -> Option<Plan> {
        let flyer = self.flyers[i];
        let others: Vec<usize> = (0..self.plans.len()).filter(|&j| j != i).collect();
        let fits = |plan: &Plan| others.iter().all(|&j| self.fits(i, plan, j));
        self.candidates[i].iter().enumerate().find_map(|(k, way)| {
            Side::BOTH
                .into_iter()
                .map(|side| Plan::of(flyer, way.omegas_rad_s.clone(), self.dtau_s, (Some(k), side)))
                .find(|plan| fits(plan))
        })
    }

    /// By falling rank, those that have fallen back try once more, as long as that helps anyone.
    fn better_again(&mut self) {
        let mut helped = true;
        while helped {
            helped = false;
            for k in (0..self.by_rank.len()).rev() {
                let i = self.by_rank[k];
                if self.plans[i].is_fallback()
                    && let Some(plan) = self.another_plan(i)
                {
                    self.plans[i] = plan;
                    helped = true;
                }
            }
        }
    }
}

/// Sides for first fallbacks that are pairwise apart, as far as there are any, and the pairs that
/// are not: they start too close.
pub fn first_fallbacks(flyers: &[Flyer]) -> (Vec<Side>, Vec<(usize, usize)>) {
    entry_fallbacks(flyers, |_| true)
}

/// The same among airplanes some of which have their fallbacks already and keep them: only those
/// that `enters` choose, and only pairs with one of them are named.
pub fn entry_fallbacks(
    flyers: &[Flyer],
    enters: impl Fn(usize) -> bool,
) -> (Vec<Side>, Vec<(usize, usize)>) {
    let orbit = |i: usize, side: Side| {
        let flyer = &flyers[i];
        Orbit::from(flyer.pose, flyer.v_m_s, side.sign() * flyer.omega_max_rad_s)
    };
    let clash = |i: usize, a: Side, j: usize, b: Side| {
        let gap_m = flyers[i].separation_m.max(flyers[j].separation_m) + SLACK_M;
        !orbit(i, a).stays_apart(&orbit(j, b), gap_m)
    };
    let near = near_each_other(flyers);
    let mut sides: Vec<Side> = flyers.iter().map(|flyer| flyer.fallback).collect();
    let clashes = |sides: &[Side], i: usize, side: Side| {
        near[i].iter().filter(|&&j| clash(i, side, j, sides[j])).count()
    };
    // Whoever has fewer clashes on the other side changes over; clashes only become fewer.
    let mut changed = true;
    while changed {
        changed = false;
        for i in (0..sides.len()).filter(|&i| enters(i)) {
            let better = Side::BOTH.into_iter().min_by_key(|&side| clashes(&sides, i, side));
            if let Some(better) = better
                && clashes(&sides, i, better) < clashes(&sides, i, sides[i])
            {
                sides[i] = better;
                changed = true;
            }
        }
    }
    let pairs = near.iter().enumerate().flat_map(|(i, near)| near.iter().map(move |&j| (i, j)));
    let left = pairs
        .filter(|&(i, j)| i < j && (enters(i) || enters(j)) && clash(i, sides[i], j, sides[j]))
        .collect();
    (sides, left)
}

/// The side on which an airplane that flies as `now` and is about to fly as `changed` has an orbit apart from the stored
/// fallbacks of others, if there is one; rather the one it has stored.
pub fn side_apart(
    now: &Flyer,
    changed: &Flyer,
    others: impl Iterator<Item = Flyer>,
) -> Option<Side> {
    let orbit = |flyer: &Flyer, side: Side| {
        Orbit::from(flyer.pose, flyer.v_m_s, side.sign() * flyer.omega_max_rad_s)
    };
    // A pair that came in too close is so as it is now, not as it would be.
    let minds = |other: &Flyer| changed.is_on_level(other) && !now.is_left_alone_with(other);
    let minded: Vec<Flyer> = others.filter(minds).collect();
    let is_apart = |side: &Side| {
        minded.iter().all(|other| {
            let gap_m = changed.separation_m.max(other.separation_m) + SLACK_M;
            orbit(changed, *side).stays_apart(&orbit(other, other.fallback), gap_m)
        })
    };
    let sides = Side::BOTH.into_iter().filter(|&side| side != changed.fallback);
    [changed.fallback].into_iter().chain(sides).find(is_apart)
}

/// Per airplane all others whose orbits might come too near its own, by rising number. Sorted by
/// x, only neighbors in that order have to be looked at.
fn near_each_other(flyers: &[Flyer]) -> Vec<Vec<usize>> {
    let reach_m = |f: &Flyer| 2.0 * f.v_m_s / f.omega_max_rad_s + f.separation_m + SLACK_M;
    let widest_m = flyers.iter().map(reach_m).fold(0.0, f64::max);
    let x = |i: usize| flyers[i].pose.at[0];
    let mut by_x: Vec<usize> = (0..flyers.len()).collect();
    by_x.sort_unstable_by(|&a, &b| x(a).total_cmp(&x(b)));
    let mut near = vec![Vec::new(); flyers.len()];
    for (k, &i) in by_x.iter().enumerate() {
        let beside = by_x[k + 1..].iter().take_while(|&&j| x(j) - x(i) < 2.0 * widest_m);
        for &j in beside {
            let apart_m = distance_m(flyers[i].pose.at, flyers[j].pose.at);
            if flyers[i].minds(&flyers[j]) && apart_m < reach_m(&flyers[i]) + reach_m(&flyers[j]) {
                near[i].push(j);
                near[j].push(i);
            }
        }
    }
    near.iter_mut().for_each(|all| all.sort_unstable());
    near
}

#[cfg(test)]
mod tests {
    use super::super::airplane::Point;
    use super::*;
    use proptest::prelude::*;

    const DTAU_S: f64 = 1.0;
    const STEPS: usize = 5;

    fn flyer(x: f64, y: f64, psi_rad: f64, rank: u64) -> Flyer {
        Flyer {
            id: rank as u32,
            pose: Pose { at: [x, y], psi_rad },
            v_m_s: 35.0,
            omega_max_rad_s: 4f64.to_radians(),
            separation_m: 500.0,
            levels: Levels::at(0.0),
            vertical_m: 300.0,
            fallback: Side::Left,
            came_too_close: false,
            rank,
        }
    }

    fn some_flyers() -> impl Strategy<Value = Vec<Flyer>> {
        prop::collection::vec(
            (-4000.0f64..4000.0, -4000.0f64..4000.0, -3.1f64..3.1, 0.5f64..1.0),
            2..9,
        )
        .prop_map(|all| {
            let build = |(i, (x, y, psi, slow)): (usize, (f64, f64, f64, f64))| {
                // Every other airplane has a speed and turn rate of its own.
                let mut flyer = flyer(x, y, psi, (i * 7 % 11) as u64);
                if i % 3 == 2 {
                    flyer.v_m_s *= slow;
                    flyer.omega_max_rad_s *= 1.0 + slow;
                }
                flyer
            };
            all.into_iter().enumerate().map(build).collect()
        })
    }

    /// Airplanes with fallbacks that are apart: those that clash are left out.
    fn with_fallbacks(mut flyers: Vec<Flyer>) -> Vec<Flyer> {
        loop {
            let (sides, clashes) = first_fallbacks(&flyers);
            match clashes.first() {
                Some(&(i, _)) => drop(flyers.remove(i)),
                None => {
                    flyers.iter_mut().zip(sides).for_each(|(f, side)| f.fallback = side);
                    return flyers;
                }
            }
        }
    }

    fn orbit_of(flyer: &Flyer) -> Orbit {
        Orbit::from(flyer.pose, flyer.v_m_s, flyer.fallback.sign() * flyer.omega_max_rad_s)
    }

    fn nearest_on_orbits(flyers: &[Flyer], seconds: usize) -> f64 {
        let orbits: Vec<Orbit> = flyers.iter().map(orbit_of).collect();
        let mut nearest = f64::INFINITY;
        for t in 0..seconds * 4 {
            for (i, a) in orbits.iter().enumerate() {
                for b in &orbits[i + 1..] {
                    let t_s = t as f64 / 4.0;
                    nearest = nearest.min(distance_m(a.at(t_s), b.at(t_s)));
                }
            }
        }
        nearest
    }

    proptest! {
        /// Step 1 of the proof: first fallbacks without clashes stay apart for ever.
        #[test]
        fn first_fallbacks_stay_apart(flyers in some_flyers()) {
            let flyers = with_fallbacks(flyers);
            prop_assert!(nearest_on_orbits(&flyers, 400) >= 500.0);
        }

        /// Steps 2 to 4: whatever is wanted, what is flown keeps apart, and what is stored
        /// keeps the invariant. Mixable plans do in every mixture with fallbacks.
        #[test]
        fn a_filtered_step_keeps_separation_and_the_invariant(
            flyers in some_flyers(),
            wishes in prop::collection::vec(prop::collection::vec(-1.0f64..1.0, 0..4), 9),
            follow in prop::collection::vec(any::<bool>(), 9),
            mixable in any::<bool>(),
        ) {
            let flyers = with_fallbacks(flyers);
            let candidates: Vec<Vec<Way>> = flyers.iter().zip(&wishes).map(|(f, wishes)| {
                let way = |part: &f64| Way { omegas_rad_s: vec![part * f.omega_max_rad_s; STEPS] };
                wishes.iter().map(way).collect()
            }).collect();
            let certainty = if mixable { Certainty::Mixable } else { Certainty::Sure };
            let mut decisions = filter(&flyers, &candidates, (STEPS, DTAU_S), certainty);
            if mixable {
                for ((decision, follows), flyer) in decisions.iter_mut().zip(follow).zip(&flyers) {
                    if !follows {
                        *decision = Decision { candidate: None, fallback: flyer.fallback };
                    }
                }
            }
            let omega = |i: usize, k: usize| match decisions[i].candidate {
                Some(c) => candidates[i][c].omegas_rad_s[k],
                None => flyers[i].fallback.sign() * flyers[i].omega_max_rad_s,
            };
            let mut now = flyers.clone();
            for k in 0..STEPS {
                for part in 1..=20 {
                    let t_s = DTAU_S * f64::from(part) / 20.0;
                    let at: Vec<Point> = now.iter().enumerate()
                        .map(|(i, f)| f.pose.step(f.v_m_s, omega(i, k), t_s).at).collect();
                    for i in 0..at.len() {
                        for j in i + 1..at.len() {
                            prop_assert!(distance_m(at[i], at[j]) >= 500.0);
                        }
                    }
                }
                for (i, f) in now.iter_mut().enumerate() {
                    f.pose = f.pose.step(f.v_m_s, omega(i, k), DTAU_S);
                }
            }
            now.iter_mut().zip(&decisions).for_each(|(f, d)| f.fallback = d.fallback);
            prop_assert!(nearest_on_orbits(&now, 400) >= 500.0);
        }

        /// Whoever is far from everybody flies what it wants.
        #[test]
        fn nobody_falls_back_without_need(x in 20_000.0f64..1e6, part in -1.0f64..1.0) {
            let flyers = [flyer(0.0, 0.0, 0.0, 0), flyer(x, 0.0, 3.0, 1)];
            let way = || Way { omegas_rad_s: vec![part * flyers[0].omega_max_rad_s; STEPS] };
            let wishes = [vec![way()], vec![way()]];
            let decisions = filter(&flyers, &wishes, (STEPS, DTAU_S), Certainty::Sure);
            prop_assert!(decisions.iter().all(|d| d.candidate == Some(0)));
        }
    }

    #[test]
    fn who_enters_chooses_a_side_apart_from_the_stored_ones_and_nobody_else_does() {
        // On its left the newcomer would orbit over the other, on its right it would not.
        let stored = flyer(0.0, 2002.0, std::f64::consts::PI, 0);
        let flyers = [stored, flyer(0.0, 0.0, 0.0, 1)];
        let (sides, too_close) = entry_fallbacks(&flyers, |i| i == 1);
        assert_eq!((sides, too_close), (vec![Side::Left, Side::Right], vec![]));
        let near = [stored, flyer(100.0, 2002.0, 0.0, 1), flyer(50.0, 2030.0, 0.0, 2)];
        let (sides, too_close) = entry_fallbacks(&near, |i| i == 2);
        assert_eq!(sides[..2], [Side::Left; 2]);
        assert_eq!(too_close, [(0, 2), (1, 2)], "the pair that was there before is not named");
    }

    #[test]
    fn two_that_came_in_too_close_are_left_to_the_method_and_nobody_else_is() {
        let close = |x: f64, rank: u64| Flyer { came_too_close: true, ..flyer(x, 0.0, 0.0, rank) };
        let flyers = [close(0.0, 0), close(100.0, 1)];
        let straight = || vec![Way { omegas_rad_s: vec![0.0; STEPS] }];
        let wanted = filter(&flyers, &[straight(), straight()], (STEPS, DTAU_S), Certainty::Sure);
        assert!(wanted.iter().all(|d| d.candidate == Some(0)), "{wanted:?}");
        // In each other's way, but with fallbacks that are apart.
        let mut apart = [close(0.0, 0), close(0.0, 1)];
        apart[1].pose = Pose { at: [0.0, 620.0], psi_rad: -std::f64::consts::FRAC_PI_2 };
        apart.iter_mut().for_each(|f| f.fallback = Side::Right);
        assert!(nearest_on_orbits(&apart, 400) > 500.0);
        let kept = filter(&apart, &[straight(), straight()], (STEPS, DTAU_S), Certainty::Sure);
        assert!(kept.iter().any(|d| d.candidate.is_none()), "{kept:?}");
    }

    #[test]
    fn a_change_is_refused_when_neither_orbit_is_apart() {
        let quick_turns = 6f64.to_radians();
        let other = Flyer { omega_max_rad_s: quick_turns, ..flyer(1500.0, -100.0, 0.0, 0) };
        let slow = flyer(0.0, 0.0, 0.0, 1);
        let beside = |v_m_s: f64| side_apart(&slow, &Flyer { v_m_s, ..slow }, [other].into_iter());
        assert_eq!(beside(35.0), Some(Side::Left));
        assert_eq!(beside(150.0), None);
        let above = Flyer { levels: Levels::at(1000.0), v_m_s: 150.0, ..slow };
        assert_eq!(side_apart(&slow, &above, [other].into_iter()), Some(Side::Left));
        // Both came in too close, but not to each other.
        let came_too_close = |f: Flyer| Flyer { came_too_close: true, ..f };
        let fast = came_too_close(Flyer { v_m_s: 150.0, ..slow });
        let others = [came_too_close(other)].into_iter();
        assert_eq!(side_apart(&came_too_close(slow), &fast, others), None);
        let climbing = Flyer { levels: Levels::between(0.0, 1000.0), ..above };
        assert_eq!(side_apart(&slow, &climbing, [other].into_iter()), None);
    }

    #[test]
    fn airplanes_that_start_too_close_are_named() {
        let flyers = [flyer(0.0, 0.0, 0.0, 0), flyer(5e4, 0.0, 0.0, 1), flyer(100.0, 0.0, 0.0, 2)];
        assert_eq!(first_fallbacks(&flyers).1, [(0, 2)]);
    }
}
