//! The protocol of hosts with a small coordinator aboard: the hosts are the real ones.

mod chaos;
mod interleavings;
mod recovery;

use super::epoch::Epoch;
use super::host::CoordinatorHost;
use super::migrating::{
    CoordinatorStep, HostConfig, HostContext, HostServices, MigratingCoordinator,
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
    Tell(u8),
}

/// A host of tourists.
#[derive(Debug, Clone)]
struct TestHost {
    me: usize,
    group: usize,
    rounds: u8,
    /// Whether the tourist that is here has had a rest: it stays until anything happens.
    is_rested: bool,
    /// Whether tourists need no rest here.
    is_restless: bool,
    /// The epoch of the one that has told it how it was.
    told: Option<Epoch>,
    is_cut_off: bool,
}

impl HostServices for TestHost {
    fn is_watching(&self, _: usize) -> bool {
        !self.is_done()
    }

    fn on_no_majority(&mut self, _: usize, _: &[usize]) {
        self.is_cut_off = true;
    }
}

impl TestHost {
    fn is_done(&self) -> bool {
        self.told.is_some() || self.is_cut_off
    }
}

impl TestCoordinator {
    /// Returns the next host from number `k` on, without those that cannot be reached.
    fn next(&self, k: u8, hotel: &TestHost) -> Option<u8> {
        let stays = |place: usize| place == hotel.me || self.unreachable[place];
        (k..hotel.group as u8).find(|&place| !stays(place.into()))
    }

    fn hop(&mut self, hotel: &TestHost, context: &HostContext<'_>) -> CoordinatorStep {
        loop {
            match self.task {
                TestTask::Visit(k) => match self.next(k, hotel) {
                    Some(next) => {
                        self.task = TestTask::Visit(next);
                        return CoordinatorStep::Hop(next.into());
                    }
                    None => self.task = TestTask::Return,
                },
                TestTask::Return => {
                    let home = usize::from(context.epochs[0].owner);
                    if home != hotel.me {
                        return CoordinatorStep::Hop(home);
                    }
                    self.rounds_left = self.rounds_left.saturating_sub(1);
                    self.task =
                        if self.rounds_left > 0 { TestTask::Visit(0) } else { TestTask::Tell(0) };
                }
                TestTask::Tell(k) => match self.next(k, hotel) {
                    Some(next) => {
                        self.task = TestTask::Tell(next);
                        return CoordinatorStep::Hop(next.into());
                    }
                    None => return CoordinatorStep::Done,
                },
            }
        }
    }
}

impl MigratingCoordinator for TestCoordinator {
    type Services = TestHost;

    fn new(hotel: &TestHost, _: usize) -> Self {
        let unreachable = vec![false; hotel.group];
        Self { rounds_left: hotel.rounds, task: TestTask::Visit(0), unreachable }
    }

    fn encode(&self) -> Vec<u8> {
        postcard::to_stdvec(self).expect("plain data")
    }

    fn decode(bytes: &[u8], hotel: &TestHost, _: usize) -> Result<Self, InvalidMessage> {
        let read: Self = postcard::from_bytes(bytes).map_err(|_| InvalidMessage::Form)?;
        InvalidMessage::Length.unless(read.unreachable.len() == hotel.group)?;
        Ok(read)
    }

    fn advance(&mut self, hotel: &mut TestHost, context: &HostContext<'_>) -> CoordinatorStep {
        if !hotel.is_restless && !std::mem::replace(&mut hotel.is_rested, true) {
            return CoordinatorStep::Stay;
        }
        self.unreachable[hotel.me] = false;
        let step = self.hop(hotel, context);
        if matches!(self.task, TestTask::Tell(_)) {
            hotel.told.get_or_insert(context.epochs[0]);
        }
        hotel.is_rested = false;
        step
    }

    fn on_unreachable(&mut self, place: usize) {
        self.unreachable[place] = true;
    }

    fn is_done_without(&self, place: usize) -> bool {
        let TestTask::Tell(k) = self.task else { return false };
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
        let (is_rested, is_restless, told, is_cut_off) = (false, false, None, false);
        let hotel = TestHost { me, group, rounds, is_rested, is_restless, told, is_cut_off };
        let expected = vec![true; group];
        let rules = HostConfig {
            group,
            me,
            retry_policy: Some(patience),
            expected,
            election_timeout_ticks: miss_ticks,
        };
        CoordinatorHost::new(hotel, &[(0..group).collect()], rules)
    };
    (0..group).map(host).collect()
}
