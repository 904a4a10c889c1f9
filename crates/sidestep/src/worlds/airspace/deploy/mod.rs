//! Where the optimizer of a group runs: one and the same algorithm, deployed in several ways.
//!
//! - `direct`: one process decides for all. The reference: on a faultless network every other
//!   deployment chooses the same controls, bit for bit.
//! - `team`: an agent per airplane (the paper's Algorithm 1). With sampled expectations each
//!   sends the predicted ways of its samples every round, then its part of their costs; with
//!   exact ones it sends the ways of all its actions once, and then its distribution.
//! - `compact-team`: the same, but an agent sends its state and model once, from which the others
//!   predict its ways themselves; then only its samples' numbers, or its distribution.
//! - `pim`: one coordinator whose state migrates from airplane to airplane (the paper's process
//!   integrated mechanism) and reads an airplane's model only while it is there.
//!
//! Agents are state machines without input or output of their own: messages in, messages out.
//! Here they are run in lockstep in memory; every message is serialized, counted and read back.

mod informed;
mod network;
mod pim;
mod team;

use super::airplane::{Action, Point};
use super::decide::Known;
use super::objective::Options;
use super::world::AirspaceWorld;
use crate::collectives::{Estimator, Order, Player, Settings, Utility};
pub use network::Traffic;
use serde::{Deserialize, Serialize};
use sidestep_kernel::Cycle;

/// Where the optimizer runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Deployment {
    /// One process decides for all.
    #[default]
    Direct,
    /// An agent per airplane, which sends what it may fly.
    Team,
    /// A coordinator that migrates.
    Pim,
    /// An agent per airplane, which sends its model.
    CompactTeam,
}

impl Deployment {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Team => "team",
            Self::Pim => "pim",
            Self::CompactTeam => "compact-team",
        }
    }
}

/// What an agent comes to.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Decided {
    /// Number of the chosen action.
    pub(super) chosen: usize,
    /// The estimate of every action in the end.
    pub(super) expected: Vec<f64>,
    pub(super) rounds: u32,
    pub(super) converged: bool,
}

/// What one airplane knows of itself, and what all have agreed on.
#[derive(Debug, Clone)]
struct Own<'a> {
    world: &'a AirspaceWorld,
    /// Place in the group.
    me: usize,
    group: usize,
    known: Known,
    now: Cycle,
    options: Options,
}

impl Own<'_> {
    fn settings(&self) -> &Settings {
        &self.world.settings
    }

    fn uniform(&self, k: u64) -> f64 {
        self.world.uniform(self.known.slot, self.now, k)
    }

    fn mission(&self) -> &[Point] {
        self.world.stage(self.known.slot, self.known.orders).mission
    }

    /// The next `block` samples of a player after `drawn`.
    fn samples(&self, player: &Player, drawn: u64, block: usize) -> Vec<usize> {
        (drawn..drawn + block as u64).map(|k| player.draw(self.uniform(k))).collect()
    }
}

/// Why a deployment cannot run with some settings.
pub(super) fn refuses(deployment: Deployment, settings: &Settings) -> Option<&'static str> {
    let sampled = matches!(settings.estimator, Estimator::Sampled { .. });
    let as_in_the_paper = settings.order == Order::Parallel && settings.utility == Utility::Joint;
    (deployment != Deployment::Direct && sampled && !as_in_the_paper)
        .then_some("agents that sample update in parallel and learn from the joint cost")
}

impl AirspaceWorld {
    /// Lets the agents of a group decide.
    pub(super) fn deployed(&self, group: &[Known], now: Cycle) -> (Vec<Decided>, Traffic) {
        let own = |(me, known): (usize, &Known)| Own {
            world: self,
            me,
            group: group.len(),
            known: *known,
            now,
            options: self.options(*known),
        };
        let own: Vec<Own<'_>> = group.iter().enumerate().map(own).collect();
        match (self.deployment, self.settings.estimator) {
            (Deployment::Pim, _) => pim::run(own),
            (Deployment::Team, Estimator::Sampled { block, ageing }) => network::run(
                own.into_iter().map(|own| team::Agent::new(own, block, ageing)).collect(),
            ),
            (deployment, _) => {
                let by_model = deployment == Deployment::CompactTeam;
                let agents = own.into_iter().map(|own| informed::Agent::new(own, by_model));
                network::run(agents.collect())
            }
        }
    }

    /// Actions of airplane `i`, for whoever knows its model.
    pub(super) fn actions_of(&self, slot: u32) -> &[Action] {
        &self.actions[slot as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::super::metrics::Metrics;
    use super::super::simulation::AirspaceSimulation;
    use crate::scenario::Source;
    use sidestep_kernel::{Digest, Simulation};

    fn flown(preset: &str, deployment: &str, more: &str) -> (Digest, Metrics) {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 5\n[airspace]\npreset = \"{preset}\"\n\
             deployment = \"{deployment}\"\nmax_rounds = 60\nshield = \"off\"\n{more}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 5\n"
        );
        let mut run = AirspaceSimulation::new(&Source::new("s", text, ""), 1).expect("a scenario");
        run.advance(25);
        (run.digest(), run.airspace_metrics())
    }

    /// On a faultless network, with exact expectations in sequence and in parallel, and with
    /// sampled ones and drawn controls.
    #[test]
    fn every_deployment_chooses_the_same_controls_bit_for_bit() {
        let parallel = "order = \"parallel\"";
        for (preset, more) in [("default", ""), ("default", parallel), ("paper", "")] {
            let (direct, alone) = flown(preset, "direct", more);
            assert_eq!((alone.messages, alone.bytes), (0, 0));
            for deployment in ["team", "compact-team", "pim"] {
                let (digest, metrics) = flown(preset, deployment, more);
                assert_eq!(digest, direct, "{deployment}, {preset} {more}");
                assert_eq!(metrics.rounds_mean, alone.rounds_mean);
                assert!(metrics.messages > 0 && metrics.bytes > 0);
            }
        }
    }

    /// Parts of the paper's figures 6 and 7, and what compact messages save.
    #[test]
    fn a_coordinator_sends_fewer_messages_than_a_team_and_more_bytes_than_one_that_multicasts() {
        let [team, compact, pim] =
            ["team", "compact-team", "pim"].map(|deployment| flown("paper", deployment, "").1);
        assert!(pim.messages < team.messages);
        assert!(pim.bytes > 2 * team.multicast_bytes);
        assert!(compact.bytes * 20 < team.bytes, "{} {}", compact.bytes, team.bytes);
    }

    #[test]
    fn agents_that_sample_in_sequence_are_refused() {
        let text = "format = 1\nworld = \"airspace\"\n[airspace]\npreset = \"paper\"\n\
                    order = \"sequence\"\ndeployment = \"team\"\n\
                    [airspace.generator]\nkind = \"superconflict\"\nn = 3\n";
        let error = AirspaceSimulation::new(&Source::new("s", text, ""), 1).expect_err("refused");
        assert!(error.to_string().contains("parallel"), "{error}");
    }
}
