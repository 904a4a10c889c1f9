//! One motion of an initiator.

use super::outcome::{Went, take_note};
use super::situation::{beyond, situation};
use super::{Acting, Follows, Initiator, joints, later, talk};
use crate::motion::replan::{Climbed, Ladder};
use crate::rods::geometry::{Point, distance, norm, sub};
use crate::rods::veto::{Mode, Motion, Request};

/// Moves the initiator, as it wants or as the ladder allows.
pub(super) fn go<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    to: Point<D>,
) -> Went {
    let at = who.at(acting.body);
    let climbed = match who.follows {
        Follows::Later => Some(later::lead(who, acting.body, to)),
        Follows::AsTeam => talk::climb(who, acting, to),
        Follows::AtOnce => Some(climb(who, acting, to)),
    };
    let climbed = climbed.map(|climbed| joints::come_along(who, acting, to, climbed));
    acting.told.note(|notes| notes.climbed.clone_from(&climbed));
    let way = sub(who.at(acting.body), at);
    acting.body.driving.way_m.wanted += distance(at, to);
    acting.body.driving.way_m.gone += norm(way);
    acting.body.tally.way_m += norm(way);
    // A chain that stands because somebody is lost does not lose its patience.
    let Some(climbed) = climbed else { return Went::Nowhere };
    take_note(who, acting, &climbed, way)
}

/// Requests a motion of the whole chain.
fn climb<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    to: Point<D>,
) -> Climbed<D> {
    let (setting, k) = (who.setting, who.task.agent);
    let request = Request {
        motion: Motion::Connector { k, to },
        source: who.task.source(),
        mode: Mode::Exact,
    };
    let situation = situation(who, acting.body);
    let memory = std::mem::take(&mut acting.body.driving.ladder);
    let mut ladder = Ladder { rungs: setting.world.rungs, memory };
    let climbed = ladder.climb_told(
        &mut acting.body.chain,
        setting.obstacles,
        acting.propagator,
        &request,
        &situation,
    );
    acting.body.driving.ladder = ladder.memory;
    let beyond = beyond(&acting.body.chain, k);
    let (climbed, objection) = climbed.unwrap_or((Climbed::Vetoed(beyond), Some(beyond)));
    if let Some(veto) = &objection {
        acting.vetoed(veto);
    }
    climbed
}

/// Lets the initiator wait while the chain needs all its speed to get out of the way.
pub(super) fn give_way<const D: usize>(who: Initiator<'_, D>, acting: &mut Acting<'_, D>) {
    acting.body.driving.way_m.wanted += who.step_m();
    let n = acting.body.driving.idle.saturating_add(1);
    take_note(who, acting, &Climbed::Waiting { n }, [0.0; D]);
}
