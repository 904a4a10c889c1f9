//! Priority inheritance with backtracking: the next boxes of all agents at one step.
//!
//! An agent reserves the box that it likes best of those around it. Whoever stands there inherits its priority and has
//! to find a box in turn, before anybody else; if it cannot, the agent tries its next box (Okumura et al. 2022,
//! "Priority inheritance with backtracking for iterative multi-agent path finding", algorithm 1).
//!
//! **Bodies of n x n boxes.** A body may have to push several others at once. Those pushed before the last one may not
//! enter boxes of agents that wait for them, because these may still have to stay: so what was decided is never undone,
//! and each agent is asked once per step. The last one may, as in the paper, where it closes a circle. A body that
//! cannot leave the way in one step, because it is pushed to a side where it needs several, begins to, while the other
//! one waits.
//!
//! **Headings.** Boxes are chosen as if agents had no heading; of boxes as near to the goal, one ahead is preferred.
//! Then an agent that first has to turn holds its box and turns, and so do all that would enter a box that is held.
//! What remains of the moves is free of conflicts, because it is a part of moves that are.
//!
//! The pushes are a stack of our own, because a chain of ten thousand agents in a corridor would exhaust a thread's.

mod swap;

use crate::descent::{DescentCache, FieldKey};
use crate::graph::{Graphs, NONE};
use crate::pose::{Action, ActionModel, first_turn, quarter_turns};

/// Reserves a box for a body that is no agent: the number of no agent.
const OTHERS: u32 = NONE - 1;

/// What an agent needs to choose its box.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Member {
    /// The box where it stands; none if its body does not fit there.
    pub(crate) now: u32,
    pub(crate) heading: u8,
    /// The box of its goal, or none.
    pub(crate) goal: u32,
    /// Random bits for each direction, which decide between boxes that are equal otherwise.
    pub(crate) ties: [u32; 4],
    /// Whether it may go away from its goal to let another one pass.
    pub(crate) may_swap: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Status {
    Undecided,
    /// It has reserved a box, and waits for those whom it pushes; the number is its depth in the stack.
    Open(u32),
    Decided,
}

/// An agent that is about to find a box.
#[derive(Debug, Clone, Copy)]
struct Frame {
    agent: u32,
    /// Boxes in the order of its preference.
    candidates: [u32; 5],
    len: u8,
    cursor: u8,
    /// The agent to draw to its present box if it gets its first candidate, or none.
    partner: u32,
    /// Where the agents that it pushes begin on their stack.
    first: usize,
    /// The next of them.
    pending: usize,
    /// Boxes of open agents at a lower depth are forbidden.
    barrier: u32,
    /// Whether it only begins to make way, and the one that pushes it no longer waits for that.
    is_sidestep: bool,
}

/// One step of all agents. The buffers mean nothing between steps.
#[derive(Debug, Clone)]
pub(crate) struct Inheritance {
    pub(crate) graphs: Graphs,
    model: ActionModel,
    /// Whether agents may go in a circle, each into the box that the next one leaves.
    has_circles: bool,
    cache: DescentCache,
    members: Vec<Member>,
    /// The box of each agent after the step.
    next: Vec<u32>,
    status: Vec<Status>,
    /// The direction in which an agent wants to go; 4 is none.
    wishes: Vec<u8>,
    /// Who covers a box before the step, and after it.
    occupied: Vec<u32>,
    reserved: Vec<u32>,
    frames: Vec<Frame>,
    pushed: Vec<u32>,
    /// Agents that hold their box.
    holders: Vec<u32>,
    /// An agent had to stay where another one goes.
    is_broken: bool,
}

impl Inheritance {
    pub(crate) fn new(graphs: Graphs, model: ActionModel, max_cache_bytes: usize) -> Self {
        let boxes = graphs.all().first().map_or(0, |graph| graph.len());
        let agents = graphs.agents();
        Self {
            cache: DescentCache::new(graphs.all(), max_cache_bytes),
            model,
            has_circles: true,
            members: Vec::with_capacity(agents),
            next: vec![NONE; agents],
            status: vec![Status::Undecided; agents],
            wishes: vec![4; agents],
            occupied: vec![NONE; boxes],
            reserved: vec![NONE; boxes],
            frames: Vec::new(),
            pushed: Vec::new(),
            holders: Vec::new(),
            is_broken: false,
            graphs,
        }
    }

