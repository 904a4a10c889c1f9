//! The metrics of a run.

mod counters;
mod exemptions;
mod flights;
#[cfg(test)]
mod tests;

pub use counters::{AreaRecord, Counters};
pub use exemptions::{AreaExemption, ErrorBoundViolation, UnprotectedPair};
pub use flights::{AirplaneMetrics, PairMetrics, airplane_metrics, pair_metrics};

use super::decide::OptimizationStats;
use super::events::EventKind;
use super::flight::FlightPhase;
use super::state::{AirplaneState, AirspaceState};
use super::surveillance::ObservationCounts;
use super::world::AirspaceWorld;
use exemptions::{area_exemptions, error_bound_violations, unprotected_pairs};
use flights::is_fully_replayed;
use serde::Serialize;
use sidestep_kernel::{Cycle, EntityId};
use sidestep_scenario::metrics;

metrics! {
    /// Metrics of a run.
    #[derive(Debug, Clone, PartialEq, Serialize)]
    pub struct Metrics {
        /// Closest approach of any two; none if no two came near each other. In meters.
        pub min_separation_m: Option<f64> => "closest approach",
        /// Times that two came nearer than their separation.
        pub losses_of_separation: u64 => "losses of separation",
        /// Losses of pairs that the shield had reported, because it promises nothing for them. These are the pairs in
        /// `too_close`, and those of the airplanes in `beyond_bound`.
        pub losses_of_reported_pairs: u64 => "losses of reported pairs",
        /// Losses of all other pairs, for which the shield promises that there are none. Without a shield these are all.
        pub losses_of_unreported_pairs: u64 => "losses of unreported pairs",
        /// Losses of recorded flights of which at least one climbed. By the record at that time, or at the handover to the
        /// method; none where fewer than two are recorded. Rows on the ground are no traffic.
        pub losses_in_climb: Option<u64> => "losses in climb",
        /// Losses of recorded flights of which one descended and none climbed.
        pub losses_in_descent: Option<u64> => "losses in descent",
        /// Losses of recorded flights that both kept their levels.
        pub losses_in_cruise: Option<u64> => "losses in cruise",
        /// Time that pairs spent nearer than their separation. In seconds.
        pub lost_s: f64 => "time with separation lost",
        /// Times that an airplane came to where an area does not permit it to be; none without areas.
        pub area_entries: Option<u64> => "entries of areas",
        /// Entries of airplanes that the shield had reported, because it does not keep them clear of the area. These are
        /// those in `exempt_areas`, those of airplanes in `beyond_bound`, and non-cooperative ones.
        pub area_entries_reported: Option<u64> => "reported entries of areas",
        /// All other entries, of which the shield promises that there are none. Without a shield these are all.
        pub area_entries_unreported: Option<u64> => "unreported entries of areas",
        /// Time that airplanes spent where areas do not permit them to be. In seconds; none without areas.
        pub area_s: Option<f64> => "time in areas",
        /// Conflicts: times that a loss was predicted within the look-ahead, if both fly straight on with their present
        /// velocities. A loss that was not predicted counts as a conflict too; none where pairs are not measured.
        pub conflicts: Option<u64> => "conflicts",
        /// Conflicts in which separation was lost.
        pub intrusions: Option<u64> => "intrusions",
        /// Fraction of conflicts in which separation was not lost (IPR), 0 to 1; none without a conflict.
        pub intrusion_prevention_rate: Option<f64> => "intrusion prevention rate",
        /// Mean severity of intrusions: the largest share of the separation that was lost, of the horizontal or vertical part
        /// of which less was lost, 0 to 1; none without an intrusion.
        pub mean_los_severity: Option<f64> => "mean severity of losses of separation",
        /// Largest severity of an intrusion.
        pub max_los_severity: Option<f64> => "largest severity of a loss of separation",
        /// Times that two were not well clear of each other, by the volume of `airspace.well_clear`.
        pub well_clear_violations: Option<u64> => "violations of well clear",
        /// Near mid-air collisions: times that two came nearer than `airspace.nmac`.
        pub nmacs: Option<u64> => "near mid-air collisions",
        /// Airplanes that have reached their last way-point.
        pub arrived: u64 => "airplanes arrived",
        /// All airplanes.
        pub airplanes: u64 => "airplanes",
        /// Mean, over those that have arrived, of the time beyond that of the flight alone, in percent of it. Airplanes
        /// that would never arrive alone are left out.
        pub mean_delay_percent: Option<f64> => "mean delay",
        /// The same mean, over recorded flights that climbed at their handover to the method. It flies them on the level that
        /// they had there.
        pub climb_delay_percent: Option<f64> => "mean delay of flights in climb",
        /// The same mean, over recorded flights that descended at their handover.
        pub descent_delay_percent: Option<f64> => "mean delay of flights in descent",
        /// The same mean, over recorded flights that kept their level at their handover.
        pub cruise_delay_percent: Option<f64> => "mean delay of flights in cruise",
        /// Mean, over those with a delay, of the time beyond that of the flight alone. In seconds.
        pub mean_extra_time_s: Option<f64> => "mean extra time",
        /// Mean, over the same, of the path over the ground beyond that of the flight alone. In meters; none where flights are
        /// not measured.
        pub mean_extra_distance_m: Option<f64> => "mean extra distance",
        /// The same mean, in percent of the path alone.
        pub mean_extra_distance_percent: Option<f64> => "mean relative extra distance",
        /// Mean, over the same, of the proxy of fuel beyond that of the flight alone, in percent of it. It is the work against
        /// drag and gravity at a constant weight, and no fuel of any engine.
        pub mean_extra_fuel_percent: Option<f64> => "mean extra fuel (proxy)",
        /// Maneuvers: times that an airplane began to turn away from its flight plan to one side.
        pub maneuvers: Option<u64> => "maneuvers",
        /// Maneuvers that revoked one to the other side, without a step on the flight plan between them.
        pub maneuver_reversals: Option<u64> => "reversals of maneuvers",
        /// Maneuvers in an hour of flight, of all flights that a method flew.
        pub maneuvers_per_flight_hour: Option<f64> => "maneuvers per flight hour",
        /// Airplanes still in the air when the run ended, without a delay. The mean delay is too low where late ones are among
        /// them.
        pub in_flight: u64 => "airplanes still in the air",
        /// Messages between agents (one per receiver), or migrations of a coordinator; 0 where one process decides.
        pub messages: u64 => "messages",
        /// Bytes of these messages.
        pub bytes: u64 => "size of all messages" ("bytes"),
        /// Messages, if one could reach all of a group.
        pub multicasts: u64 => "messages with multicast",
        /// Bytes, if one message could reach all of a group.
        pub multicast_bytes: u64 => "size of all messages with multicast",
        /// Messages by which airplanes find their groups, beside all others; none where groups are announced.
        pub beacons: u64 => "beacons",
        /// Bytes of those messages.
        pub beacon_bytes: u64 => "size of all beacons",
        /// Messages by which airplanes find their groups, if one could reach all near.
        pub beacon_multicasts: u64 => "beacons with multicast",
        /// Bytes, if one such message could reach all near.
        pub beacon_multicast_bytes: u64 => "size of all beacons with multicast",
        /// Messages that waited because of the radio's budget, until earlier ones of their sender were sent; each counts once.
        pub budget_deferred: u64 => "messages deferred by the radio's budget",
        /// Messages not sent, because the radio's budget would have carried them too late; each counts once.
        pub budget_dropped: u64 => "messages dropped by the radio's budget",
        /// Simulated time that all talks took; none where one process decides or messages take no time. In seconds, of one
        /// talk after the other.
        pub network_s: Option<f64> => "time on the network",
        /// Optimizations run.
        pub optimizations: u64 => "optimizations",
        /// Mean number of their rounds.
        pub rounds_mean: Option<f64> => "mean rounds of an optimization",
        /// Optimizations whose rounds ran out.
        pub unconverged: u64 => "optimizations without convergence",
        /// Optimizations whose cost is at its lower bound, so that no joint action costs less.
        pub proved_minima: u64 => "optimizations proved to be a minimum",
        /// Optimizations of which the true minimum was computed, in groups of up to `minimum_up_to` airplanes.
        pub known_minima: u64 => "optimizations with a known minimum",
        /// Those of them that have reached it.
        pub reached_minima: u64 => "known minima reached",
        /// Processor time spent deciding, all workers together; measured, so it differs from run to run. In seconds, of the
        /// run of this process.
        pub optimize_cpu_s: f64 => "time spent deciding",
        /// Times that the shield changed a wish.
        pub shield_overrides: u64 => "wishes changed by the shield",
        /// Wishes changed by the shield for the stored fallback, for one `dt`.
        pub shield_orbits: u64 => "times on the stored fallback",
        /// Times that the shield held a change of level, for one `dt`.
        pub shield_level_offs: u64 => "times held on the way to a level",
        /// Holds by the shield, on a fallback or on the way to a level, of an airplane below `airspace.safe_altitude_m`; none
        /// without that.
        pub low_holds: Option<u64> => "holds below the safe altitude",
        /// Airplanes that were in the air for longer than their endurance; none where that is given for none.
        pub endurance_exceedances: Option<u64> => "airplanes beyond their endurance",
        /// Wishes changed because not all others had agreed in time.
        pub shield_held_back: u64 => "wishes held back for lack of agreement",
        /// Times that the shield did not clear a level or a speed that a method commands: the airplane kept its speed for one
        /// `dt`, or leveled off short of a level; none where methods command neither.
        pub commands_held: Option<u64> => "levels and speeds held by the shield",
        /// Fraction of observations in which the observer had a track, 0 to 1; none without `airspace.surveillance`. An
        /// observation is of another airplane near an observer in a cycle, if that one does not tell where it is.
        pub track_availability: Option<f64> => "availability of tracks",
        /// Mean age of these tracks: the time since the last report. In seconds.
        pub mean_track_age_s: Option<f64> => "mean age of tracks",
        /// Times that an airplane dropped its track of another one, of which it received no reports, or would have had one to
        /// drop if the other had been near in the cycle before; none without `airspace.surveillance`.
        pub tracks_dropped: Option<u64> => "tracks dropped",
        /// Times that an airplane lost contact with another one.
        pub contacts_lost: u64 => "contacts lost",
        /// Times that an agent ran out of time.
        pub deadlines_missed: u64 => "deadlines missed",
        /// Times that a group was too large to be optimized.
        pub groups_too_large: u64 => "groups too large to optimize",
        /// Airplanes that had not appeared yet when the run ended.
        pub not_appeared: u64 => "airplanes that have not appeared",
        /// Airplanes removed before they had arrived.
        pub left: u64 => "airplanes removed",
        /// Airplanes that flew their recorded track to its end. Nothing changed it.
        pub replayed: u64 => "airplanes replayed to the end",
        /// Orders carried out.
        pub orders: u64 => "orders carried out",
        /// Times that an order waited for the next `dt`. It waits while no orbit is apart from those of others.
        pub orders_delayed: u64 => "orders delayed",
        /// Pairs that came in too close as far as was searched: the search for fallbacks that keep all apart has come to its
        /// limit. Of all others in `too_close` it is certain that there are none.
        pub unproved_pairs: u64 => "pairs too close without a proof",
        /// Pairs for which the shield promises nothing, and since when.
        pub too_close: Vec<UnprotectedPair> => "pairs without a promise",
        /// Airplanes that the shield does not keep clear of an area, and since when.
        pub exempt_areas: Vec<AreaExemption> => "exemptions from areas",
        /// Airplanes whose errors exceeded the bounds, and since when. The shield promises nothing for their pairs.
        pub beyond_bound: Vec<ErrorBoundViolation> => "airplanes beyond their bounds",
    }
}

