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
//! ([`first_fallbacks`] chooses them). An airplane that leaves the world keeps every other pair
//! as it was. A wind that all know moves everybody alike and changes no distance. Each step is
//! a property test below.
//!
//! Numbers: `orbit.rs` never says wrongly that motions stay apart. New plans must keep
//! [`SLACK_M`] more than `R`, so that rounding never adds up to a loss.

use super::airplane::{Pose, distance_m};
use super::orbit::{Orbit, stays_apart};

pub use super::orbit::Side;

/// Metres that new plans keep beyond the separation.
pub const SLACK_M: f64 = 0.01;
/// What the shield knows of an airplane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flyer {
    /// Where it is.
    pub pose: Pose,
    /// Airspeed.
    pub v_m_s: f64,
    /// Largest turn rate.
    pub omega_max_rad_s: f64,
    /// Its separation; of two airplanes the larger one counts.
    pub separation_m: f64,
    /// The level it keeps,
    pub altitude_m: f64,
    /// and how far above each other airplanes need not mind each other.
    pub vertical_m: f64,
    /// Its stored fallback.
    pub fallback: Side,
    /// Higher ranks keep what they want; unique.
    pub rank: u64,
}

impl Flyer {
    fn minds(&self, other: &Self) -> bool {
        (self.altitude_m - other.altitude_m).abs() < self.vertical_m.max(other.vertical_m)
    }
}

/// Motion for one `dt`: a turn rate per step of `dtau`.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Way {
    /// Turn rate in each step.
    pub omegas_rad_s: Vec<f64>,
}

/// What an airplane flies, and where it can wait after that.
#[derive(Debug, Clone, PartialEq)]
struct Plan {
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
    fn new(
        flyer: Flyer,
        omegas_rad_s: Vec<f64>,
        dtau_s: f64,
        orbit: (Option<usize>, Side),
    ) -> Self {
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

    fn fallback(flyer: Flyer, steps: usize, dtau_s: f64) -> Self {
        let omega = flyer.fallback.sign() * flyer.omega_max_rad_s;
        Self::new(flyer, vec![omega; steps], dtau_s, (None, flyer.fallback))
    }

    /// Whether two plans stay apart during `dt` and on the orbits ever after.
    fn is_compatible(&self, other: &Self) -> bool {
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

/// Decides for airplanes whose stored fallbacks are pairwise apart. `candidates[i]` are the ways
/// that airplane `i` may fly, the one it wants first; all have as many steps of `dtau_s`.
pub fn filter(flyers: &[Flyer], candidates: &[Vec<Way>], dtau_s: f64) -> Vec<Decision> {
    let mut search = Search::new(flyers, candidates, dtau_s);
    search.until_compatible();
    search.better_again();
    search.plans.iter().map(|p| Decision { candidate: p.candidate, fallback: p.side }).collect()
}

struct Search<'a> {
    flyers: &'a [Flyer],
    candidates: &'a [Vec<Way>],
    dtau_s: f64,
    plans: Vec<Plan>,
    /// Airplanes by rising rank.
    by_rank: Vec<usize>,
}

impl<'a> Search<'a> {
    fn new(flyers: &'a [Flyer], candidates: &'a [Vec<Way>], dtau_s: f64) -> Self {
        let first = |(flyer, ways): (&Flyer, &Vec<Way>)| match ways.first() {
            Some(way) => {
                Plan::new(*flyer, way.omegas_rad_s.clone(), dtau_s, (Some(0), flyer.fallback))
            }
            None => Plan::fallback(*flyer, 1, dtau_s),
        };
        let plans = flyers.iter().zip(candidates).map(first).collect();
        let mut by_rank: Vec<usize> = (0..flyers.len()).collect();
        by_rank.sort_unstable_by_key(|&i| flyers[i].rank);
        Self { flyers, candidates, dtau_s, plans, by_rank }
    }

    fn until_compatible(&mut self) {
        let mut pairs = self.incompatible_pairs();
        while let Some(loser) = self.loser(&pairs) {
            let other = self.another_plan(loser);
            self.plans[loser] = other.unwrap_or_else(|| self.fallback_of(loser));
            pairs.retain(|&(i, j)| i != loser && j != loser);
            pairs.extend(self.incompatible_with(loser));
        }
    }

    fn fallback_of(&self, i: usize) -> Plan {
        let steps = self.candidates[i].first().map_or(1, |way| way.omegas_rad_s.len());
        Plan::fallback(self.flyers[i], steps, self.dtau_s)
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
        all.filter(|&(i, j)| !self.plans[i].is_compatible(&self.plans[j])).collect()
    }

    fn incompatible_with(&self, i: usize) -> Vec<(usize, usize)> {
        let others = (0..self.plans.len()).filter(|&j| j != i);
        others.filter(|&j| !self.plans[i].is_compatible(&self.plans[j])).map(|j| (i, j)).collect()
    }

    /// The first plan of an airplane that is compatible with all present ones.
    fn another_plan(&self, i: usize) -> Option<Plan> {
        let flyer = self.flyers[i];
        let others: Vec<usize> = (0..self.plans.len()).filter(|&j| j != i).collect();
        let fits = |plan: &Plan| others.iter().all(|&j| plan.is_compatible(&self.plans[j]));
        self.candidates[i].iter().enumerate().find_map(|(k, way)| {
            Side::BOTH
                .into_iter()
                .map(|side| {
                    Plan::new(flyer, way.omegas_rad_s.clone(), self.dtau_s, (Some(k), side))
                })
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
        for i in 0..sides.len() {
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
    let left = pairs.filter(|&(i, j)| i < j && clash(i, sides[i], j, sides[j])).collect();
    (sides, left)
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
            pose: Pose { at: [x, y], psi_rad },
            v_m_s: 35.0,
            omega_max_rad_s: 4f64.to_radians(),
            separation_m: 500.0,
            altitude_m: 0.0,
            vertical_m: 300.0,
            fallback: Side::Left,
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
        /// keeps the invariant.
        #[test]
        fn a_filtered_step_keeps_separation_and_the_invariant(
            flyers in some_flyers(),
            wishes in prop::collection::vec(prop::collection::vec(-1.0f64..1.0, 0..4), 9),
        ) {
            let flyers = with_fallbacks(flyers);
            let candidates: Vec<Vec<Way>> = flyers.iter().zip(&wishes).map(|(f, wishes)| {
                let way = |part: &f64| Way { omegas_rad_s: vec![part * f.omega_max_rad_s; STEPS] };
                wishes.iter().map(way).collect()
            }).collect();
            // An airplane without candidates falls back with as many steps as the others.
            let candidates: Vec<Vec<Way>> = candidates.into_iter().zip(&flyers).map(|(ways, f)| {
                if ways.is_empty() {
                    vec![Way { omegas_rad_s: vec![f.fallback.sign() * f.omega_max_rad_s; STEPS] }]
                } else {
                    ways
                }
            }).collect();
            let decisions = filter(&flyers, &candidates, DTAU_S);
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
            let decisions = filter(&flyers, &[vec![way()], vec![way()]], DTAU_S);
            prop_assert!(decisions.iter().all(|d| d.candidate == Some(0)));
        }
    }

    #[test]
    fn airplanes_that_start_too_close_are_named() {
        let flyers = [flyer(0.0, 0.0, 0.0, 0), flyer(5e4, 0.0, 0.0, 1), flyer(100.0, 0.0, 0.0, 2)];
        assert_eq!(first_fallbacks(&flyers).1, [(0, 2)]);
    }
}