    /// Sets whether agents may go in circles.
    pub(crate) fn with_circles(self, has_circles: bool) -> Self {
        Self { has_circles, ..self }
    }

    /// Begins a step: nobody has a box yet. The members are those that [`Inheritance::place`] adds then, in their
    /// order.
    pub(crate) fn begin(&mut self) {
        self.cache.begin_step();
        self.members.clear();
        self.next.fill(NONE);
        self.status.fill(Status::Undecided);
        self.wishes.fill(4);
        self.occupied.fill(NONE);
        self.reserved.fill(NONE);
        self.is_broken = false;
    }

    /// Places the next agent. Returns whether its body fits and overlaps no other that was placed before it; otherwise
    /// the agent will wait, and nobody enters its boxes.
    pub(crate) fn place(&mut self, member: Member, position: (u32, u32)) -> bool {
        let agent = self.members.len();
        self.members.push(member);
        let graph = self.graphs.of(agent);
        let is_free = member.now != NONE
            && graph.body(member.now).all(|covered| self.occupied[covered] == NONE);
        if is_free {
            for covered in graph.body(member.now) {
                self.occupied[covered] = agent as u32;
            }
            return true;
        }
        for covered in graph.clipped_body(position) {
            self.reserved[covered as usize] = agent as u32;
        }
        self.next[agent] = member.now;
        self.status[agent] = Status::Decided;
        false
    }

    /// Lets nobody enter a box; outside of the grid, nobody does.
    pub(crate) fn block(&mut self, position: (u32, u32)) {
        let index = self.graphs.all().first().and_then(|graph| graph.index(position));
        if let Some(index) = index {
            self.reserved[index as usize] = OTHERS;
        }
    }

    /// Lets an agent stay, which must be before any other has a box.
    pub(crate) fn stay(&mut self, agent: usize) {
        if self.status.get(agent) == Some(&Status::Undecided) {
            self.decide(agent, self.members[agent].now);
        }
    }

    /// Gives an agent its box after the step. Returns whether nobody else has it.
    pub(crate) fn force(&mut self, agent: usize, to: u32) -> bool {
        let now = self.members[agent].now;
        let graph = self.graphs.of(agent);
        for covered in graph.body(to) {
            if self.reserved[covered] != NONE || self.swaps(agent, now, self.occupied[covered]) {
                return false;
            }
        }
        self.decide(agent, to);
        true
    }

    /// Finds a box for each agent that has none yet; those that come first in the order have priority.
    pub(crate) fn run(&mut self, order: impl Iterator<Item = u32>) {
        for agent in order {
            if self.status[agent as usize] == Status::Undecided {
                self.inherit(agent);
            }
        }
    }

    /// Returns whether an agent had to stay where another one goes, which can happen only if boxes were forced.
    pub(crate) fn is_broken(&self) -> bool {
        self.is_broken
    }

    /// Returns the box of an agent after the step.
    pub(crate) fn next(&self, agent: usize) -> u32 {
        self.next[agent]
    }

    /// Lets hold their box all agents that first have to turn, and those that would enter a held box.
    pub(crate) fn hold(&mut self) {
        if self.model == ActionModel::Classical {
            return;
        }
        self.holders.clear();
        for agent in 0..self.members.len() {
            let member = self.members[agent];
            let direction = self.direction_of_move(agent);
            if direction.is_some_and(|direction| direction != member.heading) {
                self.holders.push(agent as u32);
            }
        }
        while let Some(holder) = self.holders.pop() {
            self.hold_one(holder as usize);
        }
    }

