//! The true minimum of a game that is a sum over pairs, by branch and bound.

use super::cost_network::{CostNetwork, NetworkPlayer};
use super::game::{Game, PairwiseGame};
use sidestep_kernel::interrupt;

/// The cheapest joint move that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The strategy of each player.
    pub joint: Vec<usize>,
    /// Its cost.
    pub cost: f64,
    /// Whether no other one is cheaper: the search has come to its end.
    pub is_proved: bool,
}

/// The share of the cost by which a joint move has to be cheaper than the best one so far: less is rounding.
const MIN_SAVED_SHARE: f64 = 1e-9;

/// Sweeps that raise the bound at the start, at most: they end where one gains little.
const ROOT_SWEEPS: u32 = 100;
/// Sweeps after each choice.
const NODE_SWEEPS: u32 = 2;
/// The share of the gap between the bound and the best joint move that a sweep has to close for another one to follow.
const MIN_CLOSED_SHARE: f64 = 0.01;

/// Returns the minimum of a game, as far as it is found by looking at `max_nodes` partial joint moves. `start` is a joint
/// move (shape: players) to begin with: the cheaper it is, the less has to be looked at.
pub fn find_minimum(game: &PairwiseGame, start: &[usize], max_nodes: u64) -> Minimum {
    let best = Minimum { joint: start.to_vec(), cost: game.cost(start), is_proved: false };
    let network = CostNetwork::new(game, best.cost);
    let mut search = BranchAndBound { game, best, joint: start.to_vec(), nodes_left: max_nodes };
    let is_proved = search.branch(network, ROOT_SWEEPS);
    Minimum { is_proved, ..search.best }
}

/// Returns a lower bound on the cost of every joint move, which is dearer to compute than
/// [`PairwiseGame::lower_bound`] and not lower. `joint` is a joint move (shape: players), the cheaper the better.
pub fn tight_lower_bound(game: &PairwiseGame, joint: &[usize]) -> f64 {
    let cost = game.cost(joint);
    let mut network = CostNetwork::new(game, cost);
    raise_bound(&mut network, cost, ROOT_SWEEPS);
    network.bound.max(game.lower_bound()).min(cost)
}

/// Raises the bound of a network in up to `sweeps` sweeps, as long as they close the gap to `least`.
fn raise_bound(network: &mut CostNetwork, least: f64, sweeps: u32) {
    for _ in 0..sweeps {
        let gap = least - network.bound;
        if gap <= 0.0 || network.raise_bound() < MIN_CLOSED_SHARE * gap {
            break;
        }
    }
}

/// The search, which gives players their strategies one after the other.
struct BranchAndBound<'g> {
    game: &'g PairwiseGame,
    best: Minimum,
    joint: Vec<usize>,
    nodes_left: u64,
}

impl BranchAndBound<'_> {
    /// Tries all joint moves of a network beside the strategies that are chosen already. Returns whether all were tried.
    fn branch(&mut self, mut network: CostNetwork, sweeps: u32) -> bool {
        interrupt::check();
        if self.nodes_left == 0 {
            return false;
        }
        self.nodes_left -= 1;
        raise_bound(&mut network, self.cost_to_beat(), sweeps);
        if !network.prune(self.cost_to_beat()) {
            return true;
        }
        self.try_cheapest(&network);
        let Some(place) = branching_place(&network) else { return true };
        let NetworkPlayer { player, strategies, costs } = network.players[place].clone();
        let mut order: Vec<usize> = (0..strategies.len()).collect();
        order.sort_by(|&a, &b| costs[a].total_cmp(&costs[b]));
        for x in order {
            // The best may have become cheaper since.
            if network.bound + costs[x] >= self.cost_to_beat() {
                break;
            }
            self.joint[player] = strategies[x];
            if !self.branch(network.given(place, x), NODE_SWEEPS) {
                return false;
            }
        }
        true
    }

    /// Takes the joint move in which all that have not chosen take what is cheapest for them alone, if it is the best.
    fn try_cheapest(&mut self, network: &CostNetwork) {
        for player in &network.players {
            self.joint[player.player] = player.strategies[player.cheapest()];
        }
        let cost = self.game.cost(&self.joint);
        if cost < self.cost_to_beat() {
            self.best = Minimum { joint: self.joint.clone(), cost, is_proved: false };
        }
    }

    fn cost_to_beat(&self) -> f64 {
        self.best.cost - MIN_SAVED_SHARE * self.best.cost.abs()
    }
}

/// Returns the place of the player that chooses next, one with the fewest strategies left: so there are few branches;
/// `None` if nobody has a choice that matters.
fn branching_place(network: &CostNetwork) -> Option<usize> {
    let places = 0..network.players.len();
    places.min_by_key(|&place| network.players[place].strategies.len())
}

#[cfg(test)]
mod tests {
    use super::super::game::tests::{game, joints};
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn branch_and_bound_finds_what_trying_all_joint_moves_finds(
            sizes in prop::collection::vec(1usize..5, 1..5),
            costs in prop::collection::vec(-5.0f64..5.0, 7..60),
        ) {
            let game = game(&sizes, &costs);
            let start = vec![0; sizes.len()];
            let found = find_minimum(&game, &start, u64::MAX);
            prop_assert!(found.is_proved);
            let all = joints(&sizes).into_iter().map(|joint| game.cost(&joint));
            let least = all.fold(f64::INFINITY, f64::min);
            prop_assert!((found.cost - least).abs() < 1e-7, "{found:?} {least}");
            prop_assert_eq!(game.cost(&found.joint), found.cost);
        }

        #[test]
        fn no_joint_move_is_cheaper_than_the_tight_bound(
            sizes in prop::collection::vec(1usize..5, 1..6),
            costs in prop::collection::vec(-5.0f64..5.0, 7..90),
        ) {
            let game = game(&sizes, &costs);
            let all: Vec<f64> = joints(&sizes).iter().map(|joint| game.cost(joint)).collect();
            let least = all.iter().copied().fold(f64::INFINITY, f64::min);
            for joint in joints(&sizes).iter().step_by(7) {
                let bound = tight_lower_bound(&game, joint);
                prop_assert!(bound <= least + 1e-9, "{bound} {least}");
            }
        }
    }

    #[test]
    fn a_search_that_runs_out_of_nodes_claims_nothing() {
        let game = game(&[3, 3, 3], &[2.0, 0.5, 3.0, 1.0, 4.0]);
        assert!(!find_minimum(&game, &[0, 0, 0], 0).is_proved);
    }
}
