//! Orders: what airplanes are told on their way, and when they may be carried out.
//!
//! An order to head somewhere or to follow way-points changes only what an airplane wants, so
//! it is carried out at once. A new speed changes the orbit that it has stored as its fallback,
//! and a new level those whom it has to mind: with the shield, such an order is carried out only
//! when the airplane then has a fallback apart from all stored ones, so that the invariant
//! holds; else it waits for the next `dt`, and those after it wait with it.
//!
//! While it changes its level, an airplane occupies the old one, the new one and all between.

use super::airplane::{Model, Point};
use super::levels::Levels;
use super::shield::{Flyer, Side, side_apart};
use super::state::{AirspaceState, Cell};
use super::world::{Airplane, AirspaceWorld};
use sidestep_kernel::math;
use sidestep_kernel::{Cycle, Slot};

/// Most orders for one airplane.
pub const MAX_ORDERS: usize = 10_000;
/// Where an airplane that keeps a heading steers for: so far ahead that the bearing is the
/// heading wherever it is.
const FAR_AHEAD_M: f64 = 1e12;

/// An order and its time.
#[derive(Debug, Clone, PartialEq)]
pub struct FlightOrder {
    /// When it is given, seconds after the start.
    pub at_s: f64,
    /// What is to be done.
    pub task: Task,
}

/// What an airplane is told to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Task {
    /// Keep a heading, radians counter-clockwise from east, until sent to a way-point again.
    Heading(f64),
    /// Fly with this airspeed, m/s.
    Speed(f64),
    /// Change to another level.
    Altitude {
        /// The new level.
        altitude_m: f64,
        /// How fast to climb or descend.
        climb_m_s: f64,
    },
    /// Go on to the next way-point.
    Proceed,
    /// Follow these way-points instead.
    WayPoints(Vec<Point>),
}

/// What an airplane flies between two orders.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stage<'a> {
    pub(super) model: &'a Model,
    pub(super) mission: &'a [Point],
    /// The level it keeps or changes to,
    pub(super) altitude_m: f64,
    /// and how fast.
    pub(super) climb_m_s: f64,
}

/// What an airplane flies from an order on.
#[derive(Debug, Clone)]
pub(super) struct Later {
    model: Model,
    mission: Vec<Point>,
    altitude_m: f64,
    climb_m_s: f64,
    /// Way-points done with when this begins, if not as many as before.
    next: Option<u32>,
}

impl Later {
    fn stage(&self) -> Stage<'_> {
        let Self { model, mission, altitude_m, climb_m_s, .. } = self;
        Stage { model, mission, altitude_m: *altitude_m, climb_m_s: *climb_m_s }
    }
}

/// What an airplane flies after each of its orders.
pub(super) fn later(airplane: &Airplane) -> Vec<Later> {
    let mut route = airplane.mission.clone();
    let mut now = Later {
        model: airplane.model.clone(),
        mission: route.clone(),
        altitude_m: airplane.altitude_m,
        climb_m_s: 0.0,
        next: None,
    };
    let mut all = Vec::with_capacity(airplane.orders.len());
    for order in &airplane.orders {
        now.next = None;
        match &order.task {
            Task::Heading(psi_rad) => {
                let ahead = [FAR_AHEAD_M * math::cos(*psi_rad), FAR_AHEAD_M * math::sin(*psi_rad)];
                // As many as on the route, so that the number of those done with still holds.
                now.mission = vec![ahead; route.len()];
            }
            Task::Speed(v_m_s) => now.model.v_m_s = *v_m_s,
            Task::Altitude { altitude_m, climb_m_s } => {
                (now.altitude_m, now.climb_m_s) = (*altitude_m, *climb_m_s);
            }
            Task::Proceed => now.mission.clone_from(&route),
            Task::WayPoints(way_points) => {
                route.clone_from(way_points);
                now.mission.clone_from(way_points);
                now.next = Some(0);
            }
        }
        all.push(now.clone());
    }
    all
}

