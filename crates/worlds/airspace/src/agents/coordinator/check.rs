//! Checks of states that come in over the network: whichever bytes arrive, every state that a host accepts can be
//! computed with.

use super::hosted_aircraft::HostedAircraft;
use super::state::{Coordinator, CoordinatorTask, HierarchyData, MemberData, samples_per_round};
use crate::agents::participant::InvalidMessage;
use crate::agents::{ActionChoice, CommonKnowledge};

/// Checks the state of the coordinator number `seat` of the host's group.
///
/// # Errors
/// When it cannot be such a state.
pub(super) fn check_state(
    state: &Coordinator,
    ship: &HostedAircraft,
    seat: usize,
) -> Result<(), InvalidMessage> {
    let airplanes = &state.gathered.airplanes;
    let places: Vec<usize> = airplanes.iter().map(|airplane| airplane.place).collect();
    let is_above = ship.root_seat() == Some(seat);
    match &state.overview {
        Some(of_parts) if is_above => {
            check_hierarchy(of_parts, ship)?;
            InvalidMessage::Airplane.unless(are_members(&places, ship))?;
        }
        None if !is_above => InvalidMessage::Airplane.unless(places == ship.parts[seat])?,
        _ => return Err(InvalidMessage::Kind),
    }
    // The ways of those that it has visited in this round are taken by the next step.
    let (is_of_level, known) = match state.task {
        CoordinatorTask::Gather(k) => (!is_above, k),
        CoordinatorTask::Return | CoordinatorTask::Await => (!is_above, places.len()),
        CoordinatorTask::Deliver(_) => (!is_above, 0),
        CoordinatorTask::Collect(k) => (is_above && k <= ship.parts.len(), places.len()),
        CoordinatorTask::HandBack(k) => (is_above && k <= ship.parts.len(), 0),
    };
    InvalidMessage::Kind.unless(is_of_level)?;
    InvalidMessage::Round.unless(known <= places.len())?;
    let briefing = &*ship.own.briefing;
    let rounds = briefing.settings.stop.max_rounds;
    InvalidMessage::Round
        .unless(state.gathered.round <= rounds && state.gathered.calm <= rounds)?;
    airplanes.iter().enumerate().try_for_each(|(k, one)| check_member(one, k < known, briefing))
}

fn check_hierarchy(of_parts: &HierarchyData, ship: &HostedAircraft) -> Result<(), InvalidMessage> {
    let HierarchyData { epochs, missing, unreachable } = of_parts;
    let (group, parts) = (ship.own.briefing.ids.len(), ship.parts.len());
    InvalidMessage::Length.unless([epochs.len(), missing.len()] == [parts; 2])?;
    InvalidMessage::Length.unless(unreachable.len() <= group)?;
    InvalidMessage::Round.unless(epochs.iter().all(|epoch| epoch.is_valid_for(group)))
}

/// Returns whether all are members of the group, and none is there twice.
fn are_members(places: &[usize], ship: &HostedAircraft) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    let is_once = sorted.windows(2).all(|pair| pair[0] != pair[1]);
    is_once && sorted.last().is_none_or(|&last| last < ship.own.briefing.ids.len())
}

/// Checks the data of an airplane of the group, which must have ways if they are `known`.
fn check_member(
    airplane: &MemberData,
    known: bool,
    briefing: &CommonKnowledge,
) -> Result<(), InvalidMessage> {
    let actions = briefing.filed[airplane.place].actions.len();
    let block = samples_per_round(briefing);
    let wanted = match block {
        Some(block) => block,
        None if airplane.is_presumed => 1,
        None => actions,
    };
    let MemberData { place, beacon, samples, ways, own_costs, separation_m, levels, .. } = airplane;
    if known || !ways.is_empty() {
        briefing.check_predictions(ways, wanted)?;
    }
    InvalidMessage::Length.unless(own_costs.len() == ways.len())?;
    InvalidMessage::Length.unless(samples.is_empty() || Some(samples.len()) == block)?;
    let is_player = airplane.player.as_ref().is_none_or(|player| player.has_strategies(actions));
    let is_wide = (0.0..f64::INFINITY).contains(separation_m);
    let are_numbers = own_costs.iter().all(|cost| cost.is_finite());
    let is_level = levels.low_m <= levels.high_m && samples.iter().all(|&x| x < actions);
    InvalidMessage::Number.unless(is_player && is_wide && are_numbers && is_level)?;
    beacon.as_ref().map_or(Ok(()), |beacon| briefing.check_beacon(*place, beacon))?;
    airplane.decided.as_ref().map_or(Ok(()), |one| check_choice(one, actions))
}

fn check_choice(decided: &ActionChoice, actions: usize) -> Result<(), InvalidMessage> {
    InvalidMessage::Length.unless(decided.expected.len() == actions)?;
    let are_finite = decided.expected.iter().all(|cost| cost.is_finite());
    InvalidMessage::Number.unless(decided.chosen < actions && are_finite)
}
