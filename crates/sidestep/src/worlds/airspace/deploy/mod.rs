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
//! - `hierarchical-pim`: a coordinator for each part of the group, and one above them.
//!
//! Agents are state machines without input or output of their own: messages in, messages out
//! ([`link`]). Here they are run on a network in memory ([`network`]), which counts every message
//! in its serialized form and can lose, delay, double and reorder them, and silence an airplane.
//! Nobody waits for ever: who is not heard is presumed where it was last heard of ([`contact`]),
//! and every talk has a deadline. What the shield needs to know goes over the same network
//! ([`exchange`]).

pub mod contact;
mod exchange;
mod informed;
mod link;
mod network;
mod pim;
mod team;

use super::airplane::Action;
use super::decide::Known;
use super::events::{Event, EventKind};
use super::objective::Options;
use super::world::{Airplane, AirspaceWorld};
use crate::collectives::{Estimator, Order, Player, Settings, Utility};
use contact::{Beacon, Contacts};
use network::{Ended, Talk, Topic};
pub use network::{Network, Silence, Traffic};
use serde::{Deserialize, Serialize};
use sidestep_kernel::{Cycle, EntityId};

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
    /// Coordinators that migrate, one above the others.
    HierarchicalPim,
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
            Self::HierarchicalPim => "hierarchical-pim",
            Self::CompactTeam => "compact-team",
        }
    }
}

/// What the optimizer of an airplane comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Decided {
    /// Number of the chosen action.
    pub(super) chosen: usize,
    /// The estimate of every action in the end.
    pub(super) expected: Vec<f64>,
    pub(super) rounds: u32,
    pub(super) converged: bool,
}

/// What an agent comes to.
#[derive(Debug, Clone, PartialEq)]
struct Came {
    /// Nothing, if time was up before it had learned anything.
    decided: Option<Decided>,
    /// What it has heard the others tell of themselves, by place.
    beacons: Vec<Option<Beacon>>,
}

/// What one airplane knows of itself, and what all have agreed on.
#[derive(Debug, Clone)]
struct Own<'a> {
    world: &'a AirspaceWorld,
    /// Place in the group.
    me: usize,
    /// Ids of the group.
    group: &'a [EntityId],
    known: Known,
    now: Cycle,
    options: Options,
    contacts: &'a Contacts,
}

impl Own<'_> {
    fn settings(&self) -> &Settings {
        &self.world.settings
    }

    fn uniform(&self, k: u64) -> f64 {
        self.world.uniform(self.known.slot, self.now, k)
    }

    fn airplane(&self) -> &Airplane {
        &self.world.airplanes[self.known.slot as usize]
    }

    /// The next `block` samples of a player after `drawn`.
    fn samples(&self, player: &Player, drawn: u64, block: usize) -> Vec<usize> {
        (drawn..drawn + block as u64).map(|k| player.draw(self.uniform(k))).collect()
    }

    /// What it tells of itself.
    fn beacon(&self) -> Beacon {
        self.world.beacon(self.known)
    }

    /// Where another one is taken to fly that is not heard.
    fn presumed(&self, other: usize) -> Options {
        let id = self.group[other];
        let contact = self.contacts.get(&id).cloned().unwrap_or_else(|| self.world.filed(id));
        contact.options(self.world, self.now)
    }
}

/// Why a deployment cannot run with some settings.
pub(super) fn refuses(deployment: Deployment, settings: &Settings) -> Option<&'static str> {
    let sampled = matches!(settings.estimator, Estimator::Sampled { .. });
    let as_in_the_paper = settings.order == Order::Parallel && settings.utility == Utility::Joint;
    (deployment != Deployment::Direct && sampled && !as_in_the_paper)
        .then_some("agents that sample update in parallel and learn from the joint cost")
}

/// What the agents of a group come to: each what, if anything; and what went over the network.
pub(super) type Deployed = (Vec<Option<Decided>>, Traffic);

