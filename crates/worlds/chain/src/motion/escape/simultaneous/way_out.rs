//! A way out for parts that are caught.
//!
//! A part between two obstacles that close like tongs, or of a chain that others hold taut, gets
//! out only through an obstacle, and the sooner the better. The ways that are tried: through any
//! obstacle that touches the chain, in some directions. Each is rolled out on the chain around the
//! place, with obstacles going straight on, and the one with the least time inside is taken.

use super::super::threat::Part;
use super::super::{Escape, Margin};
use super::TOUCH_M;
use super::contacts::radius_m;
use super::given::{Given, Through, Wishes};
use super::posture::ends;
use super::solve::{Solver, away_from};
use crate::rods::chain::Chain;
use crate::rods::geometry::{
    Point, add, along, cross, in_dimensions, norm, perpendicular, scaled, unit,
};
use crate::rods::obstacle::{Obstacle, Obstacles};
use crate::rods::rules::Rules;
use serde::{Deserialize, Serialize};
use sidestep_kernel::math::{cos, sin};
use std::f64::consts::FRAC_PI_6;

/// A chain's memory of how it gets out of where it was caught.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct WayOut {
    passing: Option<Passing>,
    /// Ticks until another way may be looked for.
    rest: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Passing {
    obstacle: u32,
    toward: [f64; 3],
}

/// Ticks from one choice of a way to the next.
const REST: u32 = 4;
/// Distance at which a chain is in danger: another way is looked for; and distance from which on
/// an obstacle is passed, meters.
const DANGER_M: f64 = 0.12;
const PASSED_M: f64 = 0.17;
/// Longest time of a roll-out, s, and most ticks; and ticks without contact after which it ends.
const HORIZON_S: f64 = 3.0;
const MOST_TICKS: usize = 150;
const CLEAR_TICKS: usize = 75;
/// Cost of depth, in ticks per meter and tick.
const DEPTH_COST: f64 = 0.2;
/// Factor by which a way must be better than the present one.
const BETTER: f64 = 0.8;
/// Most work of a choice: ticks of roll-outs times connectors in them.
const MOST_WORK: usize = 100_000;
/// Rounds of a solve in a roll-out, with margins and without.
const ROUNDS: [usize; 2] = [12, 20];
/// Connectors to either side of those in contact that roll-outs take along.
const AROUND: usize = 12;

impl WayOut {
    /// Whether nothing is remembered.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// Whether the chain is on its way through an obstacle.
    pub(super) fn is_passing(&self) -> bool {
        self.passing.is_some()
    }

    pub(super) fn tick(&mut self) {
        self.rest = self.rest.saturating_sub(1);
    }

    pub(super) fn through<const D: usize>(&self) -> Option<Through<D>> {
        self.passing.map(|p| Through { obstacle: p.obstacle, toward: in_dimensions(p.toward) })
    }

    /// Ends a way once no part is near the obstacle any more.
    pub(super) fn forget_what_is_passed<const D: usize>(
        &mut self,
        given: &Given<'_, D>,
        solver: &Solver<D>,
    ) {
        if self.through().is_some_and(|through| is_behind(given, solver, &through)) {
            self.passing = None;
        }
    }

    /// Looks for the best way out; returns whether it is another than before.
    pub(super) fn plan<const D: usize>(
        &mut self,
        rules: &Escape,
        given: &Given<'_, D>,
        solver: &Solver<D>,
        gap_m: f64,
    ) -> bool {
        if self.rest > 0 || gap_m > DANGER_M {
            return false;
        }
        self.rest = REST;
        let Some(stage) = Stage::around(rules, given, solver) else { return false };
        let now = self.through();
        let mut left = MOST_WORK / stage.chain.points().len();
        let mut best = (BETTER * stage.cost(now, f64::INFINITY, &mut left) - 0.5, now);
        for way in std::iter::once(None).chain(ways(given, solver).into_iter().map(Some)) {
            if left == 0 {
                break;
            }
            let cost = stage.cost(way, best.0, &mut left);
            if cost < best.0 {
                best = (cost, way);
            }
        }
        self.passing =
            best.1.map(|way| Passing { obstacle: way.obstacle, toward: in_dimensions(way.toward) });
        best.1 != now
    }
}

