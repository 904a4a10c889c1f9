//! The local search after the rounds, by agents that each know only the costs of their own pairs.
//!
//! Each tells its starts and neighbors, then its part of the bound, and then step by step the costs of its actions and
//! its best moves: the functions that one process runs for all, on the same numbers.

use crate::agents::ReachedCost;
use crate::agents::participant::InvalidMessage;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Descents, PairMove, PairwiseGame, PlayerCosts, is_at_bound};
use std::collections::BTreeMap;

/// Messages of the local search.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub enum SearchMessage {
    /// Where the sender starts.
    Start(SearchStart),
    /// The costs of the first start.
    Bound(SearchBound),
    /// The costs of the sender's actions, one entry for each descent that goes on.
    Costs {
        /// Number of the step, from 0.
        step: u32,
        /// The costs.
        costs: Vec<PlayerCosts>,
    },
    /// The sender's best moves, one entry for each descent that goes on.
    Moves {
        /// Number of the step, from 0.
        step: u32,
        /// The moves; none where nothing saves anything.
        moves: Vec<Option<PairMove>>,
    },
}

/// Where an agent starts.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct SearchStart {
    /// Its actions, one for each start.
    actions: Vec<u32>,
    /// Places of those with which it shares a cost, rising.
    neighbors: Vec<u32>,
}

/// What the first start costs.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct SearchBound {
    /// The sender's part of the cost.
    cost: f64,
    /// The sender's part of a lower bound.
    bound: f64,
}

/// What the agents of the group are, as far as messages to one of them may name them.
pub(super) struct SearchLimits<'a> {
    /// Number of actions of each member.
    pub(super) actions: &'a [usize],
    /// Number of starts.
    pub(super) starts: usize,
}

impl SearchMessage {
    /// Returns the largest number of messages of an agent, and of bytes of one.
    pub(super) fn limits(starts: usize, actions: usize, group: usize) -> (u32, usize) {
        // A number takes 8 bytes, a place or the number of an action at most 5, and a length at most 10.
        let start = 5 * (starts + group) + 20;
        let costs = starts * (8 * actions + 18) + 15;
        let moves = starts * 25 + 15;
        (2 + 2 * Descents::MAX_STEPS, start.max(costs).max(moves))
    }

    /// Checks a message of the agent at place `from`.
    ///
    /// # Errors
    /// When its content is impossible.
    pub(super) fn check(
        &self,
        from: usize,
        limits: &SearchLimits<'_>,
    ) -> Result<(), InvalidMessage> {
        let SearchLimits { actions, starts } = *limits;
        match self {
            Self::Start(start) => {
                InvalidMessage::Length.ensure(start.actions.len() == starts)?;
                let has_actions = start.actions.iter().all(|&x| (x as usize) < actions[from]);
                InvalidMessage::Number.ensure(has_actions)?;
                let are_rising = start.neighbors.is_sorted_by(|a, b| a < b);
                let is_member =
                    |&place: &u32| (place as usize) < actions.len() && place as usize != from;
                InvalidMessage::Airplane.ensure(are_rising && start.neighbors.iter().all(is_member))
            }
            Self::Bound(SearchBound { cost, bound }) => {
                InvalidMessage::Number.ensure(is_cost(*cost) && is_cost(*bound))
            }
            Self::Costs { step, costs } => {
                InvalidMessage::Round.ensure(*step < Descents::MAX_STEPS)?;
                let fits = |one: &PlayerCosts| one.given.len() == actions[from];
                InvalidMessage::Length.ensure(costs.len() <= starts && costs.iter().all(fits))?;
                let has_costs = |one: &PlayerCosts| {
                    is_cost(one.cost) && one.given.iter().all(|cost| is_cost(*cost))
                };
                InvalidMessage::Number.ensure(costs.iter().all(has_costs))
            }
            Self::Moves { step, moves } => {
                InvalidMessage::Round.ensure(*step < Descents::MAX_STEPS)?;
                InvalidMessage::Length.ensure(moves.len() <= starts)?;
                moves.iter().flatten().try_for_each(|one| {
                    InvalidMessage::Number
                        .ensure(is_cost(one.gain) && one.strategy < actions[from])?;
                    let Some((partner, strategy)) = one.partner else { return Ok(()) };
                    // Moves of two are those of the one whose place is first.
                    InvalidMessage::Airplane.ensure(from < partner && partner < actions.len())?;
                    InvalidMessage::Number.ensure(strategy < actions[partner])
                })
            }
        }
    }
}