fn count_airplanes_where(state: &AirspaceState, is: impl Fn(&AirplaneState) -> bool) -> u64 {
    state.airplanes.iter().filter(|airplane| is(airplane)).count() as u64
}

/// Returns the number of airplanes that have flown their recorded way to its end.
fn replayed_count(world: &AirspaceWorld, state: &AirspaceState) -> u64 {
    let all = (0..).zip(&state.airplanes);
    let ended = all.filter(|(_, airplane)| airplane.arrived_step().is_some());
    ended.filter(|(id, _)| is_fully_replayed(world, *id)).count() as u64
}

/// Returns the number of losses of pairs that the shield reported, and of those of all others.
fn losses_by_report(counters: &Counters) -> [u64; 2] {
    let mut losses = [0, 0];
    for ((a, b), record) in &counters.pairs {
        losses[usize::from(!counters.is_reported([*a, *b]))] += u64::from(record.losses);
    }
    losses
}

/// Returns the number of entries of areas that the shield reported, and of all others.
fn area_entries_by_report(world: &AirspaceWorld, counters: &Counters) -> [u64; 2] {
    let mut entries = [0, 0];
    for (key, record) in &counters.areas {
        let airplane = &world.airplanes[key.0 as usize];
        let is_reported = counters.exempt_areas.contains_key(key)
            || counters.beyond_bound.contains_key(&key.0)
            || airplane.is_non_cooperative
            || airplane.track.is_some();
        // One that came in between two steps was not seen to.
        entries[usize::from(!is_reported)] += u64::from(record.entries.max(1));
    }
    entries
}

