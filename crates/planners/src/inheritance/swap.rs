//! The swap operation: two agents who meet in a corridor go back to where they can pass each other.
//!
//! An agent that stands in the way of another, whose box it needs itself, goes away from its goal and draws the other
//! one after it, until there is room for both (Okumura 2023, "Improving LaCAM for scalable eventually optimal
//! multi-agent pathfinding", the swap operation of its configuration generator). It looks along the corridor only, and
//! agents of one box only: whether larger bodies can pass each other is no matter of the number of neighbors.

use super::{Inheritance, Status};
use crate::graph::NONE;

/// Most boxes of a corridor that are looked at: longer ones cost more time than the operation saves.
const MAX_CORRIDOR: usize = 128;

/// Two agents at neighboring boxes, of which the first follows the second along a corridor.
#[derive(Clone, Copy)]
struct Pair {
    pusher: usize,
    puller: usize,
    pusher_box: u32,
    puller_box: u32,
}

impl Inheritance {
    /// Returns the agent with whom an agent has to swap, if it can; none otherwise.
    pub(super) fn swap_partner(&mut self, agent: u32, wanted: u32) -> u32 {
        let now = self.members[agent as usize].now;
        if wanted == now || self.graphs.of(agent as usize).size() != 1 {
            return NONE;
        }
        let blocker = self.partner_at(wanted);
        if blocker != NONE && blocker != agent && self.must_swap(agent, blocker, [now, wanted]) {
            return blocker;
        }
        self.partner_behind(agent, wanted)
    }

    /// Returns the undecided agent of one box that stands in a box, or none.
    fn partner_at(&self, at: u32) -> u32 {
        let other = self.occupied[at as usize];
        let is_partner = other != NONE
            && self.status[other as usize] == Status::Undecided
            && self.graphs.of(other as usize).size() == 1;
        if is_partner { other } else { NONE }
    }

    fn must_swap(&mut self, agent: u32, blocker: u32, [now, wanted]: [u32; 2]) -> bool {
        let pair = Pair {
            pusher: agent as usize,
            puller: blocker as usize,
            pusher_box: now,
            puller_box: wanted,
        };
        self.needs_swap(pair) && self.can_swap(agent as usize, [wanted, now])
    }

    /// Returns an agent beside this one that has to get past it, once this one has gone on: it makes room for that.
    fn partner_behind(&mut self, agent: u32, wanted: u32) -> u32 {
        let now = self.members[agent as usize].now;
        let exits = self.graphs.of(agent as usize).exits(now);
        for direction in (0..4).filter(|direction| exits >> direction & 1 == 1) {
            let behind = self.graphs.of(agent as usize).step(now, direction);
            let other = self.occupied[behind as usize];
            if behind == wanted || other == NONE || self.graphs.of(other as usize).size() != 1 {
                continue;
            }
            let pair = Pair {
                pusher: other as usize,
                puller: agent as usize,
                pusher_box: now,
                puller_box: wanted,
            };
            if self.needs_swap(pair) && self.can_swap(agent as usize, [wanted, now]) {
                return other;
            }
        }
        NONE
    }

    /// Returns whether the pusher cannot reach its goal behind the puller but by changing places with it: it pushes the
    /// puller along the corridor to see.
    fn needs_swap(&mut self, mut pair: Pair) -> bool {
        for _ in 0..MAX_CORRIDOR {
            if !self.is_closer(pair.pusher, pair.pusher_box, pair.puller_box) {
                break;
            }
            match self.corridor_exit(pair.pusher, pair.pusher_box, pair.puller_box) {
                Exit::Several => return false,
                Exit::One(next) => {
                    pair.pusher_box = pair.puller_box;
                    pair.puller_box = next;
                }
                Exit::End => break,
            }
        }
        self.is_closer(pair.puller, pair.puller_box, pair.pusher_box)
            && (self.members[pair.pusher].goal == pair.pusher_box
                || self.is_closer(pair.pusher, pair.pusher_box, pair.puller_box))
    }

    /// Returns whether a corridor that is entered from `first` through `origin` leads to a place with room for both.
    fn can_swap(&mut self, agent: usize, [first, origin]: [u32; 2]) -> bool {
        // The one that goes ahead is now the agent itself, away from the box that it wants.
        let mut behind = first;
        let mut ahead = origin;
        for _ in 0..MAX_CORRIDOR {
            match self.corridor_exit(agent, behind, ahead) {
                Exit::Several => return true,
                Exit::End => return false,
                Exit::One(next) => {
                    behind = ahead;
                    ahead = next;
                }
            }
            // A ring without any branch.
            if ahead == first {
                return false;
            }
        }
        false
    }

    /// Returns where a corridor leads from a box that was entered from another. A dead end with an agent at its goal is
    /// no exit.
    fn corridor_exit(&self, agent: usize, from: u32, at: u32) -> Exit {
        let graph = self.graphs.of(agent);
        let mut exit = Exit::End;
        for (_, neighbor) in graph.neighbors(at) {
            if neighbor == from || self.is_full_dead_end(agent, neighbor) {
                continue;
            }
            if exit != Exit::End {
                return Exit::Several;
            }
            exit = Exit::One(neighbor);
        }
        exit
    }

    fn is_full_dead_end(&self, agent: usize, at: u32) -> bool {
        let other = self.occupied[at as usize];
        other != NONE
            && self.members[other as usize].goal == at
            && self.graphs.of(agent).exits(at).count_ones() == 1
    }

    /// Returns whether a neighboring box is closer to the goal of an agent.
    fn is_closer(&mut self, agent: usize, from: u32, to: u32) -> bool {
        let closer = self.closer(agent, from);
        let direction = self.graphs.of(agent).direction(from, to);
        direction.is_some_and(|direction| closer >> direction & 1 == 1)
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Exit {
    End,
    One(u32),
    Several,
}
