//! Metrics of each airplane and of each pair.

use super::Counters;
use crate::state::AirspaceState;
use crate::world::AirspaceWorld;
use serde::Serialize;
use sidestep_kernel::EntityId;
use sidestep_scenario::metrics;

metrics! {
    /// Metrics of one airplane.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct AirplaneMetrics {
        /// Its id.
        pub airplane: EntityId,
        /// Its call sign.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub callsign: Option<String>,
        /// From its appearance to its arrival. In seconds; for a recorded airplane from its handover to the method, and none
        /// while it flies.
        pub flown_s: Option<f64> => "flight",
        /// Time that the flight takes without others. In seconds; 0 where it flew its recorded track to the end, infinite
        /// where it would never end.
        pub alone_s: f64 => "flight alone",
        /// Time beyond that of the flight alone, in percent of it.
        pub delay_percent: Option<f64> => "delay",
        /// Path over the ground beyond that of the flight alone. In meters; none before the arrival.
        pub extra_distance_m: Option<f64> => "extra distance",
        /// The same, in percent of the path alone.
        pub extra_distance_percent: Option<f64> => "relative extra distance",
        /// Proxy of fuel beyond that of the flight alone, in percent of it.
        pub extra_fuel_percent: Option<f64> => "extra fuel (proxy)",
        /// Times that it began to turn away from its flight plan to one side; none where flights are not measured.
        pub maneuvers: Option<u32> => "maneuvers",
        /// Maneuvers that revoked one to the other side.
        pub maneuver_reversals: Option<u32> => "reversals of maneuvers",
        /// Number of times that the shield changed its wish.
        pub shield_overrides: u32,
        /// Number of those times when it fell back to its orbit.
        pub shield_orbits: u32,
        /// Whether it was removed before it had arrived.
        pub left: bool,
        /// Number of orders carried out.
        pub orders: u16,
        /// Number of times that an order had to wait for the next `dt`.
        pub orders_delayed: u16,
        /// Number of times that the shield held a change of level, for one `dt`.
        pub shield_level_offs: u32,
    }
}

metrics! {
    /// Metrics of two airplanes that came near each other.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct PairMetrics {
        /// All airplanes.
        pub airplanes: [EntityId; 2] => "airplanes",
        /// Their call signs.
        #[serde(skip_serializing_if = "Option::is_none")]
        pub callsigns: Option<[String; 2]>,
        /// Closest approach of the two. In meters.
        pub nearest_m: f64 => "closest approach",
        /// Times that they came nearer than their separation.
        pub losses: u32 => "losses of separation",
        /// Seconds that they spent nearer than their separation.
        pub lost_s: f64,
        /// Largest part of the separation that was lost, 0 to 1.
        pub severity: f64 => "severity",
    }
}

impl AirplaneMetrics {
    /// Returns the seconds beyond the flight alone; none where alone it would never end.
    pub(crate) fn delay_s(&self) -> Option<f64> {
        self.flown_s.map(|flown_s| flown_s - self.alone_s).filter(|delay_s| delay_s.is_finite())
    }
}

/// Returns the metrics of one airplane so far; without an arrival there is no flight time and no delay.
pub fn airplane_metrics(
    world: &AirspaceWorld,
    state: &AirspaceState,
    id: EntityId,
) -> AirplaneMetrics {
    let airplane = &state.airplanes[id as usize];
    let alone_s = world.alone_s[id as usize];
    let joined_s = world.cycle_start_s(world.first_controlled_cycle(id as usize));
    let arrived_s = airplane.arrived_step().map(|step| step as f64 * world.timing.dtau_s);
    let flown_s = arrived_s.map(|s| s - joined_s).filter(|_| !is_fully_replayed(world, id));
    let delay_percent = flown_s
        .filter(|_| alone_s > 0.0 && alone_s.is_finite())
        // One that avoids nobody is never delayed.
        .filter(|_| !world.airplanes[id as usize].is_non_cooperative)
        .map(|s| 100.0 * (s - alone_s) / alone_s);
    let level_offs = state.hold(id).map_or(0, |hold| hold.level_offs);
    let effort = state.effort(id);
    let alone = &world.alone_efforts[id as usize];
    let ended_effort = effort.filter(|_| delay_percent.is_some());
    AirplaneMetrics {
        airplane: id,
        callsign: world.callsign(id),
        flown_s,
        alone_s,
        delay_percent,
        extra_distance_m: ended_effort.map(|effort| effort.ground_m - alone.ground_m),
        extra_distance_percent: ended_effort
            .and_then(|effort| extra_percent(effort.ground_m, alone.ground_m)),
        extra_fuel_percent: ended_effort
            .and_then(|effort| extra_percent(effort.fuel_m, alone.fuel_m)),
        maneuvers: effort.map(|effort| effort.maneuvers),
        maneuver_reversals: effort.map(|effort| effort.reversals),
        shield_overrides: airplane.overrides.get(),
        shield_orbits: airplane.orbits.get(),
        left: airplane.has_left(),
        orders: world.airplanes[id as usize].whole_orders(airplane.orders.get()),
        orders_delayed: airplane.waits.get().saturating_sub(level_offs.min(u16::MAX.into()) as u16),
        shield_level_offs: level_offs,
    }
}

/// Returns by how many percent a cost is above that of the flight alone; `None` where that is nothing.
fn extra_percent(cost: f64, alone: f64) -> Option<f64> {
    (alone > 0.0).then(|| 100.0 * (cost - alone) / alone)
}

pub(super) fn is_fully_replayed(world: &AirspaceWorld, id: EntityId) -> bool {
    let joined_s = world.cycle_start_s(world.first_controlled_cycle(id as usize));
    let track = &world.airplanes[id as usize].track;
    track.as_ref().is_some_and(|track| track.end_s() <= joined_s)
}

/// Returns the metrics of all pairs that came near each other, by ids.
pub fn pair_metrics(world: &AirspaceWorld, counters: &Counters) -> Vec<PairMetrics> {
    let mut pairs = Vec::with_capacity(counters.pairs.len());
    for (&(a, b), record) in &counters.pairs {
        let separation_a_m = world.airplanes[a as usize].model.separation_m;
        let separation_b_m = world.airplanes[b as usize].model.separation_m;
        let separation_m = separation_a_m.max(separation_b_m);
        pairs.push(PairMetrics {
            airplanes: [a, b],
            callsigns: world.callsigns([a, b]),
            nearest_m: record.nearest_m,
            losses: record.losses,
            lost_s: record.lost_ns as f64 / 1e9,
            severity: (1.0 - record.nearest_m / separation_m).max(0.0),
        });
    }
    pairs
}