/// Returns whether a number may be a cost. Large ones are accepted, unless their sum would not be a number.
fn is_cost(cost: f64) -> bool {
    (0.0..1e60).contains(&cost)
}

/// What an agent has heard, or said itself, in the local search.
#[derive(Debug, Default)]
pub(super) struct SearchMember {
    start: Option<SearchStart>,
    bound: Option<SearchBound>,
    costs: BTreeMap<u32, Vec<PlayerCosts>>,
    moves: BTreeMap<u32, Vec<Option<PairMove>>>,
}

impl SearchMember {
    /// Keeps a message.
    pub(super) fn receive(&mut self, message: SearchMessage) {
        match message {
            SearchMessage::Start(start) => self.start = Some(start),
            SearchMessage::Bound(bound) => self.bound = Some(bound),
            SearchMessage::Costs { step, costs } => {
                self.costs.insert(step, costs);
            }
            SearchMessage::Moves { step, moves } => {
                self.moves.insert(step, moves);
            }
        }
    }
}

/// A member of the group in the local search of an agent.
pub(super) struct SearchPeer<'a> {
    /// What it has said.
    pub(super) said: &'a SearchMember,
    /// Whether nothing more is heard from it: it keeps its action.
    pub(super) is_gone: bool,
    /// The action that it has chosen after the rounds, as far as is known.
    pub(super) chosen: usize,
    /// Number of its actions in the agent's game.
    pub(super) actions: usize,
}

/// The messages that an agent waits for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum SearchPhase {
    Starts,
    Bounds,
    Costs,
    Moves,
    Over,
}

/// The local search of an agent.
#[derive(Debug)]
pub(super) struct LocalSearchAgent {
    me: usize,
    phase: SearchPhase,
    descents: Descents,
    /// What the joint action costs, once that is known.
    reached: Option<ReachedCost>,
}

/// The result of a step of the local search.
pub(super) enum SearchStep {
    /// It has a message to send.
    Send(SearchMessage),
    /// It is over.
    Over,
}

impl LocalSearchAgent {
    /// Returns the search of the agent at place `me` with its first message, from its own starts.
    pub(super) fn new(game: &PairwiseGame, me: usize, actions: &[usize]) -> (Self, SearchMessage) {
        let start = SearchStart {
            actions: actions.iter().map(|&x| x as u32).collect(),
            neighbors: game.neighbors(me).map(|place| place as u32).collect(),
        };
        let descents = Descents::default();
        let search = Self { me, phase: SearchPhase::Starts, descents, reached: None };
        (search, SearchMessage::Start(start))
    }

    /// Returns whether a member has said what the next step needs.
    pub(super) fn has_heard(&self, said: &SearchMember) -> bool {
        let step = self.descents.steps();
        match self.phase {
            SearchPhase::Starts => said.start.is_some(),
            SearchPhase::Bounds => said.bound.is_some(),
            SearchPhase::Costs => said.costs.contains_key(&step),
            SearchPhase::Moves => said.moves.contains_key(&step),
            SearchPhase::Over => true,
        }
    }

    /// Takes the next step, for which no message is missing.
    pub(super) fn step(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        match self.phase {
            SearchPhase::Starts => {
                self.descents = start_descents(game, self.me, group);
                self.phase = SearchPhase::Bounds;
                SearchStep::Send(SearchMessage::Bound(self.own_bound(game)))
            }
            SearchPhase::Bounds => self.check_bound(game, group),
            SearchPhase::Costs => self.propose_moves(game, group),
            SearchPhase::Moves => self.make_moves(game, group),
            SearchPhase::Over => SearchStep::Over,
        }
    }

    fn own_bound(&self, game: &PairwiseGame) -> SearchBound {
        SearchBound {
            cost: game.player_cost(self.descents.first_joint(), self.me),
            bound: game.bound_part(self.me, &self.descents.neighbor_counts()),
        }
    }

