//! Checks that chains have their places to themselves at the start.

use super::super::metrics::PENETRATION_THRESHOLD_M;
use super::super::world::{ChainSpec, OTHER_CHAIN, push_part_obstacles};
use super::obstacles::ScenarioObstacles;
use super::{ChainScenarioCompiler, MIN_REACH_M};
use sidestep_kernel::{EntitySlot, InputError};
use sidestep_rods::geometry::Aabb;
use sidestep_rods::{Chain, Obstacle, Obstacles, RodBvh, nearest_own_parts};
use std::ops::Range;

/// A part of a chain that is inside a solid.
#[derive(Debug, Clone, Copy)]
struct StartOverlap {
    /// The part's connector; for a rod the one before it.
    connector: usize,
    id: u32,
    depth_m: f64,
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Refuses chains that start in obstacles, in each other, or in themselves, because every motion out of there
    /// would pass through a solid.
    pub(super) fn check_starts(
        &self,
        chains: &[ChainSpec<D>],
        ground: &ScenarioObstacles<D>,
    ) -> Result<(), InputError> {
        if self.file.chain.may_start_inside {
            return Ok(());
        }
        let mut obstacles = ground.obstacles.clone();
        let moving: Vec<_> = ground.movers.at(0.0).filter(Obstacle::is_in_range).collect();
        obstacles.replace_moving(&moving)?;
        for (slot, spec) in chains.iter().enumerate() {
            if let Some(inside) = deepest_part(spec, &obstacles, None) {
                return Err(self.start_overlap_error(
                    slot,
                    inside,
                    &format!("obstacle {}", inside.id),
                ));
            }
        }
        self.check_own_bodies(chains)?;
        if chains.len() < 2 {
            return Ok(());
        }
        // All chains are obstacles to all, each apart from its own parts, so that the grid of obstacles is built once.
        let mut parts = Vec::new();
        for (slot, spec) in (0..).zip(chains) {
            push_part_obstacles(&mut parts, slot, spec, spec.start_parts());
        }
        let rods = chains.iter().flat_map(|spec| spec.start.rods());
        let longest_m = rods.map(|rod| rod.max_m).fold(MIN_REACH_M, f64::max);
        let parts = Obstacles::new(parts, longest_m)?;
        for (slot, spec) in chains.iter().enumerate() {
            let own = OTHER_CHAIN + slot as EntitySlot;
            if let Some(inside) = deepest_part(spec, &parts, Some(own)) {
                let other = format!("chain {}", inside.id - OTHER_CHAIN);
                return Err(self.start_overlap_error(slot, inside, &other));
            }
        }
        Ok(())
    }

    /// Refuses chains whose own parts overlap at the start. The links of an arm only look like rods, so an arm is told
    /// of it in the remarks.
    fn check_own_bodies(&self, chains: &[ChainSpec<D>]) -> Result<(), InputError> {
        if self.file.chain.self_collision == Some(false) {
            return Ok(());
        }
        let mut tree = RodBvh::default();
        for (slot, spec) in chains.iter().enumerate().filter(|(_, spec)| spec.arm.is_none()) {
            if let Some(words) = own_overlap_text(&spec.start, &mut tree) {
                let remedy = "move them apart or make them thinner, or set chain.self_collision = false, or \
                              chain.may_start_inside = true";
                let cause = format!("chain {slot} {words}");
                return Err(self.source.error(self.section_span(slot), cause, remedy));
            }
        }
        Ok(())
    }

    fn start_overlap_error(&self, slot: usize, inside: StartOverlap, what: &str) -> InputError {
        let StartOverlap { connector, depth_m, .. } = inside;
        let cause = format!(
            "chain {slot} begins {depth_m:.3e} m deep in {what}, with connector {connector} or \
             the rod behind it"
        );
        let remedy = "move one of them, or set chain.may_start_inside = true";
        self.source.error(self.section_span(slot), cause, remedy)
    }

    /// Returns the place of the section that a chain comes from.
    pub(super) fn section_span(&self, slot: usize) -> Option<Range<usize>> {
        let sections = self.file.chains.0.iter();
        let mut spans = sections.flat_map(|s| std::iter::repeat_n(s.span(), s.get_ref().count));
        spans.nth(slot)
    }
}

/// Returns which two parts of a chain overlap most at the start, and how deep; none if none do.
pub(crate) fn own_overlap_text<const D: usize>(
    chain: &Chain<D>,
    tree: &mut RodBvh<D>,
) -> Option<String> {
    let nearest = nearest_own_parts(chain, tree, -PENETRATION_THRESHOLD_M)?;
    let [one, other] = nearest.parts;
    Some(format!("begins with its {one} {:.3e} m deep in its {other}", -nearest.gap_m))
}

/// Returns the part of a chain that is deepest in anything not called `own` at the start: of an arm with shapes a link.
fn deepest_part<const D: usize>(
    spec: &ChainSpec<D>,
    obstacles: &Obstacles<D>,
    own: Option<u32>,
) -> Option<StartOverlap> {
    let arm = spec.arm.as_deref();
    let Some((arm, body)) = arm.and_then(|arm| Some((arm, arm.body.as_ref()?))) else {
        return deepest(&spec.start, obstacles, own);
    };
    let contacts = body.contacts(arm.posture(&arm.values), obstacles, false);
    let inside = contacts.into_iter().filter_map(|contact| {
        let connector = arm.connector_of_link(contact.link);
        Some(StartOverlap { connector, id: contact.obstacle?, depth_m: contact.depth_m })
    });
    let others = inside.filter(|inside| own != Some(inside.id));
    let deep = others.filter(|inside| inside.depth_m > PENETRATION_THRESHOLD_M);
    // Of equal depths that of the least id, as contacts come in the order in which obstacles are stored.
    deep.min_by(|a, b| b.depth_m.total_cmp(&a.depth_m).then(a.id.cmp(&b.id)))
}

/// Returns the part of a chain that is deepest in anything not called `own`.
fn deepest<const D: usize>(
    chain: &Chain<D>,
    obstacles: &Obstacles<D>,
    own: Option<u32>,
) -> Option<StartOverlap> {
    let points = chain.points();
    let mut deepest: Option<StartOverlap> = None;
    for connector in 0..points.len() {
        let end = (connector + 1).min(points.len() - 1);
        let radius_m = chain.connectors()[connector].radius_m;
        let rod_radius_m = chain.rods().get(connector).map_or(0.0, |rod| rod.radius_m);
        let near =
            Aabb::from_points(&[points[connector], points[end]]).grown(radius_m.max(rod_radius_m));
        obstacles.visit(&near, |o| {
            let ball_m = o.core.nearest_to_point(points[connector]).distance_m - radius_m;
            let rod_m = o.core.nearest_to_segment([points[connector], points[end]]).distance_m;
            let depth_m = o.radius_m - ball_m.min(rod_m - rod_radius_m);
            let most_m = deepest.map_or(PENETRATION_THRESHOLD_M, |inside| inside.depth_m);
            if depth_m > most_m && own != Some(o.id) {
                deepest = Some(StartOverlap { connector, id: o.id, depth_m });
            }
        });
    }
    deepest
}
