//! A worker's buffers, kept between tasks, and the obstacles at a given moment.

use super::agents::sight::Shown;
use super::events::Event;
use super::formation::Solid;
use super::motion::escape::Escaper;
use super::notes::Notes;
use super::rods::geometry::{Point, in_dimensions};
use super::rods::obstacle::{Obstacle, Obstacles};
use super::rods::own_body::OwnBody;
use super::rods::propagate::Propagator;
use super::state::ChainState;
use super::swarm::laser::{Body as Seen, Scan};
use super::world::{ChainWorld, OTHER_CHAIN, push_parts};
use sidestep_kernel::{Cycle, Slot};

/// A worker's buffers, kept between tasks.
#[derive(Debug, Clone)]
pub struct Scratch<const D: usize> {
    pub(crate) propagator: Propagator<D>,
    pub(crate) escaper: Option<Escaper<D>>,
    /// The world's obstacles, the moving ones where they are at the start of `moment`, and the
    /// parts of other chains.
    pub(crate) obstacles: Obstacles<D>,
    /// The same without other chains, if there are any.
    solid: Obstacles<D>,
    moment: Option<Cycle>,
    /// Moving obstacles, and parts of other chains.
    guests: Vec<Obstacle<D>>,
    has_others: bool,
    /// Robots around a robot.
    pub(crate) seen: Vec<Seen>,
    /// Chains near a robot.
    pub(crate) near: Vec<Slot>,
    pub(crate) scan: Scan,
    /// Boxes around a chain's rods.
    pub(crate) own: OwnBody<D>,
    /// Positions before a cycle.
    pub(crate) before: Vec<Point<D>>,
    /// Joint values of an arm before a cycle,
    pub(crate) joints_before: Vec<f64>,
    /// and after it got out of the way.
    pub(crate) joints_escaped: Vec<f64>,
    /// Least gap around a robot in this cycle, meters.
    pub(crate) robots_gap_m: f64,
    /// Positions after parts got out of the way.
    pub(crate) escaped: Vec<Point<D>>,
    /// Events of this task.
    pub(crate) events: Vec<Event>,
    /// Notes for an inspection of a chain; none in a run.
    pub(crate) notes: Option<Box<Notes<D>>>,
    /// Perceptions of connectors, for a caller that asks; none in a run.
    pub(crate) shown: Option<Vec<Shown<D>>>,
}

impl<const D: usize> Scratch<D> {
    /// Returns a scratch that has gathered nothing yet.
    pub(crate) fn new(world: &ChainWorld<D>) -> Self {
        Self {
            propagator: Propagator::new(world.rules),
            escaper: world.escape.map(Escaper::new),
            obstacles: (*world.obstacles).clone(),
            solid: (*world.obstacles).clone(),
            moment: None,
            guests: Vec::new(),
            has_others: false,
            seen: Vec::new(),
            near: Vec::new(),
            scan: Scan::default(),
            own: OwnBody::default(),
            before: Vec::new(),
            joints_before: Vec::new(),
            joints_escaped: Vec::new(),
            robots_gap_m: f64::INFINITY,
            escaped: Vec::new(),
            events: Vec::new(),
            notes: None,
            shown: None,
        }
    }

    /// Puts moving obstacles where they are at the start of cycle `moment`, and other chains where
    /// they are now.
    pub(crate) fn gather(
        &mut self,
        world: &ChainWorld<D>,
        state: &ChainState<D>,
        moment: Cycle,
        others: impl Iterator<Item = Slot>,
    ) {
        const CHECKED: &str = "movers and chains were checked when the scenario was compiled";
        let mut others = others.peekable();
        let has_others = others.peek().is_some();
        if self.moment == Some(moment) && !self.has_others && !has_others {
            return;
        }
        self.guests.clear();
        let movers = world.movers.at(world.starts_s(moment));
        self.guests.extend(movers.filter(Obstacle::is_in_range));
        let movers = self.guests.len();
        let others: Vec<Slot> = others.collect();
        if has_others {
            others.iter().for_each(|&slot| push_robots(&mut self.guests, slot, state));
            self.solid.set_moving(&self.guests).expect(CHECKED);
            self.guests.truncate(movers);
        }
        for slot in others {
            push_parts(&mut self.guests, slot, &state.body(slot as usize).chain);
        }
        self.obstacles.set_moving(&self.guests).expect(CHECKED);
        (self.moment, self.has_others) = (Some(moment), has_others);
    }

    /// Returns the obstacles that are solid to robots: of other chains the robots, not the rods.
    pub(crate) fn solid(&self) -> &Obstacles<D> {
        if self.has_others { &self.solid } else { &self.obstacles }
    }
}

/// Adds the parts of a chain that robots can touch: its robots, or its connectors and rods if it
/// has none.
fn push_robots<const D: usize>(parts: &mut Vec<Obstacle<D>>, slot: Slot, state: &ChainState<D>) {
    let body = state.body(slot as usize);
    if body.robots.is_empty() {
        return push_parts(parts, slot, &body.chain);
    }
    let solid =
        |solid: Solid| Obstacle::ball(OTHER_CHAIN + slot, in_dimensions(solid.at), solid.radius_m);
    parts.extend(body.solids().map(|(_, robot)| solid(robot)));
}