    /// Ends the search if the first start is a minimum, or begins to descend.
    fn check_bound(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        // One that was not heard adds the costs of its only action to both.
        let parts = || group.iter().filter_map(|peer| peer.said.bound);
        let cost = parts().fold(0.0, |sum, part| sum + part.cost);
        let bound = parts().fold(0.0, |sum, part| sum + part.bound);
        self.reached = Some(ReachedCost { cost, bound });
        if is_at_bound(cost, bound) {
            self.phase = SearchPhase::Over;
            return SearchStep::Over;
        }
        self.send_costs(game)
    }

    fn send_costs(&mut self, game: &PairwiseGame) -> SearchStep {
        self.phase = SearchPhase::Costs;
        let step = self.descents.steps();
        let costs = self.descents.player_costs(game, self.me);
        SearchStep::Send(SearchMessage::Costs { step, costs })
    }

    /// Returns its best moves by the costs of all.
    fn propose_moves(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        let step = self.descents.steps();
        for (place, peer) in group.iter().enumerate() {
            // Agents that have lost different messages may have different descents that go on.
            let said = peer.said.costs.get(&step).filter(|_| peer.actions > 1);
            let costs = said.filter(|costs| costs.len() == self.descents.count_open());
            match costs {
                Some(costs) => self.descents.set_player_costs(place, costs.clone()),
                None => self.descents.keep_strategy(game, place),
            }
        }
        self.phase = SearchPhase::Moves;
        let moves = self.descents.player_moves(game, self.me);
        SearchStep::Send(SearchMessage::Moves { step, moves })
    }

    /// Makes the moves of all, and ends the search when nobody has any.
    fn make_moves(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        let step = self.descents.steps();
        let mut moves = Vec::with_capacity(group.len());
        for peer in group {
            let said = peer.said.moves.get(&step).filter(|_| !peer.is_gone && peer.actions > 1);
            let mut of_peer = said.cloned().unwrap_or_default();
            for one in of_peer.iter_mut().flatten() {
                // One that was not heard has no other action here.
                let is_known = |&(partner, x): &(usize, usize)| x < group[partner].actions;
                one.partner = one.partner.filter(is_known);
            }
            moves.push(of_peer);
        }
        self.descents.step(&moves);
        if self.descents.count_open() > 0 {
            return self.send_costs(game);
        }
        self.phase = SearchPhase::Over;
        if let Some(reached) = &mut self.reached {
            reached.cost = self.descents.best_cost();
        }
        SearchStep::Over
    }

    /// Returns what the joint action costs that it has come to, as far as it knows.
    pub(super) fn reached(&self) -> Option<ReachedCost> {
        self.reached
    }

    /// Returns its action and the costs of all of its actions beside those of the others, if it has descended to its
    /// end.
    pub(super) fn end(&self) -> Option<(usize, &[f64])> {
        let is_over = self.phase == SearchPhase::Over && self.descents.steps() > 0;
        is_over
            .then(|| (self.descents.best_joint()[self.me], self.descents.best_costs_given(self.me)))
    }
}

/// Returns the descents from the starts of all. One that has not told its starts keeps the action that it has chosen.
fn start_descents(game: &PairwiseGame, me: usize, group: &[SearchPeer<'_>]) -> Descents {
    let count = group[me].said.start.as_ref().map_or(0, |start| start.actions.len());
    let mut starts = Vec::with_capacity(group.len());
    let mut neighbors = Vec::with_capacity(group.len());
    for (place, peer) in group.iter().enumerate() {
        match peer.said.start.as_ref().filter(|_| peer.actions > 1) {
            Some(start) => {
                starts.push(start.actions.iter().map(|&x| x as usize).collect());
                neighbors.push(start.neighbors.iter().map(|&place| place as usize).collect());
            }
            None => {
                starts.push(vec![peer.chosen; count]);
                // The agent knows of no pairs but its own.
                let is_neighbor = game.neighbors(me).any(|neighbor| neighbor == place);
                neighbors.push(if is_neighbor { vec![me] } else { Vec::new() });
            }
        }
    }
    Descents::new(neighbors, &starts)
}