impl Airplane {
    /// Whether its last order about where to fly leads to no way-point.
    pub(super) fn keeps_a_heading(&self) -> bool {
        let is_about_the_way = |order: &&FlightOrder| {
            matches!(order.task, Task::Heading(_) | Task::Proceed | Task::WayPoints(_))
        };
        let last = self.orders.iter().rev().find(is_about_the_way);
        last.is_some_and(|order| matches!(order.task, Task::Heading(_)))
    }

    /// The order after the first `done` ones, if its time has come.
    fn due(&self, done: usize, now_s: f64) -> Option<&FlightOrder> {
        self.orders.get(done).filter(|order| order.at_s <= now_s)
    }
}

impl AirspaceWorld {
    /// What an airplane flies that has carried out so many orders.
    pub(super) fn stage(&self, slot: Slot, orders: u32) -> Stage<'_> {
        match self.later[slot as usize].get((orders as usize).wrapping_sub(1)) {
            Some(later) => later.stage(),
            None => {
                let Airplane { model, mission, altitude_m, .. } = &self.airplanes[slot as usize];
                Stage { model, mission, altitude_m: *altitude_m, climb_m_s: 0.0 }
            }
        }
    }

    /// What an airplane flies now.
    pub(super) fn stage_now(&self, state: &AirspaceState, slot: Slot) -> Stage<'_> {
        self.stage(slot, state.airplanes[slot as usize].orders.get().into())
    }

    /// Orders done and way-points done with after those that are due at a time, if none waits.
    pub(super) fn after_orders(
        &self,
        slot: usize,
        orders: u32,
        next: usize,
        now_s: f64,
    ) -> (u32, usize) {
        let (mut orders, mut next) = (orders, next);
        while self.airplanes[slot].due(orders as usize, now_s).is_some() {
            next = self.later[slot][orders as usize].next.map_or(next, |next| next as usize);
            orders += 1;
        }
        (orders, next)
    }

    /// All levels that an airplane is on, or is told to go to by now.
    pub(super) fn claimed_levels(&self, cell: &Cell, slot: Slot, now: Cycle) -> Levels {
        let done = cell.orders.get();
        let mut levels =
            Levels::between(cell.altitude_m.get(), self.stage(slot, done.into()).altitude_m);
        let orders = &self.airplanes[slot as usize].orders;
        let due = orders.iter().skip(done.into()).take_while(|o| o.at_s <= self.starts_s(now));
        for order in due {
            if let Task::Altitude { altitude_m, .. } = order.task {
                levels = levels.with(altitude_m);
            }
        }
        levels
    }

    /// Carries out the orders of a group that are due and, with the shield, may be; the others
    /// wait. `flown` are the group's airplanes that the method flies, by id.
    pub(super) fn carry_out(&self, state: &AirspaceState, now: Cycle, flown: &[Slot]) {
        for &slot in flown {
            let (airplane, cell) =
                (&self.airplanes[slot as usize], &state.airplanes[slot as usize]);
            while let Some(order) = airplane.due(cell.orders.get().into(), self.starts_s(now)) {
                let Some(side) = self.fallback_after(state, flown, slot, order) else {
                    cell.waits.set(cell.waits.get().saturating_add(1));
                    break;
                };
                let later = &self.later[slot as usize][usize::from(cell.orders.get())];
                cell.orders.set(cell.orders.get() + 1);
                cell.next.set(later.next.unwrap_or(cell.next.get()));
                cell.set_side(side);
            }
        }
    }

    /// The fallback that an airplane has when it carries out its next order, if it may.
    fn fallback_after(
        &self,
        state: &AirspaceState,
        flown: &[Slot],
        slot: Slot,
        order: &FlightOrder,
    ) -> Option<Side> {
        let cell = &state.airplanes[slot as usize];
        let changes_safety = matches!(order.task, Task::Speed(_) | Task::Altitude { .. });
        if !self.shield || !changes_safety {
            return Some(cell.side());
        }
        let stage = self.stage(slot, u32::from(cell.orders.get()) + 1);
        let now = self.flyer(state, slot);
        let changed = Flyer {
            v_m_s: stage.model.v_m_s,
            levels: Levels::between(cell.altitude_m.get(), stage.altitude_m),
            ..now
        };
        let others = flown.iter().filter(|&&other| other != slot);
        side_apart(&now, &changed, others.map(|&other| self.flyer(state, other)))
    }
}
