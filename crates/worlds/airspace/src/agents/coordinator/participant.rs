//! A host as a participant of the conversation of its group.

use super::CoordinatorHostConfig;
use super::host::CoordinatorHost;
use super::hosted_aircraft::{HostAircraft, partition_group};
use super::replica::OutgoingHostMessage;
use super::state::{Coordinator, samples_per_round};
use crate::agents::link::{ConversationEnd, EndpointConfig};
use crate::agents::participant::{
    ConversationProgress, FinishableParticipant, InvalidMessage, OutgoingMessage, Participant,
};
use crate::agents::{CommonKnowledge, OptimizationResult, Ownship};
use sidestep_kernel::EntityId;
use sidestep_kernel::network::HEADER_BYTES;
use std::sync::Arc;

/// The program aboard one airplane that takes coordinators in, runs them, and sends them on.
#[derive(Debug)]
pub struct CoordinatorHostParticipant {
    host: CoordinatorHost<Coordinator>,
    group: Arc<[EntityId]>,
    /// Number of ticks after which the conversation ends.
    ticks: u64,
    is_silent: bool,
}

impl CoordinatorHostParticipant {
    /// Returns the host aboard an airplane. There is one coordinator for the group, or in a hierarchy one for each
    /// part of it and one above these.
    pub fn new(own: Ownship, is_hierarchy: bool, config: EndpointConfig) -> Self {
        let EndpointConfig { group, me, patience, ticks, is_silent } = config;
        // No host waits forever, except where no message is lost.
        let patience = (patience.ticks < u64::MAX).then_some(patience);
        let at: Vec<_> = own.common.poses.iter().map(|pose| pose.at).collect();
        let parts = if is_hierarchy {
            partition_group(own.common.air.surface, &at)
        } else {
            vec![(0..group.len()).collect()]
        };
        let bytes = max_state_bytes(&own.common);
        let miss_ticks = patience.map_or(u64::MAX, |patience| {
            // The ticks of a tour, and those within which every host in touch answers; at most a quarter of the conversation,
            // so that enough is left to bring it back.
            let hops = group.len() as u64 + u64::from(patience.tries);
            hops.saturating_mul(patience.timeout_ticks(bytes)).min(ticks / 4).max(1)
        });
        let expected = (0..group.len()).map(|place| own.is_expected(place)).collect();
        let rules = CoordinatorHostConfig {
            group: group.len(),
            me,
            retry_policy: patience,
            expected,
            election_timeout_ticks: miss_ticks,
        };
        let mut stops = parts.clone();
        if parts.len() > 1 {
            stops.push((0..group.len()).collect());
        }
        let host = CoordinatorHost::new(HostAircraft::new(own, parts), &stops, rules);
        Self { host, group, ticks, is_silent }
    }
}

/// Returns the number of bytes that the state of a coordinator of the whole group has at most.
fn max_state_bytes(common: &CommonKnowledge) -> usize {
    let actions = common.max_actions();
    let block = samples_per_round(common).unwrap_or(0);
    // A player, a decision, and the numbers beside the predictions, of at most 10 bytes each.
    let numbers = 10 * (6 * actions + 2 * block.max(actions)) + 10 * block + 256;
    common.ids.len() * (common.max_message_bytes(block.max(actions)) + numbers) + 512
}

impl Participant for CoordinatorHostParticipant {
    fn progress(&self) -> ConversationProgress {
        let epochs = self.host.replicas.iter().map(|replica| replica.promised.number);
        ConversationProgress { epoch: epochs.max().unwrap_or(0), ..ConversationProgress::default() }
    }

    fn start(&mut self, tick: u64) {
        if self.is_silent {
            let me = self.host.rules.me;
            let others = (0..self.group.len()).filter(|&place| place != me).collect();
            return self.host.services.conclude_alone(others);
        }
        // A quarter of the time is left to bring the controls.
        self.host.services.sampling_end = tick.saturating_add(self.ticks / 4 * 3);
        self.host.start(tick);
    }

    fn on_message(
        &mut self,
        from: EntityId,
        message: &[u8],
        tick: u64,
    ) -> Result<(), InvalidMessage> {
        let place = self.group.binary_search(&from).map_err(|_| InvalidMessage::Airplane)?;
        if self.is_silent {
            return Ok(());
        }
        self.host.on_message(place, message, tick)
    }

    fn on_timer(&mut self, tick: u64) {
        if !self.is_silent {
            self.host.on_timer(tick);
        }
    }

    fn next_timer(&self) -> Option<u64> {
        self.host.next_timer().filter(|_| !self.is_silent)
    }

    /// Returns whether the airplane has its control, and no other one depends on it for now.
    fn is_done(&self) -> bool {
        self.host.services.end.is_some() && self.host.is_idle()
    }

    fn take_messages(&mut self) -> Vec<OutgoingMessage> {
        let queued = self.host.take_messages().into_iter();
        queued
            .map(|OutgoingHostMessage { to, message }| OutgoingMessage {
                to: to.map(|place| self.group[place]),
                message,
            })
            .collect()
    }

    fn max_message_bytes(&self) -> usize {
        HEADER_BYTES + max_state_bytes(&self.host.services.own.common)
    }
}

impl FinishableParticipant for CoordinatorHostParticipant {
    type Outcome = OptimizationResult;

    fn finish(&mut self) -> ConversationEnd<OptimizationResult> {
        match &self.host.services.end {
            Some(end) => end.clone(),
            None => ConversationEnd { outcome: None, unheard: Vec::new(), late: true },
        }
    }
}
