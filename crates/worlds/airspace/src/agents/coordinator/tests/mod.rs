//! The protocol of hosts with a small coordinator aboard: the hosts are the real ones.

mod chaos;
mod interleavings;
mod recovery;

use super::epoch::Epoch;
use super::host::Hosting;
use super::passenger::{Here, Passenger, Rules, Ship, Step};
use crate::agents::party::Unsound;
use serde::{Deserialize, Serialize};
use sidestep_kernel::network::Patience;

/// A coordinator that visits all hosts, returns, and tells all how it was: in each of some rounds, the
/// last of which ends with the telling.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Tourist {
    rounds_left: u8,
    task: Task,
    unreachable: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
enum Task {
    Visit(u8),
    Return,
    Tell(u8),
}

/// A host of tourists.
#[derive(Debug, Clone)]
struct Hotel {
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

impl Ship for Hotel {
    fn watches(&self, _: usize) -> bool {
        !self.is_done()
    }

    fn cut_off(&mut self, _: usize, _: &[usize]) {
        self.is_cut_off = true;
    }
}

impl Hotel {
    fn is_done(&self) -> bool {
        self.told.is_some() || self.is_cut_off
    }
}

impl Tourist {
    /// Returns the next host from number `k` on, without those that cannot be reached.
    fn next(&self, k: u8, hotel: &Hotel) -> Option<u8> {
        let stays = |place: usize| place == hotel.me || self.unreachable[place];
        (k..hotel.group as u8).find(|&place| !stays(place.into()))
    }

    fn hop(&mut self, hotel: &Hotel, here: &Here<'_>) -> Step {
        loop {
            match self.task {
                Task::Visit(k) => match self.next(k, hotel) {
                    Some(next) => {
                        self.task = Task::Visit(next);
                        return Step::Hop(next.into());
                    }
                    None => self.task = Task::Return,
                },
                Task::Return => {
                    let home = usize::from(here.epochs[0].owner);
                    if home != hotel.me {
                        return Step::Hop(home);
                    }
                    self.rounds_left = self.rounds_left.saturating_sub(1);
                    self.task = if self.rounds_left > 0 { Task::Visit(0) } else { Task::Tell(0) };
                }
                Task::Tell(k) => match self.next(k, hotel) {
                    Some(next) => {
                        self.task = Task::Tell(next);
                        return Step::Hop(next.into());
                    }
                    None => return Step::Over,
                },
            }
        }
    }
}

impl Passenger for Tourist {
    type Ship = Hotel;

    fn new(hotel: &Hotel, _: usize) -> Self {
        let unreachable = vec![false; hotel.group];
        Self { rounds_left: hotel.rounds, task: Task::Visit(0), unreachable }
    }

    fn written(&self) -> Vec<u8> {
        postcard::to_stdvec(self).expect("plain data")
    }

    fn read(bytes: &[u8], hotel: &Hotel, _: usize) -> Result<Self, Unsound> {
        let read: Self = postcard::from_bytes(bytes).map_err(|_| Unsound::Form)?;
        Unsound::Length.unless(read.unreachable.len() == hotel.group)?;
        Ok(read)
    }

    fn go_on(&mut self, hotel: &mut Hotel, here: &Here<'_>) -> Step {
        if !hotel.is_restless && !std::mem::replace(&mut hotel.is_rested, true) {
            return Step::Stay;
        }
        self.unreachable[hotel.me] = false;
        let step = self.hop(hotel, here);
        if matches!(self.task, Task::Tell(_)) {
            hotel.told.get_or_insert(here.epochs[0]);
        }
        hotel.is_rested = false;
        step
    }

    fn cannot_reach(&mut self, place: usize) {
        self.unreachable[place] = true;
    }

    fn is_over_without(&self, place: usize) -> bool {
        let Task::Tell(k) = self.task else { return false };
        (usize::from(k)..self.unreachable.len()).all(|k| k == place || self.unreachable[k])
    }
}

/// Returns the hosts of a group.
fn hosts(group: usize, rounds: u8, patience: Patience, miss_ticks: u64) -> Vec<Hosting<Tourist>> {
    let host = |me: usize| {
        let (is_rested, is_restless, told, is_cut_off) = (false, false, None, false);
        let hotel = Hotel { me, group, rounds, is_rested, is_restless, told, is_cut_off };
        let expected = vec![true; group];
        let rules = Rules { group, me, patience: Some(patience), expected, miss_ticks };
        Hosting::new(hotel, &[(0..group).collect()], rules)
    };
    (0..group).map(host).collect()
}
