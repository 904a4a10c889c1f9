//! Checks of states that come in over the network: whichever bytes arrive, every state that a host accepts can be
//! computed with.

use super::hosted_aircraft::HostAircraft;
use super::state::{
    Coordinator, CoordinatorMemberData, CoordinatorTask, RootCoordinatorData, samples_per_round,
};
use crate::agents::participant::InvalidMessage;
use crate::agents::{ActionChoice, CommonKnowledge};

/// Checks the state of the coordinator with this number of the host's group.
///
/// # Errors
/// When it cannot be such a state.
pub(super) fn check_state(
    state: &Coordinator,
    services: &HostAircraft,
    number: usize,
) -> Result<(), InvalidMessage> {
    let airplanes = &state.data.airplanes;
    let places: Vec<usize> = airplanes.iter().map(|airplane| airplane.place).collect();
    let is_above = services.root_number() == Some(number);
    match &state.hierarchy {
        Some(hierarchy) if is_above => {
            check_hierarchy(hierarchy, services)?;
            InvalidMessage::Airplane.ensure(are_members(&places, services))?;
        }
        None if !is_above => InvalidMessage::Airplane.ensure(places == services.parts[number])?,
        _ => return Err(InvalidMessage::Kind),
    }
    // The next step computes with the predictions of those that it has visited in this round.
    let (is_of_level, known) = match state.task {
        CoordinatorTask::Gather(k) => (!is_above, k),
        CoordinatorTask::Return | CoordinatorTask::Await => (!is_above, places.len()),
        CoordinatorTask::Deliver(_) => (!is_above, 0),
        CoordinatorTask::Collect(k) => (is_above && k <= services.parts.len(), places.len()),
        CoordinatorTask::HandBack(k) => (is_above && k <= services.parts.len(), 0),
    };
    InvalidMessage::Kind.ensure(is_of_level)?;
    InvalidMessage::Round.ensure(known <= places.len())?;
    let common = &*services.own.common;
    let rounds = common.settings.stop.max_rounds;
    InvalidMessage::Round.ensure(state.data.round <= rounds && state.data.calm <= rounds)?;
    airplanes.iter().enumerate().try_for_each(|(k, one)| check_member(one, k < known, common))
}

fn check_hierarchy(
    hierarchy: &RootCoordinatorData,
    services: &HostAircraft,
) -> Result<(), InvalidMessage> {
    let RootCoordinatorData { epochs, missing, unreachable } = hierarchy;
    let group = services.own.common.ids.len();
    let parts = services.parts.len();
    InvalidMessage::Length.ensure([epochs.len(), missing.len()] == [parts; 2])?;
    InvalidMessage::Length.ensure(unreachable.len() <= group)?;
    InvalidMessage::Round.ensure(epochs.iter().all(|epoch| epoch.is_valid_for(group)))
}

/// Returns whether all are members of the group, and none is there twice.
fn are_members(places: &[usize], services: &HostAircraft) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    let are_unique = sorted.windows(2).all(|pair| pair[0] != pair[1]);
    are_unique && sorted.last().is_none_or(|&last| last < services.own.common.ids.len())
}

/// Checks the data of an airplane of the group, which must have predictions if they are `known`.
fn check_member(
    airplane: &CoordinatorMemberData,
    known: bool,
    common: &CommonKnowledge,
) -> Result<(), InvalidMessage> {
    let actions = common.filed[airplane.place].actions.len();
    let block = samples_per_round(common);
    let expected = match block {
        Some(block) => block,
        None if airplane.is_presumed => 1,
        None => actions,
    };
    let CoordinatorMemberData {
        place,
        beacon,
        samples,
        predictions,
        own_costs,
        separation_m,
        levels,
        ..
    } = airplane;
    if known || !predictions.is_empty() {
        common.check_predictions(predictions, expected)?;
    }
    InvalidMessage::Length.ensure(own_costs.len() == predictions.len())?;
    InvalidMessage::Length.ensure(samples.is_empty() || Some(samples.len()) == block)?;
    let is_player = airplane.player.as_ref().is_none_or(|player| player.has_strategies(actions));
    let is_wide = (0.0..f64::INFINITY).contains(separation_m);
    let are_numbers = own_costs.iter().all(|cost| cost.is_finite());
    let is_level = levels.low_m <= levels.high_m && samples.iter().all(|&x| x < actions);
    InvalidMessage::Number.ensure(is_player && is_wide && are_numbers && is_level)?;
    common.check_orders(*place, airplane.orders)?;
    beacon.as_ref().map_or(Ok(()), |beacon| common.check_beacon(*place, beacon))?;
    airplane.decided.as_ref().map_or(Ok(()), |one| check_choice(one, actions))
}

fn check_choice(decided: &ActionChoice, actions: usize) -> Result<(), InvalidMessage> {
    InvalidMessage::Length.ensure(decided.expected.len() == actions)?;
    let are_finite = decided.expected.iter().all(|cost| cost.is_finite());
    InvalidMessage::Number.ensure(decided.chosen < actions && are_finite)
}