/// Returns the losses of recorded flights in a phase; none where no two are recorded.
fn losses_in_phase(world: &AirspaceWorld, counters: &Counters, phase: FlightPhase) -> Option<u64> {
    let recorded = world.airplanes.iter().filter(|airplane| airplane.track.is_some());
    let losses = counters.losses_by_phase.get(&phase).copied().unwrap_or(0);
    (recorded.take(2).count() == 2).then_some(losses)
}

/// Returns the mean delay, in percent, of recorded flights that were in a phase at their handover to the method.
fn delay_in_phase(
    world: &AirspaceWorld,
    all: &[AirplaneMetrics],
    phase: FlightPhase,
) -> Option<f64> {
    let is_in_phase =
        |one: &&AirplaneMetrics| world.flight_phase(one.airplane, f64::INFINITY) == Some(phase);
    let delays: Vec<f64> =
        all.iter().filter(is_in_phase).filter_map(|one| one.delay_percent).collect();
    mean(delays.iter().sum(), delays.len())
}

/// Returns the mean of a metric over the airplanes that have it.
fn mean_over(
    all: &[AirplaneMetrics],
    metric: impl Fn(&AirplaneMetrics) -> Option<f64>,
) -> Option<f64> {
    let values: Vec<f64> = all.iter().filter_map(metric).collect();
    mean(values.iter().sum(), values.len())
}

