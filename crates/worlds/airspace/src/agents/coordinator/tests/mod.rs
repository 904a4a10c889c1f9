//! The protocol of hosts with a small coordinator aboard: the hosts are the real ones.

mod chaos;
mod interleavings;
mod recovery;

use super::epoch::CoordinatorEpoch;
use super::host::CoordinatorHost;
use super::migrating::{
    CoordinatorHostConfig, CoordinatorHostContext, CoordinatorHostServices,
    CoordinatorItineraryStep, MigratingCoordinator,
};
use crate::agents::participant::InvalidMessage;
use serde::{Deserialize, Serialize};
use sidestep_kernel::network::RetryPolicy;

/// A coordinator that visits all hosts, returns, and tells all how it was: in each of some rounds, the
/// last of which ends with the telling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct TestCoordinator {
    rounds_left: u8,
    task: TestTask,
    unreachable: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum TestTask {
    Visit(u8),
    Return,
    Deliver(u8),
}

/// A host of tourists.
#[derive(Debug, Clone)]
struct TestHost {
    me: usize,
    group: usize,
    rounds: u8,
    /// Whether the coordinator that is here has waited: it stays until anything happens.
    is_rested: bool,
    /// Whether coordinators do not wait here.
    is_restless: bool,
    /// The epoch of the coordinator that has delivered the result.
    concluded: Option<CoordinatorEpoch>,
    is_cut_off: bool,
}

impl CoordinatorHostServices for TestHost {
    fn is_awaiting_coordinator(&self, _: usize) -> bool {
        !self.is_done()
    }

    fn on_no_majority(&mut self, _: usize, _: &[usize]) {
        self.is_cut_off = true;
    }
}

impl TestHost {
    fn is_done(&self) -> bool {
        self.concluded.is_some() || self.is_cut_off
    }
}

impl TestCoordinator {
    /// Returns the next host from number `k` on, without those that cannot be reached.
    fn next(&self, k: u8, services: &TestHost) -> Option<u8> {
        let stays = |place: usize| place == services.me || self.unreachable[place];
        (k..services.group as u8).find(|&place| !stays(place.into()))
    }

    fn hop(
        &mut self,
        services: &TestHost,
        context: &CoordinatorHostContext<'_>,
    ) -> CoordinatorItineraryStep {
        loop {
            match self.task {
                TestTask::Visit(k) => match self.next(k, services) {
                    Some(next) => {
                        self.task = TestTask::Visit(next);
                        return CoordinatorItineraryStep::Hop(next.into());
                    }
                    None => self.task = TestTask::Return,
                },
                TestTask::Return => {
                    let home = usize::from(context.epochs[0].owner);
                    if home != services.me {
                        return CoordinatorItineraryStep::Hop(home);
                    }
                    self.rounds_left = self.rounds_left.saturating_sub(1);
                    self.task = if self.rounds_left > 0 {
                        TestTask::Visit(0)
                    } else {
                        TestTask::Deliver(0)
                    };
                }
                TestTask::Deliver(k) => match self.next(k, services) {
                    Some(next) => {
                        self.task = TestTask::Deliver(next);
                        return CoordinatorItineraryStep::Hop(next.into());
                    }
                    None => return CoordinatorItineraryStep::Done,
                },
            }
        }
    }
}

impl MigratingCoordinator for TestCoordinator {
    type Services = TestHost;

    fn new(services: &TestHost, _: usize) -> Self {
        let unreachable = vec![false; services.group];
        Self { rounds_left: services.rounds, task: TestTask::Visit(0), unreachable }
    }

    fn encode(&self) -> Vec<u8> {
        postcard::to_stdvec(self).expect("plain data")
    }

    fn decode(bytes: &[u8], services: &TestHost, _: usize) -> Result<Self, InvalidMessage> {
        let read: Self = postcard::from_bytes(bytes).map_err(|_| InvalidMessage::Form)?;
        InvalidMessage::Length.ensure(read.unreachable.len() == services.group)?;
        Ok(read)
    }

    fn advance(
        &mut self,
        services: &mut TestHost,
        context: &CoordinatorHostContext<'_>,
    ) -> CoordinatorItineraryStep {
        if !services.is_restless && !std::mem::replace(&mut services.is_rested, true) {
            return CoordinatorItineraryStep::Stay;
        }
        self.unreachable[services.me] = false;
        let step = self.hop(services, context);
        if matches!(self.task, TestTask::Deliver(_)) {
            services.concluded.get_or_insert(context.epochs[0]);
        }
        services.is_rested = false;
        step
    }

    fn on_unreachable(&mut self, place: usize) {
        self.unreachable[place] = true;
    }

    fn is_done_without(&self, place: usize) -> bool {
        let TestTask::Deliver(k) = self.task else { return false };
        (usize::from(k)..self.unreachable.len()).all(|k| k == place || self.unreachable[k])
    }
}

/// Returns the hosts of a group.
fn hosts(
    group: usize,
    rounds: u8,
    patience: RetryPolicy,
    miss_ticks: u64,
) -> Vec<CoordinatorHost<TestCoordinator>> {
    let host = |me: usize| {
        let services = TestHost {
            me,
            group,
            rounds,
            is_rested: false,
            is_restless: false,
            concluded: None,
            is_cut_off: false,
        };
        let expected = vec![true; group];
        let rules = CoordinatorHostConfig {
            group,
            me,
            retry_policy: Some(patience),
            expected,
            election_timeout_ticks: miss_ticks,
        };
        CoordinatorHost::new(services, &[(0..group).collect()], rules)
    };
    (0..group).map(host).collect()
}
