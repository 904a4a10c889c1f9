//! The true minimum of a game that is a sum over pairs, by branch and bound.

use super::game::{Game, PairwiseGame};
use sidestep_kernel::interrupt;

/// A joint move that no other one undercuts.
#[derive(Debug, Clone, PartialEq)]
pub struct Minimum {
    /// The strategy of each player.
    pub joint: Vec<usize>,
    /// Its cost.
    pub cost: f64,
}

/// The share of the cost by which a joint move has to be cheaper than the best one so far: less is rounding.
const MIN_SAVED_SHARE: f64 = 1e-9;

/// Returns the minimum of a game, or `None` if it is not found by looking at `max_nodes` partial joint moves. `start` is
/// a joint move (shape: players) to begin with: the cheaper it is, the less has to be looked at.
pub fn find_minimum(game: &PairwiseGame, start: &[usize], max_nodes: u64) -> Option<Minimum> {
    let best = Minimum { joint: start.to_vec(), cost: game.cost(start) };
    let mut search = BranchAndBound { game, best, joint: start.to_vec(), nodes_left: max_nodes };
    let costs = game.own.clone();
    search.branch(0, 0.0, &costs).then_some(search.best)
}

/// The search, which gives players their strategies one after the other.
struct BranchAndBound<'g> {
    game: &'g PairwiseGame,
    best: Minimum,
    joint: Vec<usize>,
    nodes_left: u64,
}

impl BranchAndBound<'_> {
    /// Tries all strategies of a player and those after it. `cost` is that of the players before it, `costs` those of
    /// each further player's strategies beside them. Returns whether all were tried.
    fn branch(&mut self, player: usize, cost: f64, costs: &[Vec<f64>]) -> bool {
        interrupt::check();
        if self.nodes_left == 0 {
            return false;
        }
        self.nodes_left -= 1;
        if player == self.joint.len() {
            self.best = Minimum { joint: self.joint.clone(), cost: self.game.cost(&self.joint) };
            return true;
        }
        let mut strategies: Vec<usize> = (0..costs[player].len()).collect();
        strategies.sort_by(|&a, &b| costs[player][a].total_cmp(&costs[player][b]));
        for x in strategies {
            self.joint[player] = x;
            let cost = cost + costs[player][x];
            let further = self.game.costs_beside(player, x, costs);
            if cost + self.least(player + 1, &further) < self.cost_to_beat()
                && !self.branch(player + 1, cost, &further)
            {
                return false;
            }
        }
        true
    }

    fn cost_to_beat(&self) -> f64 {
        self.best.cost - MIN_SAVED_SHARE * self.best.cost.abs()
    }

    /// Returns a lower bound on what the players from `first` on add.
    fn least(&self, first: usize, costs: &[Vec<f64>]) -> f64 {
        let lowest = |costs: &Vec<f64>| costs.iter().copied().fold(f64::INFINITY, f64::min);
        let own: f64 = costs[first..].iter().map(lowest).sum();
        own + self.game.least_pair_costs(first)
    }
}

impl PairwiseGame {
    /// Returns the costs of the strategies of later players beside strategy `x` of a player too.
    fn costs_beside(&self, player: usize, x: usize, costs: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut costs = costs.to_vec();
        for &index in &self.player_pairs[player] {
            let pair = &self.pairs[index];
            let other = pair.other(player);
            if other > player {
                let row = pair.given(player).row(x);
                costs[other].iter_mut().zip(row).for_each(|(sum, cost)| *sum += cost);
            }
        }
        costs
    }

    /// Returns the sum of the least costs of all pairs of players from `first` on.
    fn least_pair_costs(&self, first: usize) -> f64 {
        let pairs = self.pairs.iter().filter(|pair| pair.a >= first && pair.b >= first);
        pairs.map(|pair| pair.given_a.min).sum()
    }
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
            let found = find_minimum(&game, &start, u64::MAX).expect("no limit");
            let all = joints(&sizes).into_iter().map(|joint| game.cost(&joint));
            let least = all.fold(f64::INFINITY, f64::min);
            prop_assert!((found.cost - least).abs() < 1e-7, "{found:?} {least}");
            prop_assert_eq!(game.cost(&found.joint), found.cost);
        }
    }

    #[test]
    fn a_search_that_runs_out_of_nodes_claims_nothing() {
        let game = game(&[3, 3, 3], &[2.0, 0.5, 3.0, 1.0, 4.0]);
        assert_eq!(find_minimum(&game, &[0, 0, 0], 2), None);
    }
}
