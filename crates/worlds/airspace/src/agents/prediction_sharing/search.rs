//! The local search after the rounds, by agents that each know only the costs of their own pairs.
//!
//! Each tells its starts and neighbors, then its part of the bound, and then step by step the costs of its actions and
//! its best moves: the functions that one process runs for all, on the same numbers.
//!
//! A member that was never heard is presumed to fly on, and has one action in the search of each. One that falls silent in
//! the midst of the search ends it: nobody knows which of the actions that were in discussion it flies, so that the others
//! fly what the rounds have chosen.

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
    /// Number of the last step that anybody can be in: no member is more than one ahead.
    pub(super) max_step: u32,
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
        let SearchLimits { actions, starts, max_step } = *limits;
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
                InvalidMessage::Round.ensure(*step <= max_step)?;
                let fits = |one: &PlayerCosts| one.given.len() == actions[from];
                InvalidMessage::Length.ensure(costs.len() <= starts && costs.iter().all(fits))?;
                let has_costs = |one: &PlayerCosts| {
                    is_cost(one.cost) && one.given.iter().all(|cost| is_cost(*cost))
                };
                InvalidMessage::Number.ensure(costs.iter().all(has_costs))
            }
            Self::Moves { step, moves } => {
                InvalidMessage::Round.ensure(*step <= max_step)?;
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
    /// Forgets what was said in earlier steps.
    pub(super) fn forget_before(&mut self, step: u32) {
        self.costs.retain(|said_in, _| *said_in >= step);
        self.moves.retain(|said_in, _| *said_in >= step);
    }

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
    /// Whether nothing more is heard from it.
    pub(super) is_gone: bool,
    /// Whether it was never heard, so that it has one action, which is presumed.
    pub(super) is_presumed: bool,
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
    /// Whether it has descended to its end.
    is_complete: bool,
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
        let phase = SearchPhase::Starts;
        let search = Self { me, phase, descents, reached: None, is_complete: false };
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

    /// Returns the number of steps made.
    pub(super) fn steps(&self) -> u32 {
        self.descents.steps()
    }

    /// Takes the next step, for which no message is missing but those of members that are gone.
    pub(super) fn step(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        let is_silent =
            |peer: &SearchPeer<'_>| peer.is_gone && !peer.is_presumed && !self.has_heard(peer.said);
        if group.iter().any(is_silent) {
            return self.give_up();
        }
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

    /// Ends the search without a result.
    fn give_up(&mut self) -> SearchStep {
        self.phase = SearchPhase::Over;
        self.is_complete = false;
        self.reached = None;
        SearchStep::Over
    }

    /// Ends the search if the first start is a minimum, or begins to descend.
    fn check_bound(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        let parts = || group.iter().filter_map(|peer| peer.said.bound);
        // The parts of one that is presumed are unknown, so that sums would be of different things.
        if parts().count() < group.len() {
            return self.send_costs(game);
        }
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
        let open = self.descents.count_open();
        for (place, peer) in group.iter().enumerate() {
            match peer.said.costs.get(&step) {
                _ if peer.is_presumed => self.descents.keep_strategy(game, place),
                Some(costs) if costs.len() == open => {
                    self.descents.set_player_costs(place, costs.clone());
                }
                // It has other descents: the two do not know the same.
                _ => return self.give_up(),
            }
        }
        self.phase = SearchPhase::Moves;
        let moves = self.descents.player_moves(game, self.me);
        SearchStep::Send(SearchMessage::Moves { step, moves })
    }

    /// Makes the moves of all, and ends the search when nobody has any.
    fn make_moves(&mut self, game: &PairwiseGame, group: &[SearchPeer<'_>]) -> SearchStep {
        let step = self.descents.steps();
        let open = self.descents.count_open();
        let mut moves = Vec::with_capacity(group.len());
        for peer in group {
            let mut of_peer = match peer.said.moves.get(&step) {
                _ if peer.is_presumed => Vec::new(),
                Some(moves) if moves.len() == open => moves.clone(),
                _ => return self.give_up(),
            };
            for offer in &mut of_peer {
                // One that is presumed has no other action here, and half of a move of two saves nothing.
                *offer = offer.filter(|offer| {
                    offer.partner.is_none_or(|(partner, _)| !group[partner].is_presumed)
                });
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
        self.is_complete = true;
        SearchStep::Over
    }

    /// Returns what the joint action costs that it has come to, as far as it knows.
    pub(super) fn reached(&self) -> Option<ReachedCost> {
        self.reached
    }

    /// Returns its action and the costs of all of its actions beside those of the others, if it has descended to its
    /// end.
    pub(super) fn end(&self) -> Option<(usize, &[f64])> {
        self.is_complete
            .then(|| (self.descents.best_joint()[self.me], self.descents.best_costs_given(self.me)))
    }
}

/// Returns the descents from the starts of all.
fn start_descents(game: &PairwiseGame, me: usize, group: &[SearchPeer<'_>]) -> Descents {
    let count = group[me].said.start.as_ref().map_or(0, |start| start.actions.len());
    let mut starts = Vec::with_capacity(group.len());
    let mut neighbors = Vec::with_capacity(group.len());
    for (place, peer) in group.iter().enumerate() {
        match &peer.said.start {
            Some(start) if !peer.is_presumed => {
                starts.push(start.actions.iter().map(|&x| x as usize).collect());
                neighbors.push(start.neighbors.iter().map(|&place| place as usize).collect());
            }
            _ => {
                starts.push(vec![0; count]);
                // The agent knows of no pairs but its own.
                let is_neighbor = game.neighbors(me).any(|neighbor| neighbor == place);
                neighbors.push(if is_neighbor { vec![me] } else { Vec::new() });
            }
        }
    }
    Descents::new(neighbors, &starts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_collectives::Game;

    const PLAYERS: usize = 5;
    const ACTIONS: usize = 4;

    /// Returns the game with the pairs that `has_pair` lets in: of everybody, or of one agent.
    fn game(has_pair: impl Fn(usize, usize) -> bool) -> PairwiseGame {
        let cost = |k: usize| (k * k * 37 % 101) as f64;
        let own = (0..PLAYERS).map(|i| (0..ACTIONS).map(|x| cost(7 * i + x)).collect()).collect();
        let mut game = PairwiseGame::new(own);
        for (i, j) in (0..PLAYERS).flat_map(|i| (i + 1..PLAYERS).map(move |j| (i, j))) {
            // Not all share a cost, so that moves can be made at the same time.
            if j - i < 3 && has_pair(i, j) {
                let first = 100 * i + 1000 * j;
                let costs = (first..first + ACTIONS * ACTIONS).map(|k| 2.0 * cost(k));
                game.add_pair(i, j, costs.collect());
            }
        }
        game
    }

    fn starts(player: usize) -> Vec<usize> {
        (0..6).map(|start| (player * start) % ACTIONS).collect()
    }

    /// Agents, and what each has heard of each.
    struct Group {
        games: Vec<PairwiseGame>,
        agents: Vec<LocalSearchAgent>,
        heard: Vec<Vec<SearchMember>>,
        sent: Vec<u32>,
    }

    impl Group {
        fn new() -> Self {
            let games: Vec<PairwiseGame> =
                (0..PLAYERS).map(|me| game(|i, j| i == me || j == me)).collect();
            let mut group = Self {
                agents: Vec::new(),
                heard: (0..PLAYERS)
                    .map(|_| (0..PLAYERS).map(|_| SearchMember::default()).collect())
                    .collect(),
                sent: vec![0; PLAYERS],
                games,
            };
            for me in 0..PLAYERS {
                let (agent, message) = LocalSearchAgent::new(&group.games[me], me, &starts(me));
                group.agents.push(agent);
                group.send(me, &message);
            }
            group
        }

        fn send(&mut self, from: usize, message: &SearchMessage) {
            self.sent[from] += 1;
            for heard in &mut self.heard {
                heard[from].receive(message.clone());
            }
        }

        /// Runs all agents to their ends; one may fall silent after some messages.
        fn run(mut self, silent: Option<(usize, u32)>) -> Vec<LocalSearchAgent> {
            let is_silent = |place: usize, sent: &[u32]| silent == Some((place, sent[place]));
            let mut is_moving = true;
            while is_moving {
                is_moving = false;
                for me in 0..PLAYERS {
                    let peers: Vec<SearchPeer<'_>> = (0..PLAYERS)
                        .map(|place| SearchPeer {
                            said: &self.heard[me][place],
                            is_gone: is_silent(place, &self.sent),
                            is_presumed: false,
                        })
                        .collect();
                    let agent = &self.agents[me];
                    let can_step =
                        peers.iter().all(|peer| peer.is_gone || agent.has_heard(peer.said));
                    let is_over = agent.phase == SearchPhase::Over;
                    if is_over || is_silent(me, &self.sent) || !can_step {
                        continue;
                    }
                    is_moving = true;
                    if let SearchStep::Send(message) = self.agents[me].step(&self.games[me], &peers)
                    {
                        self.send(me, &message);
                    }
                }
            }
            self.agents
        }
    }

    #[test]
    fn agents_that_know_their_own_pairs_come_to_what_one_process_finds_for_all() {
        let all = game(|_, _| true);
        let neighbors = (0..PLAYERS).map(|player| all.neighbors(player).collect()).collect();
        let all_starts: Vec<Vec<usize>> = (0..PLAYERS).map(starts).collect();
        let mut descents = Descents::new(neighbors, &all_starts);
        while descents.count_open() > 0 {
            for player in 0..PLAYERS {
                let costs = descents.player_costs(&all, player);
                descents.set_player_costs(player, costs);
            }
            let moves: Vec<_> =
                (0..PLAYERS).map(|player| descents.player_moves(&all, player)).collect();
            descents.step(&moves);
        }
        let joint = descents.best_joint();
        let first: Vec<usize> = all_starts.iter().map(|starts| starts[0]).collect();
        assert_ne!(joint, first, "something was to be found");
        for (me, agent) in Group::new().run(None).iter().enumerate() {
            let (action, costs) = agent.end().expect("an end");
            assert_eq!((action, costs), (joint[me], descents.best_costs_given(me)));
            let bound = all.lower_bound();
            assert_eq!(agent.reached(), Some(ReachedCost { cost: all.cost(joint), bound }));
        }
    }

    #[test]
    fn whoever_falls_silent_ends_the_search_of_all_and_nobody_waits() {
        for after in 1..6 {
            for agent in Group::new().run(Some((2, after))) {
                if agent.me != 2 {
                    assert_eq!(agent.phase, SearchPhase::Over, "after {after} messages");
                    assert!(agent.end().is_none() && agent.reached().is_none());
                }
            }
        }
    }

    #[test]
    fn messages_with_impossible_content_are_refused() {
        let limits = SearchLimits { actions: &[4, 4, 4], starts: 2, max_step: 3 };
        let start = |actions: &[u32], neighbors: &[u32]| {
            SearchMessage::Start(SearchStart {
                actions: actions.to_vec(),
                neighbors: neighbors.to_vec(),
            })
        };
        let costs = |step: u32, number: usize, cost: f64| SearchMessage::Costs {
            step,
            costs: vec![PlayerCosts { cost, given: vec![cost; 4] }; number],
        };
        let moves = |gain: f64, strategy: usize, partner: Option<(usize, usize)>| {
            let offer = PairMove { gain, strategy, partner };
            SearchMessage::Moves { step: 0, moves: vec![Some(offer), None] }
        };
        let bound = |cost: f64| SearchMessage::Bound(SearchBound { cost, bound: 0.0 });
        for right in [
            start(&[3, 0], &[0, 2]),
            costs(3, 2, 1.0),
            moves(1.0, 3, Some((2, 3))),
            moves(0.0, 0, None),
            bound(2.0),
        ] {
            assert_eq!(right.check(1, &limits), Ok(()), "{right:?}");
        }
        for wrong in [
            start(&[3], &[]),
            start(&[4, 0], &[]),
            start(&[0, 0], &[1]),
            start(&[0, 0], &[2, 0]),
            start(&[0, 0], &[3]),
            costs(4, 2, 1.0),
            costs(0, 3, 1.0),
            costs(0, 2, f64::NAN),
            costs(0, 2, -1.0),
            SearchMessage::Costs { step: 0, costs: vec![PlayerCosts::default()] },
            moves(f64::INFINITY, 0, None),
            moves(1.0, 4, None),
            moves(1.0, 0, Some((0, 0))),
            moves(1.0, 0, Some((1, 0))),
            moves(1.0, 0, Some((3, 0))),
            moves(1.0, 0, Some((2, 4))),
            bound(f64::NAN),
        ] {
            assert!(wrong.check(1, &limits).is_err(), "{wrong:?}");
        }
    }
}
