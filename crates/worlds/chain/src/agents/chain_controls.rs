//! Decisions of a chain's agents in a cycle, wherever they run.

use super::control::{ConnectorControl, LeaderOutcome};
use crate::motion::recovery::RecoveryOutcome;
use serde::{Deserialize, Serialize};
use sidestep_kernel::Cycle;
use sidestep_rods::Veto;

/// Decisions of a chain's agents in a cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChainCycleControls<const D: usize> {
    /// The cycle that they decide; in any other one they are ignored.
    pub cycle: Cycle,
    /// The decisions, by connector; none of one that has not come to a decision in time.
    pub controls: Vec<Option<ConnectorControl<D>>>,
    /// Connectors whose agents are gone: the chain stands until they are back.
    pub gone: Vec<u32>,
}

impl<const D: usize> ChainCycleControls<D> {
    /// The bytes that stand for the decision of an agent that is gone: too few for any decision.
    pub const ABSENT_CONTROL: &'static [u8] = &[0];

    /// Returns the decisions of a chain of `n` whose agents were not heard.
    pub fn empty(cycle: Cycle, n: usize) -> Self {
        Self { cycle, controls: vec![None; n], gone: Vec::new() }
    }

    /// Checks that they are of a chain of `n`; an error has the cause and the remedy.
    pub(crate) fn check(&self, n: usize) -> Result<(), (String, &'static str)> {
        if self.controls.len() != n {
            let cause = format!("{} decisions for {n} connectors", self.controls.len());
            return Err((cause, "give one for each, or none of it"));
        }
        if let Some(k) = self.gone.iter().find(|&&k| k as usize >= n) {
            let cause = format!("connector {k} is said to be gone, and there are {n}");
            return Err((cause, "name connectors of this chain"));
        }
        for (k, control) in self.controls.iter().enumerate() {
            let Some(control) = control else { continue };
            if control.connector as usize != k || control.cycle != self.cycle {
                let ConnectorControl { connector, cycle, .. } = control;
                let cause = format!("number {k} is of connector {connector}, cycle {cycle}");
                return Err((cause, "give them by connector, of the cycle to come"));
            }
            if !is_valid(control, n) {
                let cause = format!("that of connector {k} refers to connectors that do not exist");
                return Err((cause, "submit what agents of this chain have decided"));
            }
        }
        Ok(())
    }
}

/// Returns whether a decision is about connectors of a chain of `n`.
fn is_valid<const D: usize>(control: &ConnectorControl<D>, n: usize) -> bool {
    let is_end_valid = control.ended.as_ref().is_none_or(|ended| is_valid_outcome(ended, n));
    let is_led_valid =
        control.led.is_none_or(|led| led.first <= led.last && (led.last as usize) < n);
    let mut missing = control.missing.iter().flatten();
    is_end_valid && is_led_valid && missing.all(|&k| (k as usize) < n)
}

fn is_valid_outcome<const D: usize>(outcome: &LeaderOutcome<D>, n: usize) -> bool {
    match outcome {
        LeaderOutcome::Climbed { climbed, objection, .. } => {
            let is_climb_valid = match climbed {
                RecoveryOutcome::PulledBack { by, .. } => *by < n,
                RecoveryOutcome::Stuck { vetoes } => vetoes.iter().all(|v| is_valid_veto(v, n)),
                RecoveryOutcome::Vetoed(veto) => is_valid_veto(veto, n),
                _ => true,
            };
            is_climb_valid && objection.as_ref().is_none_or(|veto| is_valid_veto(veto, n))
        }
        LeaderOutcome::Stands { missing } => (*missing as usize) < n,
        LeaderOutcome::Rested => true,
    }
}

fn is_valid_veto<const D: usize>(veto: &Veto<D>, n: usize) -> bool {
    veto.by < n && veto.from < n
}
