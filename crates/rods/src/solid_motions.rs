//! Motions of a chain with a solid body that most of it follows later.
//!
//! A bend where parts of the chain come near each other is at its start, where connector 0 leads it, and comes down the
//! chain slowly. So the first rods move with each motion and are proven to keep clear as all motions are; what the
//! others do is foreseen for several motions, and they follow all of them at once, which is much faster. The bits are
//! those of whole motions, one after the other.

use super::chain::Chain;
use super::geometry::{Point, distance};
use super::motion_bounds::{NextMotions, ProvenMotion, SeparationBounds, first_cone_rod};
use super::open;
use super::pass::MotionEffects;
use super::propagate::SeparationProofSchedule;
use super::rules::ReactionRules;
use super::wavefront::{DeferredMotions, LANES, MotionBatchMeasures};

/// Number of rods below which to foresee motions costs more than it saves: the first rods are at least 64.
const MIN_RODS: usize = 256;
/// Fraction by which the next motions may be longer than the present one: rounding of lengths.
const STEP_MARGIN: f64 = 1e-6;

/// Motions of connector 0 of a plain chain with a solid body that most other connectors have yet to follow.
#[derive(Debug, Default)]
pub struct DeferredSolidMotions<const D: usize> {
    motions: DeferredMotions<D>,
    /// What is known of the distances between the chain's parts.
    bounds: SeparationBounds<D>,
    /// What is foreseen of the next motions.
    foresight: Option<Foresight>,
    schedule: SeparationProofSchedule,
}

/// From which rod on nothing can object to the next motions.
#[derive(Debug, Clone, Copy)]
struct Foresight {
    first_rods: usize,
    motions: NextMotions,
}

/// A copy knows the motions, but not the distances, which take long to copy and are measured again.
impl<const D: usize> Clone for DeferredSolidMotions<D> {
    fn clone(&self) -> Self {
        Self { motions: self.motions.clone(), ..Self::default() }
    }
}

impl<const D: usize> DeferredSolidMotions<D> {
    /// Returns whether all connectors are where they should be.
    pub fn is_empty(&self) -> bool {
        self.motions.is_empty()
    }

    /// Returns whether the chain is to follow now, because no more motions are foreseen.
    pub fn is_full(&self) -> bool {
        self.foresight.is_some_and(|foresight| foresight.motions.count == 0)
    }

    /// Moves connector 0 of a plain chain, by more than the chain's least move, and the connectors after it to which
    /// something could object; returns their measures. None if nothing has moved: then the chain is to follow all
    /// deferred motions, and to make this one by a request.
    pub fn try_move(
        &mut self,
        chain: &mut Chain<D>,
        rules: &ReactionRules,
        to: Point<D>,
    ) -> Option<MotionBatchMeasures> {
        let step_m = distance(chain.points()[0], to);
        if self.foresight.is_none() {
            self.foresight = self.foresee(chain, rules, step_m);
        }
        let foresight = self.foresight.filter(|foresight| step_m <= foresight.motions.step_m)?;
        let Foresight { first_rods, motions } = foresight;
        let travel_m = motions.travel_m();
        let was = chain.points()[first_rods];
        let mut effects = MotionEffects::start(0);
        let last_pushed = open::pull_first_connectors(chain, first_rods + 1, to, &mut effects);
        // The proof takes all rods from the cone's start on as pulled, and no connector as faster than connector 0.
        let is_foreseen = effects.max_slave_step_m <= travel_m
            && last_pushed.is_none_or(|last| last < first_cone_rod(first_rods));
        let moved = 0..effects.to;
        self.bounds.add_lag(first_rods, travel_m);
        let motion =
            ProvenMotion { moved: moved.clone(), travel_m, in_turn: false, is_whole: true };
        if !is_foreseen || !self.bounds.allows_first(chain, &motion, first_rods) {
            let before = &self.bounds.recorded_points()[moved.clone()];
            chain.points_mut()[moved].copy_from_slice(before);
            self.bounds.revert(travel_m);
            self.schedule.record(false);
            return None;
        }
        self.bounds.accept(chain, moved);
        let now = chain.points()[first_rods];
        if now != was {
            self.motions.defer_rest(first_rods, [was, now]);
        }
        let motions = NextMotions { count: motions.count - 1, ..motions };
        self.foresight = Some(Foresight { first_rods, motions });
        Some(MotionBatchMeasures {
            changed: effects.changed as u64,
            longest_m: effects.max_slave_step_m,
            max_rod_violation_m: chain.max_rod_violation_of_first_m(first_rods),
        })
    }