impl AirspaceWorld {
    /// Lets the agents of a group decide, and notes in `contacts` what they hear of each other.
    pub(super) fn deployed(
        &self,
        group: &[Known],
        now: Cycle,
        contacts: &mut [Contacts],
        events: &mut Vec<Event>,
    ) -> Deployed {
        let ids: Vec<EntityId> = group.iter().map(|known| known.slot).collect();
        let own = |(me, known): (usize, &Known)| Own {
            world: self,
            me,
            group: &ids,
            known: *known,
            now,
            options: self.options(*known),
            contacts: &contacts[me],
        };
        let own: Vec<Own<'_>> = group.iter().enumerate().map(own).collect();
        let (ended, traffic) = self.talk_of(own, &self.talk(Topic::Optimization, now));
        if self.network.is_some() {
            for (me, end) in ended.iter().enumerate() {
                tell(end, (ids[me], &ids), now, events);
                let beacons = end.outcome.iter().flat_map(|came| came.beacons.iter().zip(&ids));
                for (beacon, &id) in beacons {
                    if let Some(beacon) = beacon {
                        contact::note(&mut contacts[me], id, beacon.clone(), now);
                    }
                }
            }
        }
        let decided = ended.into_iter().map(|end| end.outcome.and_then(|came| came.decided));
        (decided.collect(), traffic)
    }

    fn talk_of(&self, own: Vec<Own<'_>>, talk: &Talk<'_>) -> pim::Run {
        let ids = own[0].group;
        match (self.deployment, self.settings.estimator) {
            (Deployment::Pim, _) => {
                let all = (0..own.len()).collect();
                pim::run(talk, &own, vec![all])
            }
            (Deployment::HierarchicalPim, _) => pim::run(talk, &own, pim::parts(&own)),
            (Deployment::Team, Estimator::Sampled { block, ageing }) => {
                let agents = own.into_iter().map(|own| team::Agent::new(own, block, ageing));
                network::run(talk, ids, agents.collect())
            }
            (deployment, _) => {
                let by_model = deployment == Deployment::CompactTeam;
                let agents = own.into_iter().map(|own| informed::Agent::new(own, by_model));
                network::run(talk, ids, agents.collect())
            }
        }
    }

    fn talk(&self, topic: Topic, now: Cycle) -> Talk<'_> {
        Talk {
            network: self.network.as_ref(),
            streams: self.streams,
            topic,
            now,
            at_s: now as f64 * self.timing.dt_s,
        }
    }

    /// Whether an airplane's radio is dead in a cycle.
    pub(super) fn is_silent(&self, id: EntityId, now: Cycle) -> bool {
        self.talk(Topic::Optimization, now).is_silent(id)
    }

    /// What an airplane tells of itself.
    fn beacon(&self, known: Known) -> Beacon {
        let Airplane { model, mission, altitude_m, .. } = &self.airplanes[known.slot as usize];
        Beacon {
            pose: known.pose,
            goal: mission.get(known.next).copied(),
            v_m_s: model.v_m_s,
            omega_max_rad_s: model.omega_max_rad_s,
            separation_m: model.separation_m,
            altitude_m: *altitude_m,
        }
    }

    /// Actions of airplane `i`, for whoever knows its model.
    pub(super) fn actions_of(&self, slot: u32) -> &[Action] {
        &self.actions[slot as usize]
    }
}

/// Books how a talk has ended for an airplane.
fn tell<O>(
    end: &Ended<O>,
    (id, ids): (EntityId, &[EntityId]),
    now: Cycle,
    events: &mut Vec<Event>,
) {
    let unheard = |&place: &usize| Event::of_pair(now, EventKind::Unheard, id, ids[place]);
    events.extend(end.unheard.iter().map(unheard));
    if end.late {
        events.push(Event::of(now, EventKind::Deadline, id));
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
            for deployment in ["team", "compact-team", "pim", "hierarchical-pim"] {
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
