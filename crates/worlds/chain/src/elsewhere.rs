//! The agents of a chain elsewhere: what a world shows them in a cycle, and what it takes from them.
//!
//! Whoever runs agents in processes of their own asks for [`ChainWorld::sights_at`], sends each
//! connector's sight to its agent, hands the decisions over ([`ChainWorld::hand_over`]), and repeats
//! that until nobody is shown anything more: chains that may meet move one after the other. Then it
//! advances the run by a cycle. A chain for which nothing was handed over talks in memory.

use super::agents::{Control, Ended, Shown};
use super::motion::replan::Climbed;
use super::perceive::Looking;
use super::rods::veto::Veto;
use super::scratch::Scratch;
use super::state::ChainState;
use super::world::ChainWorld;
use super::{act, claim, join};
use sidestep_kernel::conflict::Groups;
use sidestep_kernel::ports::ManualClock;
use sidestep_kernel::{Cycle, EntityId, InputError, Slot, Turn};

impl<const D: usize> ChainWorld<D> {
    /// Returns what the connectors of chains perceive in the cycle to come, `now`: of those chains whose
    /// turn it is, as those before them have handed over their decisions. Nothing changes. Where no
    /// team is deployed nobody perceives anything.
    pub fn sights_at(&self, state: &ChainState<D>, now: Cycle) -> Vec<Shown<D>> {
        let (state, clock) = (&state.copied(), &ManualClock::default());
        let mut scratch = Scratch::new(self);
        scratch.shown = Some(Vec::new());
        let turn = &mut Turn { world: self, state, now, clock, scratch: &mut scratch };
        let groups = Groups::new(state.len());
        (0..state.len()).for_each(|slot| claim::claim_box(turn, slot));
        (0..state.len()).for_each(|slot| join::join(turn, slot, &groups));
        for slot in 0..state.len() {
            let mut looking = Looking { world: self, state, now, scratch: turn.scratch };
            let decision = looking.decide(slot as Slot);
            state.set_decision(slot, decision);
        }
        for slot in (0..state.len() as Slot).filter(|&slot| groups.leader(slot) == slot) {
            let mut group = Vec::new();
            groups.members(slot, &mut group);
            group.sort_unstable();
            let is_shown = |turn: &Turn<'_, Self>| turn.scratch.shown.as_ref().map(Vec::len);
            let before = is_shown(turn);
            for &member in &group {
                act::act_one(turn, &group, member);
                if is_shown(turn) != before {
                    break;
                }
            }
        }
        scratch.shown.unwrap_or_default()
    }

    /// Hands over the decisions of a chain's agents for the cycle to come, `now`, by connector; none of one
    /// that has not come to a decision. Unless all who take part in a motion agree, nobody moves.
    ///
    /// # Errors
    /// When the chain does not exist, or a decision is not that of its connector in this cycle.
    pub fn hand_over(
        &self,
        state: &ChainState<D>,
        (chain, now): (EntityId, Cycle),
        controls: Vec<Option<Control<D>>>,
    ) -> Result<(), InputError> {
        let wrong = |cause: String, remedy: &str| {
            Err(InputError::new(format!("decisions of chain {chain}"), cause, remedy))
        };
        let Some(spec) = self.chains.get(chain as usize) else {
            return wrong(format!("there are {} chains", self.chains.len()), "count from 0");
        };
        let n = spec.start.points().len();
        if controls.len() != n {
            let cause = format!("{} decisions for {n} connectors", controls.len());
            return wrong(cause, "give one for each, or none of it");
        }
        for (k, control) in controls.iter().enumerate() {
            let Some(control) = control else { continue };
            if control.connector as usize != k || control.cycle != now {
                let Control { connector, cycle, .. } = control;
                let cause = format!("number {k} is of connector {connector}, cycle {cycle}");
                return wrong(cause, "give them by connector, of the cycle to come");
            }
            if !is_right(control, n) {
                let cause = format!("that of connector {k} names connectors that do not exist");
                return wrong(cause, "hand over what agents of this chain have decided");
            }
        }
        state.body_mut(chain as usize).handed = Some(controls);
        Ok(())
    }
}

/// Whether a decision is about connectors of a chain of `n`.
fn is_right<const D: usize>(control: &Control<D>, n: usize) -> bool {
    let is_there = |k: u32| (k as usize) < n;
    let is_veto = |veto: &Veto<D>| veto.by < n && veto.from < n;
    let ended = match &control.ended {
        Some(Ended::Climbed { climbed, objection, .. }) => {
            let climbed = match climbed {
                Climbed::PulledBack { by, .. } => *by < n,
                Climbed::Stuck { vetoes } => vetoes.iter().all(is_veto),
                Climbed::Vetoed(veto) => is_veto(veto),
                _ => true,
            };
            climbed && objection.as_ref().is_none_or(is_veto)
        }
        Some(Ended::Stands { missing }) => is_there(*missing),
        Some(Ended::Rested) | None => true,
    };
    let led = control.led.is_none_or(|led| led.first <= led.last && is_there(led.last));
    ended && led && control.missing.iter().flatten().all(|&k| is_there(k))
}
