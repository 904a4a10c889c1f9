//! Checks of states that come in over the network: whatever bytes arrive, what a host takes in can be
//! computed with.

use super::aboard::Aboard;
use super::state::{Coordinator, Overview, Task, Visited, block};
use crate::agents::contact::Beacon;
use crate::agents::{Briefing, Decided};
use crate::flight::{Levels, Prediction};

/// Returns whether a state can be that of the coordinator number `seat` of the host's group.
pub(super) fn is_sound(state: &Coordinator, ship: &Aboard, seat: usize) -> bool {
    let is_above = ship.above() == Some(seat);
    let airplanes = &state.gathered.airplanes;
    let places: Vec<usize> = airplanes.iter().map(|airplane| airplane.place).collect();
    let is_of_group = match &state.overview {
        Some(overview) => is_above && is_overview(overview, ship) && are_of_group(&places, ship),
        None => !is_above && places == ship.parts[seat],
    };
    // Those whose ways the next step of the algorithm takes.
    let known = match state.task {
        Task::Gather(k) if !is_above => k,
        Task::Return | Task::Await if !is_above => places.len(),
        Task::Deliver(_) if !is_above => 0,
        Task::Collect(k) if is_above && k <= ship.parts.len() => places.len(),
        Task::HandBack(k) if is_above && k <= ship.parts.len() => 0,
        _ => return false,
    };
    let is_right = |(k, airplane): (usize, &Visited)| is_airplane(airplane, k < known, ship);
    is_of_group && known <= places.len() && airplanes.iter().enumerate().all(is_right)
}

fn is_overview(Overview { epochs, missing, unreachable }: &Overview, ship: &Aboard) -> bool {
    let (group, parts) = (ship.own.briefing.ids.len(), ship.parts.len());
    [epochs.len(), missing.len()].iter().all(|&len| len == 0 || len == parts)
        && epochs.iter().all(|epoch| epoch.is_of(group))
        && unreachable.len() <= group
}

/// Returns whether all are members of the group, and none is there twice.
fn are_of_group(places: &[usize], ship: &Aboard) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    let is_once = sorted.windows(2).all(|pair| pair[0] != pair[1]);
    is_once && sorted.last().is_none_or(|&last| last < ship.own.briefing.ids.len())
}

/// Returns whether the data of an airplane are sound, ways included if they are `known`.
fn is_airplane(airplane: &Visited, known: bool, ship: &Aboard) -> bool {
    let briefing = &*ship.own.briefing;
    let actions = briefing.filed[airplane.place].actions.len();
    let Visited { beacon, player, samples, ways, own_costs, separation_m, levels, decided, .. } =
        airplane;
    let wanted = match block(briefing) {
        Some(block) => block,
        None if airplane.is_presumed => 1,
        None => actions,
    };
    let are_there = ways.len() == wanted || (ways.is_empty() && !known);
    let are_samples = samples.is_empty() || samples.len() == wanted;
    are_there
        && own_costs.len() == ways.len()
        && are_finite(own_costs)
        && ways.iter().all(|way| is_way(way, briefing))
        && are_samples
        && samples.iter().all(|&x| x < actions)
        && player.as_ref().is_none_or(|player| player.is_of(actions))
        && (0.0..f64::INFINITY).contains(separation_m)
        && are_levels(levels)
        && beacon.as_ref().is_none_or(is_beacon)
        && decided.as_ref().is_none_or(|decided| is_decided(decided, actions))
}

fn are_finite(numbers: &[f64]) -> bool {
    numbers.iter().all(|number| number.is_finite())
}

fn is_way(Prediction { points, counted }: &Prediction, briefing: &Briefing) -> bool {
    let horizon = briefing.air.timing.horizon;
    points.len() == horizon && *counted <= horizon && points.iter().all(|at| are_finite(at))
}

fn are_levels(Levels { low_m, high_m }: &Levels) -> bool {
    low_m <= high_m
}

fn is_beacon(beacon: &Beacon) -> bool {
    let Beacon { pose, goal, v_m_s, omega_max_rad_s, orbit_rad_s, separation_m, levels } = beacon;
    let positive = [v_m_s, omega_max_rad_s, orbit_rad_s];
    are_finite(&pose.at)
        && pose.heading_rad.is_finite()
        && goal.is_none_or(|goal| are_finite(&goal))
        && positive.iter().all(|number| (0.0..f64::INFINITY).contains(*number))
        && (0.0..f64::INFINITY).contains(separation_m)
        && are_levels(levels)
}

fn is_decided(Decided { chosen, expected, .. }: &Decided, actions: usize) -> bool {
    *chosen < actions && expected.len() == actions && are_finite(expected)
}