    /// Foresees the next motions, of which the present one is the first.
    fn foresee(
        &mut self,
        chain: &Chain<D>,
        rules: &ReactionRules,
        step_m: f64,
    ) -> Option<Foresight> {
        let motions = NextMotions { count: LANES, step_m: step_m * (1.0 + STEP_MARGIN) };
        // A copy has motions of which it knows nothing.
        let may_foresee = self.motions.is_empty()
            && chain.rods().len() >= MIN_RODS
            && motions.travel_m() <= rules.slave_step_max_m;
        if !may_foresee || !self.schedule.is_due() {
            return None;
        }
        self.bounds.record(chain);
        let first_rods = self.bounds.foresee(chain, motions);
        self.schedule.record(first_rods.is_some());
        Some(Foresight { first_rods: first_rods?, motions })
    }

    /// Lets the other connectors follow all deferred motions; returns their measures, if there were any. Afterwards the
    /// chain may be moved by others.
    pub fn apply_to_chain(&mut self, chain: &mut Chain<D>) -> Option<MotionBatchMeasures> {
        let foresight = self.foresight.take();
        let heads = self.motions.len() as u64;
        let measures = self.motions.apply_to_chain(chain);
        if let Some(Foresight { first_rods, .. }) = foresight {
            self.bounds.end_lag(chain, first_rods);
        }
        // The heads were counted when they moved.
        measures
            .map(|measures| MotionBatchMeasures { changed: measures.changed - heads, ..measures })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Connector, MotionRequest, Obstacles, Propagator, Rod};
    use super::*;
    use crate::fixtures::Wanderer;
    use crate::geometry::unit_x;
    use proptest::prelude::*;

    fn solid_rules() -> ReactionRules {
        ReactionRules { self_collision: true, ..ReactionRules::default() }
    }

    /// Moves two chains to the same places, one by requests and one by deferred motions; returns the number of motions
    /// that were deferred.
    fn same_bits<const D: usize>(
        mut one_by_one: Chain<D>,
        mut places: impl FnMut(usize, &Chain<D>) -> Point<D>,
        motions: usize,
    ) -> usize {
        let mut later = one_by_one.clone();
        let mut propagator = Propagator::new(solid_rules());
        let mut other_propagator = Propagator::new(solid_rules());
        let mut deferred = DeferredSolidMotions::default();
        let mut changed = [0; 2];
        let mut longest_m = [0.0_f64; 2];
        let mut n_deferred = 0;
        for k in 0..motions {
            let to = places(k, &one_by_one);
            let request = MotionRequest::from_operator(0, to);
            let nothing = Obstacles::default();
            let outcome = propagator.propagate(&mut one_by_one, &nothing, &request).unwrap();
            if let Some(moved) = outcome.motion() {
                changed[0] += moved.changed as u64;
                longest_m[0] = longest_m[0].max(moved.max_slave_step_m);
            }
            let mut count = |measures: Option<MotionBatchMeasures>| {
                let measures = measures.unwrap_or_default();
                changed[1] += measures.changed;
                longest_m[1] = longest_m[1].max(measures.longest_m);
            };
            let moved = deferred.try_move(&mut later, &solid_rules(), to);
            count(moved);
            n_deferred += usize::from(moved.is_some());
            if deferred.is_full() || moved.is_none() {
                count(deferred.apply_to_chain(&mut later));
            }
            if moved.is_none() {
                let outcome = other_propagator.propagate(&mut later, &nothing, &request).unwrap();
                if let Some(moved) = outcome.motion() {
                    changed[1] += moved.changed as u64;
                    longest_m[1] = longest_m[1].max(moved.max_slave_step_m);
                }
            }
            // A copy may be read at any time.
            if k % 7 == 0 {
                let mut copy = later.clone();
                deferred.clone().apply_to_chain(&mut copy);
                assert_eq!(copy.points(), one_by_one.points(), "motion {k}");
            }
        }
        let last = deferred.apply_to_chain(&mut later).unwrap_or_default();
        changed[1] += last.changed;
        longest_m[1] = longest_m[1].max(last.longest_m);
        assert_eq!(later.points(), one_by_one.points());
        assert_eq!(changed[0], changed[1]);
        assert_eq!(longest_m[0].to_bits(), longest_m[1].to_bits());
        n_deferred
    }