    /// Returns the action of an agent, after [`Inheritance::hold`].
    pub(crate) fn action(&self, agent: usize) -> Action {
        let member = self.members[agent];
        match (self.model, self.direction_of_move(agent)) {
            (ActionModel::Turns, Some(_)) => Action::Forward,
            (ActionModel::Turns, None) if self.wishes[agent] < 4 => {
                first_turn(member.heading, self.wishes[agent]).unwrap_or(Action::Wait)
            }
            (ActionModel::Classical, Some(direction)) => Action::Move(direction),
            (_, None) => Action::Wait,
        }
    }

    /// Gives an agent that stays a turn of its own, or none.
    pub(crate) fn set_turn(&mut self, agent: usize, turn: Action) {
        let heading = self.members[agent].heading;
        self.wishes[agent] = match turn {
            Action::TurnLeft => (heading + 1) % 4,
            Action::TurnRight => (heading + 3) % 4,
            _ => heading,
        };
    }

    fn hold_one(&mut self, agent: usize) {
        let now = self.members[agent].now;
        let to = self.next[agent];
        if to == now {
            return;
        }
        for covered in self.graphs.of(agent).body(to) {
            if self.reserved[covered] == agent as u32 {
                self.reserved[covered] = NONE;
            }
        }
        self.next[agent] = now;
        for covered in self.graphs.of(agent).body(now) {
            let follower = std::mem::replace(&mut self.reserved[covered], agent as u32);
            if follower < OTHERS && follower != agent as u32 {
                self.holders.push(follower);
            }
        }
    }

    fn direction_of_move(&self, agent: usize) -> Option<u8> {
        let now = self.members[agent].now;
        let to = self.next[agent];
        if now == to { None } else { self.graphs.of(agent).direction(now, to) }
    }

    /// Finds a box for an agent, and for all whom it pushes.
    fn inherit(&mut self, root: u32) {
        self.open(root, 0);
        while let Some(top) = self.frames.len().checked_sub(1) {
            let closed = self.advance(top);
            // The box of an agent whose push failed is lost.
            if closed == Some(false) && top > 0 {
                self.withdraw(top - 1);
            }
        }
    }

    /// Goes on with the agent on top. Returns whether it found a box, if that is decided.
    fn advance(&mut self, top: usize) -> Option<bool> {
        let agent = self.frames[top].agent as usize;
        if self.next[agent] == NONE && !self.propose(top) {
            if !self.frames[top].is_sidestep && self.sidestep(top) {
                return None;
            }
            let is_sidestep = self.frames[top].is_sidestep;
            self.close_in_place(top);
            return Some(is_sidestep);
        }
        while self.frames[top].pending < self.pushed.len() {
            let other = self.pushed[self.frames[top].pending];
            self.frames[top].pending += 1;
            if self.status[other as usize] == Status::Undecided {
                let is_last = self.frames[top].pending == self.pushed.len();
                let barrier = if is_last { self.frames[top].barrier } else { top as u32 + 1 };
                self.open(other, barrier);
                return None;
            }
        }
        let to = self.next[agent];
        let mut body = self.graphs.of(agent).body(to);
        // One that was pushed by others meanwhile may have had to stay.
        if body.any(|covered| self.reserved[covered] != agent as u32) {
            self.withdraw(top);
            return None;
        }
        self.close(top);
        Some(true)
    }

    /// Lets an agent that cannot leave the way of a large body in one step, or being one, begin to: the pusher gives up
    /// its candidate, and the agent tries the boxes where less of it is in the way. Returns false for agents of one
    /// box.
    fn sidestep(&mut self, top: usize) -> bool {
        let Some(below) = top.checked_sub(1) else { return false };
        let frame = self.frames[top];
        let agent = frame.agent as usize;
        let pusher = self.frames[below].agent as usize;
        // Of two agents of one box, each is either in the way or not.
        if self.graphs.of(agent).size() == 1 && self.graphs.of(pusher).size() == 1 {
            return false;
        }
        let wanted = self.next[pusher];
        let now = self.members[agent].now;
        let in_the_way = |at: u32| {
            let mut others = self.graphs.of(pusher).body(wanted);
            let body: Vec<usize> = self.graphs.of(agent).body(at).collect();
            others.by_ref().filter(|covered| body.contains(covered)).count()
        };
        let present = in_the_way(now);
        let mut candidates = [NONE; 5];
        let mut len = 0;
        for &to in &frame.candidates[..usize::from(frame.len)] {
            if in_the_way(to) < present {
                candidates[len] = to;
                len += 1;
            }
        }
        self.withdraw(below);
        let first = self.pushed.len();
        let frame = &mut self.frames[top];
        *frame = Frame {
            candidates,
            len: len as u8,
            cursor: 0,
            partner: NONE,
            first,
            pending: first,
            // The pusher may have to stay.
            barrier: top as u32,
            is_sidestep: true,
            ..*frame
        };
        let direction = self.graphs.of(agent).direction(now, candidates[0]);
        self.wishes[agent] = direction.unwrap_or(4);
        true
    }