/// Whether all parts are farther from an obstacle than it takes to have passed it.
fn is_behind<const D: usize>(
    given: &Given<'_, D>,
    solver: &Solver<D>,
    through: &Through<D>,
) -> bool {
    let moving = given.obstacles.moving();
    let threats = solver.contacts.threats.iter();
    threats.filter(|t| moving[t.mover].id == through.obstacle).all(|threat| {
        let mover = &moving[threat.mover];
        gap_m(given.chain, threat.part, mover) > PASSED_M
    })
}

fn gap_m<const D: usize>(chain: &Chain<D>, part: Part, mover: &Obstacle<D>) -> f64 {
    let nearest = mover.core.nearest_to_segment(ends(chain.points(), part));
    nearest.distance_m - mover.radius_m - radius_m(chain, part)
}

/// Returns the ways through the obstacles that touch the chain.
fn ways<const D: usize>(given: &Given<'_, D>, solver: &Solver<D>) -> Vec<Through<D>> {
    let mut ways = Vec::new();
    let threats = &solver.contacts.threats;
    for (k, mover) in given.obstacles.moving().iter().enumerate() {
        let near = threats.iter().filter(|t| t.mover == k);
        let gaps = near.map(|t| (gap_m(given.chain, t.part, mover), t.part));
        let Some((gap_m, part)) = gaps.min_by(|a, b| a.0.total_cmp(&b.0)) else { continue };
        if gap_m < 2.0 * DANGER_M {
            let nearest = mover.core.nearest_to_segment(ends(given.chain.points(), part));
            let through = scaled(away_from(mover, &nearest), -1.0);
            let way = |toward| Through { obstacle: mover.id, toward };
            ways.push(directions(through, mover.velocity_m_s).into_iter().map(way));
        }
    }
    // Of each obstacle in turn, for there may be more than there is time for.
    let mut all = Vec::new();
    while ways.iter().any(|ways| ways.len() > 0) {
        all.extend(ways.iter_mut().filter_map(Iterator::next));
    }
    all
}

/// Returns the directions that are tried: straight through, against the obstacle's way, between
/// the two, and around.
fn directions<const D: usize>(through: Point<D>, velocity_m_s: Point<D>) -> Vec<Point<D>> {
    let mut all = vec![through];
    if let Some(against) = unit(scaled(velocity_m_s, -1.0)) {
        all.push(against);
        all.extend(unit(add(against, through)));
    }
    let first = perpendicular(through);
    let mut axes = vec![first];
    if D == 3 {
        let normal = cross(through, first);
        axes.extend(unit(in_dimensions::<3, D>([normal[0], normal[1], normal[2]])));
    }
    for axis in axes {
        let turned = |k: i32| {
            let turn_rad = f64::from(k) * FRAC_PI_6;
            along(scaled(through, cos(turn_rad)), axis, sin(turn_rad))
        };
        all.extend((1..12).map(turned));
    }
    all
}

/// Returns the first and the last connector of the chain around what is in danger.
fn in_danger<const D: usize>(given: &Given<'_, D>, solver: &Solver<D>) -> (usize, usize) {
    let Given { chain, obstacles, .. } = *given;
    let near =
        |mover: usize, part: Part| gap_m(chain, part, &obstacles.moving()[mover]) < 2.0 * DANGER_M;
    let threats = solver.contacts.threats.iter().filter(|t| near(t.mover, t.part));
    let (from, to) = threats.fold((usize::MAX, 0), |(from, to), threat| {
        let k = threat.part.connector();
        (from.min(k), to.max(k))
    });
    let last = chain.points().len() - 1;
    (from.min(to).saturating_sub(AROUND), (to + 1 + AROUND).min(last))
}

/// The chain around a place, and what moves near it: where ways are tried.
struct Stage<'a, const D: usize> {
    rules: &'a Rules,
    chain: Chain<D>,
    obstacles: Obstacles<D>,
    margin: Margin,
    dt_s: f64,
    most_m: f64,
    ticks: usize,
}