    fn straight_chain<const D: usize>(rods: usize, rod_m: f64, slack: f64) -> Chain<D> {
        let rod = Rod { min_m: (1.0 - slack) * rod_m, max_m: rod_m, radius_m: 0.1 * rod_m };
        let back = crate::geometry::scaled(unit_x(), -1.0);
        let connector = Connector::free(0.2 * rod_m);
        Chain::straight([0.0; D], back, rods, rod, connector).unwrap()
    }

    #[test]
    fn a_straight_chain_that_is_led_along_a_line_defers_nearly_all_motions() {
        let chain = straight_chain::<3>(1000, 0.1, 0.0);
        let n = same_bits(chain, |k, _| [0.02 * (k + 1) as f64, 0.0, 0.0], 200);
        assert!(n >= 190, "{n} of 200");
    }

    /// The head turns back and leads past the chain: bends come down it, and some motions are vetoed.
    #[test]
    fn a_chain_that_meets_itself_is_as_one_that_moves_at_once() {
        let chain = straight_chain::<2>(400, 0.1, 0.0);
        let places = |k: usize, chain: &Chain<2>| {
            let [x, y] = chain.points()[0];
            match k % 400 {
                0..100 => [x + 0.02, y],
                100..140 => [x, y + 0.02],
                140..300 => [x - 0.02, y],
                _ => [x - 0.01, y - 0.02],
            }
        };
        let n = same_bits(chain, places, 1200);
        assert!(n >= 300, "{n} of 1200");
    }

    /// Led straight back, the head pushes all rods; a zigzag far down the chain folds up, which no cone foresees.
    #[test]
    fn a_zigzag_that_is_pushed_folds_up_as_one_that_moves_at_once() {
        let heading = |rod: usize| match rod {
            0..130 => 0.0,
            _ if rod.is_multiple_of(2) => 0.2,
            _ => -0.2,
        };
        let mut points = vec![[0.0; 2]];
        for rod in 0..420 {
            let (sin, cos) = sidestep_kernel::math::sin_cos(heading(rod));
            let [x, y] = points[rod];
            points.push([x - 0.1 * cos, y + 0.1 * sin]);
        }
        let rod = Rod::with_fixed_length(0.1, 0.008);
        let chain = Chain::new(points, vec![Connector::free(0.04); 421], vec![rod; 420]).unwrap();
        same_bits(chain, |k, _| [-0.02 * (k + 1) as f64, 0.0], 40);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn deferred_motions_of_a_solid_chain_are_motions_one_after_the_other(
            rods in 256usize..700, slack in 0.0..0.3f64, step_ratio in 0.02..0.4f64, seed in 0u64..1000,
            straight in 1usize..60,
        ) {
            let rod_m = 0.1;
            let mut walk = Wanderer::new(seed);
            // Straight on for a while, then elsewhere.
            let mut heading = unit_x::<3>();
            let places = |k: usize, chain: &Chain<3>| {
                let at = chain.points()[0];
                if k % straight == straight - 1 {
                    let to = walk.next(at, 1.0);
                    heading = crate::geometry::sub(to, at);
                    let length_m = crate::geometry::norm(heading).max(1e-3);
                    heading = crate::geometry::scaled(heading, 1.0 / length_m);
                }
                crate::geometry::add_scaled(at, heading, step_ratio * rod_m)
            };
            same_bits(straight_chain::<3>(rods, rod_m, slack), places, 150);
        }
    }
}