    fn open(&mut self, agent: u32, barrier: u32) {
        let mut frame = Frame {
            agent,
            candidates: [NONE; 5],
            len: 0,
            cursor: 0,
            partner: NONE,
            first: self.pushed.len(),
            pending: self.pushed.len(),
            barrier,
            is_sidestep: false,
        };
        self.rank(&mut frame, Preference::Near);
        self.wishes[agent as usize] = self.first_direction(&frame);
        if self.members[agent as usize].may_swap {
            frame.partner = self.swap_partner(agent, frame.candidates[0]);
        }
        if frame.partner != NONE {
            self.rank(&mut frame, Preference::Far);
            self.wishes[agent as usize] = self.first_direction(&frame);
        }
        self.status[agent as usize] = Status::Open(self.frames.len() as u32);
        self.frames.push(frame);
    }

    /// Returns the direction to the first candidate, 4 if that is the present box.
    fn first_direction(&self, frame: &Frame) -> u8 {
        let agent = frame.agent as usize;
        let direction =
            self.graphs.of(agent).direction(self.members[agent].now, frame.candidates[0]);
        direction.unwrap_or(4)
    }

    /// Sorts the boxes that an agent can reach in one step: by their distance to the goal; of equal ones those that
    /// need fewer turns, then free ones, then by lot.
    fn rank(&mut self, frame: &mut Frame, preference: Preference) {
        let agent = frame.agent as usize;
        let member = self.members[agent];
        let closer = self.closer(agent, member.now);
        let graph = self.graphs.of(agent);
        let [closer_rank, farther_rank] = match preference {
            Preference::Near => [0, 2],
            Preference::Far => [2, 0],
        };
        let mut ranks = [(1u32 << 30, member.now); 5];
        let mut len = 1;
        for (direction, neighbor) in graph.neighbors(member.now) {
            let rise = if closer >> direction & 1 == 1 { closer_rank } else { farther_rank };
            let turns = match self.model {
                ActionModel::Turns => u32::from(quarter_turns(member.heading, direction)),
                ActionModel::Classical => 0,
            };
            let is_occupied = u32::from(self.occupied[neighbor as usize] != NONE);
            let tie = member.ties[usize::from(direction)] >> 5;
            ranks[len] = (rise << 30 | turns << 28 | is_occupied << 27 | tie, neighbor);
            len += 1;
        }
        ranks[..len].sort_unstable();
        for (candidate, (_, to)) in frame.candidates.iter_mut().zip(&ranks[..len]) {
            *candidate = *to;
        }
        frame.len = len as u8;
    }

    /// Returns the directions that lead from a box closer to the goal of an agent.
    #[inline]
    fn closer(&mut self, agent: usize, at: u32) -> u8 {
        let key = FieldKey { graph: self.graphs.index_of(agent), goal: self.members[agent].goal };
        self.cache.directions(self.graphs.all(), key, at)
    }

    /// Reserves the next candidate that is not taken, and lists those who have to leave it. Returns whether there is
    /// one.
    fn propose(&mut self, top: usize) -> bool {
        let frame = self.frames[top];
        let agent = frame.agent as usize;
        for cursor in frame.cursor..frame.len {
            let to = frame.candidates[usize::from(cursor)];
            if self.list_pushed(agent, to, frame.barrier) {
                self.frames[top].cursor = cursor;
                self.frames[top].pending = frame.first;
                self.next[agent] = to;
                for covered in self.graphs.of(agent).body(to) {
                    self.reserved[covered] = agent as u32;
                }
                return true;
            }
            self.pushed.truncate(frame.first);
        }
        false
    }