/// Returns the maneuvers in an hour of flight; `None` where nothing was flown or measured.
fn maneuvers_per_flight_hour(state: &AirspaceState) -> Option<f64> {
    let mut maneuvers: u64 = 0;
    let mut flown_s = 0.0;
    for id in 0..state.airplanes.len() as EntityId {
        let effort = state.effort(id)?;
        maneuvers += u64::from(effort.maneuvers);
        flown_s += effort.flown_s;
    }
    (flown_s > 0.0).then(|| maneuvers as f64 * 3600.0 / flown_s)
}

fn mean(sum: f64, n: usize) -> Option<f64> {
    (n > 0).then(|| sum / n as f64)
}

/// Returns the number of airplanes that were not in the air before a cycle, because they come in later.
fn not_appeared_count(world: &AirspaceWorld, now: Cycle) -> u64 {
    // At the very start, the airplanes that start with the run are there.
    let cycle = now.max(1);
    (0..world.airplanes.len()).filter(|&i| world.appearance_cycle(i) >= cycle).count() as u64
}

/// Returns the metrics of a run until a cycle; `decide_s` is the time spent deciding, in seconds.
pub(crate) fn metrics(
    world: &AirspaceWorld,
    state: &AirspaceState,
    now: Cycle,
    counters: &Counters,
    decide_s: f64,
) -> Metrics {
    let all = (0..world.airplanes.len() as EntityId).map(|id| airplane_metrics(world, state, id));
    let all: Vec<AirplaneMetrics> = all.collect();
    let delays: Vec<f64> = all.iter().filter_map(|a| a.delay_percent).collect();
    let OptimizationStats {
        optimizations,
        rounds,
        unconverged,
        proved_minima,
        known_minima,
        reached_minima,
        traffic,
        beacons,
    } = counters.effort;
    let [losses_of_reported_pairs, losses_of_unreported_pairs] = losses_by_report(counters);
    let [area_entries_reported, area_entries_unreported] = area_entries_by_report(world, counters);
    let beside_areas = |entries: u64| (!world.areas.is_empty()).then_some(entries);
    let losses_in = |phase| losses_in_phase(world, counters, phase);
    let delay_in = |phase| delay_in_phase(world, &all, phase);
    let encounters = world.measures.pairs.map(|_| counters.encounters.counts());
    let sum_of = |count: fn(&AirplaneMetrics) -> Option<u32>| {
        world.measures.flights.map(|_| all.iter().filter_map(count).map(u64::from).sum())
    };
    let not_appeared = not_appeared_count(world, now);
    let unfinished = count_airplanes_where(state, AirplaneState::is_unfinished);
    Metrics {
        min_separation_m: counters.pairs.values().map(|r| r.nearest_m).min_by(f64::total_cmp),
        losses_of_separation: counters.pairs.values().map(|r| u64::from(r.losses)).sum(),
        losses_of_reported_pairs,
        losses_of_unreported_pairs,
        losses_in_climb: losses_in(FlightPhase::Climb),
        losses_in_descent: losses_in(FlightPhase::Descent),
        losses_in_cruise: losses_in(FlightPhase::Cruise),
        lost_s: counters.pairs.values().map(|r| r.lost_ns).sum::<u64>() as f64 / 1e9,
        area_entries: beside_areas(area_entries_reported + area_entries_unreported),
        area_entries_reported: beside_areas(area_entries_reported),
        area_entries_unreported: beside_areas(area_entries_unreported),
        area_s: (!world.areas.is_empty())
            .then(|| counters.areas.values().map(|r| r.inside_ns).sum::<u64>() as f64 / 1e9),
        conflicts: encounters.map(|counts| counts.conflicts),
        intrusions: encounters.map(|counts| counts.intrusions),
        intrusion_prevention_rate: encounters.and_then(|counts| counts.intrusion_prevention_rate()),
        mean_los_severity: encounters.and_then(|counts| counts.mean_severity()),
        max_los_severity: encounters
            .filter(|counts| counts.intrusions > 0)
            .map(|counts| counts.max_severity),
        well_clear_violations: encounters.map(|counts| counts.well_clear_violations),
        nmacs: encounters.map(|counts| counts.nmacs),
        arrived: count_airplanes_where(state, |airplane| airplane.arrived_step().is_some()),
        airplanes: all.len() as u64,
        mean_delay_percent: mean(delays.iter().sum(), delays.len()),
        climb_delay_percent: delay_in(FlightPhase::Climb),
        descent_delay_percent: delay_in(FlightPhase::Descent),
        cruise_delay_percent: delay_in(FlightPhase::Cruise),
        mean_extra_time_s: mean_over(&all, |one| {
            one.delay_percent.and(one.flown_s).map(|flown_s| flown_s - one.alone_s)
        }),
        mean_extra_distance_m: mean_over(&all, |one| one.extra_distance_m),
        mean_extra_distance_percent: mean_over(&all, |one| one.extra_distance_percent),
        mean_extra_fuel_percent: mean_over(&all, |one| one.extra_fuel_percent),
        maneuvers: sum_of(|one| one.maneuvers),
        maneuver_reversals: sum_of(|one| one.maneuver_reversals),
        maneuvers_per_flight_hour: maneuvers_per_flight_hour(state),
        in_flight: unfinished.saturating_sub(not_appeared),
        messages: traffic.messages,
        bytes: traffic.bytes,
        multicasts: traffic.multicasts,
        multicast_bytes: traffic.multicast_bytes,
        beacons: beacons.messages,
        beacon_bytes: beacons.bytes,
        beacon_multicasts: beacons.multicasts,
        beacon_multicast_bytes: beacons.multicast_bytes,
        budget_deferred: traffic.deferred + beacons.deferred,
        budget_dropped: traffic.dropped + beacons.dropped,
        network_s: network_s(world, traffic.ticks + beacons.ticks),
        optimizations,
        rounds_mean: mean(rounds as f64, optimizations as usize),
        unconverged,
        proved_minima,
        known_minima,
        reached_minima,
        optimize_cpu_s: decide_s,
        shield_overrides: all.iter().map(|a| u64::from(a.shield_overrides)).sum(),
        shield_orbits: all.iter().map(|a| u64::from(a.shield_orbits)).sum(),
        shield_level_offs: all.iter().map(|a| u64::from(a.shield_level_offs)).sum(),
        low_holds: world.safe_altitude_m.map(|_| counters.event_count(EventKind::LowHold)),
        endurance_exceedances: has_endurance(world)
            .then(|| counters.event_count(EventKind::EnduranceExceedance)),
        shield_held_back: counters.event_count(EventKind::HeldBack),
        commands_held: world.has_commands().then(|| counters.event_count(EventKind::CommandHeld)),
        track_availability: track_availability(world, counters.observed),
        mean_track_age_s: mean(
            counters.observed.age_steps as f64 * world.timing.dtau_s,
            counters.observed.tracked as usize,
        ),
        tracks_dropped: world.surveillance.map(|_| counters.event_count(EventKind::TrackDropped)),
        contacts_lost: counters.event_count(EventKind::Unheard),
        deadlines_missed: counters.event_count(EventKind::Deadline),
        groups_too_large: counters.event_count(EventKind::GroupTooLarge),
        not_appeared,
        left: count_airplanes_where(state, AirplaneState::has_left),
        replayed: replayed_count(world, state),
        orders: all.iter().map(|a| u64::from(a.orders)).sum(),
        orders_delayed: all.iter().map(|a| u64::from(a.orders_delayed)).sum(),
        unproved_pairs: counters.event_count(EventKind::SearchLimit),
        too_close: unprotected_pairs(world, counters),
        exempt_areas: area_exemptions(world, counters),
        beyond_bound: error_bound_violations(world, counters),
    }
}

/// Returns the fraction of observations with a track; none where nothing was observed by reports.
fn track_availability(world: &AirspaceWorld, observed: ObservationCounts) -> Option<f64> {
    let ObservationCounts { observations, tracked, .. } = observed;
    (world.surveillance.is_some() && observations > 0).then(|| tracked as f64 / observations as f64)
}

fn has_endurance(world: &AirspaceWorld) -> bool {
    world.airplanes.iter().any(|airplane| airplane.performance.endurance_s < f64::INFINITY)
}

/// Returns the time that conversations took on the network, in seconds; none where that is reliable.
fn network_s(world: &AirspaceWorld, ticks: u64) -> Option<f64> {
    world.network.as_ref().map(|network| network.ticks_to_s(ticks))
}

/// Returns whether all airplanes have arrived or left by now.
pub fn have_all_ended(state: &AirspaceState) -> bool {
    state.airplanes.iter().all(|airplane| !airplane.is_unfinished())
}