impl<'a, const D: usize> Stage<'a, D> {
    /// Cuts out the stage; none if there is nothing to cut.
    fn around(rules: &Escape, given: &Given<'a, D>, solver: &Solver<D>) -> Option<Self> {
        let Given { chain, obstacles, most_m, .. } = *given;
        let (from, to) = in_danger(given, solver);
        let cut = Chain::broken(
            chain.points()[from..=to].to_vec(),
            chain.connectors()[from..=to].to_vec(),
            chain.rods()[from..to].to_vec(),
        );
        let horizon_s = HORIZON_S.min(MOST_TICKS as f64 * rules.dt_s);
        let mut near = obstacles.clone();
        let middle = chain.points()[usize::midpoint(from, to)];
        let reach_m: f64 = chain.rods()[from..to].iter().map(|rod| rod.max_m).sum();
        let is_near = |o: &&Obstacle<D>| {
            let way_m = horizon_s * (norm(o.velocity_m_s) + rules.speed_max_m_s);
            o.core.nearest_to_point(middle).distance_m - o.radius_m < reach_m + way_m
        };
        let moving: Vec<_> = obstacles.moving().iter().filter(is_near).copied().collect();
        near.set_moving(&moving).ok()?;
        Some(Self {
            rules: given.rules,
            chain: cut.ok()?,
            obstacles: near,
            margin: rules.look_ahead(),
            dt_s: rules.dt_s,
            most_m,
            ticks: (horizon_s / rules.dt_s).ceil() as usize,
        })
    }

    /// Returns the time inside on a way, ticks, with something for depth; it may end early at
    /// `enough`, or when no tick is `left`.
    fn cost(&self, mut through: Option<Through<D>>, enough: f64, left: &mut usize) -> f64 {
        let (mut chain, mut obstacles) = (self.chain.clone(), self.obstacles.clone());
        let mut solver = Solver::default();
        let (mut cost, mut clear) = (0.0, 0);
        for _ in 0..self.ticks {
            if *left == 0 {
                return f64::INFINITY;
            }
            *left -= 1;
            let start = chain.points().to_vec();
            let given = Given {
                chain: &chain,
                obstacles: &obstacles,
                rules: self.rules,
                start: &start,
                most_m: self.most_m,
            };
            let gap_m = self.tick(&given, &mut solver, &mut through);
            chain.points_mut().copy_from_slice(&solver.points);
            clear = if gap_m < -TOUCH_M { 0 } else { clear + 1 };
            if clear == 0 {
                cost += 1.0 - DEPTH_COST * gap_m;
            }
            if clear > CLEAR_TICKS || cost >= enough {
                break;
            }
            obstacles.advance(self.dt_s);
        }
        cost
    }

    /// Makes one tick of a roll-out; the new places are the solver's. Returns the least gap,
    /// meters.
    fn tick(
        &self,
        given: &Given<'_, D>,
        solver: &mut Solver<D>,
        through: &mut Option<Through<D>>,
    ) -> f64 {
        if !solver.look(given, self.margin) {
            solver.points.clear();
            solver.points.extend_from_slice(given.chain.points());
            return f64::INFINITY;
        }
        if through.is_some_and(|through| is_behind(given, solver, &through)) {
            *through = None;
        }
        let (before_m, _) = solver.least_gap(given, given.chain.points());
        let wishes = Wishes { margin: self.margin, through: *through, rounds: ROUNDS };
        if solver.solve(given, &wishes) {
            let (gap_m, _) = solver.least_gap(given, &solver.points);
            if through.is_some() || gap_m >= before_m.min(0.0) {
                return gap_m;
            }
        }
        solver.points.clear();
        solver.points.extend_from_slice(given.chain.points());
        before_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rods::geometry::dot;

    #[test]
    fn ways_are_unit_vectors_that_differ() {
        fn check<const D: usize>(n: usize) {
            let mut up = [0.0; D];
            up[1] = 1.0;
            let mut velocity = [0.1; D];
            velocity[0] = 0.4;
            let all = directions(up, velocity);
            assert_eq!(all.len(), n);
            for (k, u) in all.iter().enumerate() {
                assert!((norm(*u) - 1.0).abs() < 1e-12);
                assert!(all[..k].iter().filter(|v| dot(**v, *u) > 1.0 - 1e-9).count() <= 1);
            }
        }
        check::<2>(3 + 11);
        check::<3>(3 + 22);
    }
}
