//! Checks of states that come in over the network: whichever bytes arrive, every state that a host accepts can be
//! computed with.

use super::aboard::Aboard;
use super::state::{Coordinator, Overview, Task, Visited, block};
use crate::agents::party::Unsound;
use crate::agents::{Briefing, Decided};

/// Checks the state of the coordinator number `seat` of the host's group.
///
/// # Errors
/// When it cannot be such a state.
pub(super) fn state(state: &Coordinator, ship: &Aboard, seat: usize) -> Result<(), Unsound> {
    let airplanes = &state.gathered.airplanes;
    let places: Vec<usize> = airplanes.iter().map(|airplane| airplane.place).collect();
    let is_above = ship.above() == Some(seat);
    match &state.overview {
        Some(of_parts) if is_above => {
            overview(of_parts, ship)?;
            Unsound::Airplane.unless(are_of_group(&places, ship))?;
        }
        None if !is_above => Unsound::Airplane.unless(places == ship.parts[seat])?,
        _ => return Err(Unsound::Kind),
    }
    // The ways of those that it has visited in this round are taken by the next step.
    let (is_of_level, known) = match state.task {
        Task::Gather(k) => (!is_above, k),
        Task::Return | Task::Await => (!is_above, places.len()),
        Task::Deliver(_) => (!is_above, 0),
        Task::Collect(k) => (is_above && k <= ship.parts.len(), places.len()),
        Task::HandBack(k) => (is_above && k <= ship.parts.len(), 0),
    };
    Unsound::Kind.unless(is_of_level)?;
    Unsound::Round.unless(known <= places.len())?;
    let briefing = &*ship.own.briefing;
    let rounds = briefing.settings.stop.max_rounds;
    Unsound::Round.unless(state.gathered.round <= rounds && state.gathered.calm <= rounds)?;
    airplanes.iter().enumerate().try_for_each(|(k, one)| airplane(one, k < known, briefing))
}

fn overview(of_parts: &Overview, ship: &Aboard) -> Result<(), Unsound> {
    let Overview { epochs, missing, unreachable } = of_parts;
    let (group, parts) = (ship.own.briefing.ids.len(), ship.parts.len());
    Unsound::Length.unless([epochs.len(), missing.len()] == [parts; 2])?;
    Unsound::Length.unless(unreachable.len() <= group)?;
    Unsound::Round.unless(epochs.iter().all(|epoch| epoch.is_of(group)))
}

/// Returns whether all are members of the group, and none is there twice.
fn are_of_group(places: &[usize], ship: &Aboard) -> bool {
    let mut sorted = places.to_vec();
    sorted.sort_unstable();
    let is_once = sorted.windows(2).all(|pair| pair[0] != pair[1]);
    is_once && sorted.last().is_none_or(|&last| last < ship.own.briefing.ids.len())
}

/// Checks the data of an airplane of the group, which must have ways if they are `known`.
fn airplane(airplane: &Visited, known: bool, briefing: &Briefing) -> Result<(), Unsound> {
    let actions = briefing.filed[airplane.place].actions.len();
    let block = block(briefing);
    let wanted = match block {
        Some(block) => block,
        None if airplane.is_presumed => 1,
        None => actions,
    };
    let Visited { place, beacon, samples, ways, own_costs, separation_m, levels, .. } = airplane;
    if known || !ways.is_empty() {
        briefing.admits_ways(ways, wanted)?;
    }
    Unsound::Length.unless(own_costs.len() == ways.len())?;
    Unsound::Length.unless(samples.is_empty() || Some(samples.len()) == block)?;
    let is_player = airplane.player.as_ref().is_none_or(|player| player.is_of(actions));
    let is_wide = (0.0..f64::INFINITY).contains(separation_m);
    let are_numbers = own_costs.iter().all(|cost| cost.is_finite());
    let is_level = levels.low_m <= levels.high_m && samples.iter().all(|&x| x < actions);
    Unsound::Number.unless(is_player && is_wide && are_numbers && is_level)?;
    beacon.as_ref().map_or(Ok(()), |beacon| briefing.admits(*place, beacon))?;
    airplane.decided.as_ref().map_or(Ok(()), |one| decided(one, actions))
}

fn decided(decided: &Decided, actions: usize) -> Result<(), Unsound> {
    Unsound::Length.unless(decided.expected.len() == actions)?;
    let are_finite = decided.expected.iter().all(|cost| cost.is_finite());
    Unsound::Number.unless(decided.chosen < actions && are_finite)
}
