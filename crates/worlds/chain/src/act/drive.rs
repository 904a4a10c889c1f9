//! The present task of a chain, for one cycle: the wish of its driver, and what comes of it.

use super::foresee;
use super::go::{give_way, go};
use super::obey::{Manner, obey};
use super::plan::{follow_plan, planned_place};
use super::tasks::{ending, next_task};
use super::wheels::{face, go_on_wheels};
use super::wish::{Guide, Wish, wish};
use super::{Acting, Initiator, Setting};
use crate::driver::errand::Errand;
use crate::notes::Wanted;
use crate::rods::geometry::in_dimensions;
use crate::state::Body;

/// The words for a wish that is put off.
const WAIT: &str = "wait for what moves";

/// The outcome of a chain's task in a cycle.
pub(super) struct Driven<const D: usize> {
    /// The errand on which orders from outside have sent it.
    pub(super) errand: Option<Errand<D>>,
    /// Whether its initiator gave way to what comes near.
    pub(super) gives_way: bool,
}

/// Carries out the present task.
pub(super) fn drive<const D: usize>(
    setting: Setting<'_, D>,
    acting: &mut Acting<'_, D>,
    guide: &Guide<'_, D>,
) -> Driven<D> {
    let mut driven = Driven { errand: None, gives_way: guide.is_pressed };
    let Some(task) = setting.task(acting.body) else { return driven };
    let who = Initiator { setting, task, follows: guide.follows };
    let is_late = setting.world.starts_s(acting.body.driving.cycles + 1) >= task.lasts_s;
    acting.body.driving.cycles += 1;
    let present = acting.body.driving.task;
    let wish = wish(who, acting, guide);
    let escaper = guide.escaping.escaper.as_deref();
    driven.gives_way |= foresee::gives_way(who, acting.body, escaper, wish);
    let wanted = wanted(who, acting.body, wish, driven.gives_way);
    acting.told.note(|notes| notes.wish = Some(wanted));
    let manner = Manner { gives_way: driven.gives_way, goes_far: guide.heard.orders.goes_far };
    carry_out(who, acting, wish, manner);
    if let Wish::Obey(errand) = wish {
        driven.errand = Some(errand);
    }
    // One that was given up in this cycle has ended already, and the next one has just begun.
    let is_over = is_late && acting.body.driving.task == present;
    if is_over || matches!(wish, Wish::Done) {
        let how = ending(task, acting.body);
        next_task(setting, acting.body, &mut acting.told, how);
    }
    driven
}

/// Lets the initiator do as it wishes.
fn carry_out<const D: usize>(
    who: Initiator<'_, D>,
    acting: &mut Acting<'_, D>,
    wish: Wish<D>,
    manner: Manner,
) {
    match wish {
        Wish::Rest | Wish::Done => {}
        Wish::Go(_) | Wish::Return(_) | Wish::Steer(_) if manner.gives_way => give_way(who, acting),
        Wish::Return(to) => {
            let ahead = acting.body.driving.ahead;
            go(who, acting, to);
            acting.body.driving.ahead = ahead;
        }
        Wish::Face(heading_rad) => face(acting.body, heading_rad),
        Wish::Go(to) => {
            go(who, acting, to);
        }
        Wish::Follow => follow_plan(who, acting.body, acting.before),
        Wish::Steer(steered) => go_on_wheels(who, acting, steered),
        Wish::Obey(errand) => obey(who, acting, &errand, manner),
    }
}

/// Returns a wish in words.
fn wanted<const D: usize>(
    who: Initiator<'_, D>,
    body: &Body<D>,
    wish: Wish<D>,
    gives_way: bool,
) -> Wanted<D> {
    let mut of = who.task.agent;
    let (words, to) = match wish {
        Wish::Rest => ("rest", None),
        Wish::Go(to) if gives_way => (WAIT, Some(to)),
        Wish::Go(to) => ("go", Some(to)),
        Wish::Return(to) => ("go back to its robot", Some(to)),
        Wish::Face(_) => ("turn to where it faced", None),
        Wish::Obey(errand) => {
            of = errand.first;
            (if gives_way { WAIT } else { "go, as ordered" }, Some(errand.to[0]))
        }
        Wish::Follow => ("follow its plan", planned_place(who, body)),
        Wish::Steer(steered) => ("steer", Some(in_dimensions(steered.pose.at))),
        Wish::Done => ("its task is done", None),
    };
    Wanted { of, words, to }
}