    /// Adds the undecided agents that stand where a body would be. Returns false if it cannot be there.
    fn list_pushed(&mut self, agent: usize, to: u32, barrier: u32) -> bool {
        let first = self.pushed.len();
        let now = self.members[agent].now;
        for covered in self.graphs.of(agent).body(to) {
            if self.reserved[covered] != NONE {
                return false;
            }
            let other = self.occupied[covered];
            if other == NONE || other == agent as u32 {
                continue;
            }
            if self.swaps(agent, now, other) {
                return false;
            }
            match self.status[other as usize] {
                Status::Open(depth) if depth < barrier || !self.has_circles => return false,
                Status::Undecided if !self.pushed[first..].contains(&other) => {
                    self.pushed.push(other);
                }
                _ => (),
            }
        }
        true
    }

    /// Returns whether another agent of one box goes to the box of this one, so that they would swap. Larger bodies
    /// would overlap.
    fn swaps(&self, agent: usize, now: u32, other: u32) -> bool {
        other != NONE
            && other != agent as u32
            && self.next[other as usize] == now
            && self.graphs.of(agent).size() == 1
            && self.graphs.of(other as usize).size() == 1
    }

    /// Gives up the candidate of an agent.
    fn withdraw(&mut self, top: usize) {
        let frame = &mut self.frames[top];
        frame.cursor += 1;
        self.pushed.truncate(frame.first);
        let agent = frame.agent;
        let to = self.next[agent as usize];
        for covered in self.graphs.of(agent as usize).body(to) {
            if self.reserved[covered] == agent {
                self.reserved[covered] = NONE;
            }
        }
        self.next[agent as usize] = NONE;
    }

    /// Ends with the reserved box, and draws the partner of a swap after the agent.
    fn close(&mut self, top: usize) {
        let frame = self.frames[top];
        let agent = frame.agent as usize;
        self.status[agent] = Status::Decided;
        self.pushed.truncate(frame.first);
        self.frames.truncate(top);
        let now = self.members[agent].now;
        if let Some(direction) = self.direction_of_move(agent) {
            self.wishes[agent] = direction;
        }
        let is_drawn = frame.partner != NONE
            && frame.cursor == 0
            && self.next[agent] != now
            && self.status[frame.partner as usize] == Status::Undecided
            && self.reserved[now as usize] == NONE;
        if is_drawn {
            self.decide(frame.partner as usize, now);
            let from = self.members[frame.partner as usize].now;
            let graph = self.graphs.of(frame.partner as usize);
            self.wishes[frame.partner as usize] = graph.direction(from, now).unwrap_or(4);
        }
    }

    /// Ends without any box but the present one.
    fn close_in_place(&mut self, top: usize) {
        let frame = self.frames[top];
        let agent = frame.agent as usize;
        self.pushed.truncate(frame.first);
        self.frames.truncate(top);
        let now = self.members[agent].now;
        for covered in self.graphs.of(agent).body(now) {
            let other = self.reserved[covered];
            if other < OTHERS && self.status[other as usize] == Status::Decided {
                self.is_broken = true;
            }
        }
        self.decide(agent, now);
    }

    fn decide(&mut self, agent: usize, to: u32) {
        self.status[agent] = Status::Decided;
        self.next[agent] = to;
        let now = self.members[agent].now;
        let graph = self.graphs.of(agent);
        if now != to {
            self.wishes[agent] = graph.direction(now, to).unwrap_or(4);
        }
        for covered in graph.body(to) {
            self.reserved[covered] = agent as u32;
        }
    }
}

/// The boxes that an agent tries first.
#[derive(Debug, Clone, Copy)]
enum Preference {
    /// Those near its goal.
    Near,
    /// Those far from it, to make way.
    Far,
}
