//! The connectors in danger, in groups along the chain.

use super::super::threat::gap_m;
use super::solve::EscapeSolver;
use super::solve_input::EscapeSolveInput;
use sidestep_rods::ChainPart;

/// Gap below which a connector or the rod at it counts as at risk, meters: twice as far as danger begins, because an
/// obstacle that is not in contact yet may be the better exit.
const RISK_DISTANCE_M: f64 = 0.24;
/// Connectors between two groups at least: as many as rollouts include on both sides of one.
const GROUP_DISTANCE: usize = 24;
/// Connectors up to which groups are rolled out together, and a long group as a whole.
const MAX_CONNECTORS: usize = 100;

/// A connector near an obstacle, itself or by the rod behind it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ConnectorAtRisk {
    pub(super) k: usize,
    /// The part that is near: the connector, or the rod.
    pub(super) part: ChainPart,
    /// Id of the obstacle.
    pub(super) obstacle: u32,
    pub(super) gap_m: f64,
}

/// Returns the connectors at risk in the order of the chain.
pub(super) fn connectors_at_risk<const D: usize>(
    input: &EscapeSolveInput<'_, D>,
    solver: &EscapeSolver<D>,
) -> Vec<ConnectorAtRisk> {
    let mut at_risk = Vec::new();
    for threat in &solver.contacts.threats {
        let mover = &input.obstacles.moving()[threat.mover];
        let gap_m = gap_m(input.chain, threat.part, mover);
        if gap_m < RISK_DISTANCE_M {
            let k = threat.part.connector();
            at_risk.push(ConnectorAtRisk { k, part: threat.part, obstacle: mover.id, gap_m });
        }
    }
    at_risk.sort_by_key(|at_risk| (at_risk.k, at_risk.obstacle));
    at_risk
}

/// Returns the connectors that rollouts are to save. It is the group of the one that is nearest to an obstacle, because
/// rollouts take time with each connector. A chain that is leaving through another obstacle, whose id is given, must not
/// give that up for it: then all groups are, or if these are far apart the one at that obstacle.
pub(super) fn group_to_save(at_risk: &[ConnectorAtRisk], exit: Option<u32>) -> &[ConnectorAtRisk] {
    let are_near = |a: &ConnectorAtRisk, b: &ConnectorAtRisk| b.k - a.k <= GROUP_DISTANCE;
    let groups = || at_risk.chunk_by(are_near);
    let least_gap_m = |group: &[ConnectorAtRisk]| {
        group.iter().map(|at_risk| at_risk.gap_m).fold(f64::INFINITY, f64::min)
    };
    let nearest = groups().min_by(|a, b| least_gap_m(a).total_cmp(&least_gap_m(b)));
    let Some(nearest) = nearest else { return at_risk };
    let Some(exit) = exit else { return around_nearest(nearest, |_| true) };
    let is_at_exit =
        |group: &&[ConnectorAtRisk]| group.iter().any(|at_risk| at_risk.obstacle == exit);
    let at_exit = |at_risk: &ConnectorAtRisk| at_risk.obstacle == exit;
    if is_at_exit(&nearest) {
        return around_nearest(nearest, at_exit);
    }
    let last = at_risk.len() - 1;
    if at_risk[last].k - at_risk[0].k < MAX_CONNECTORS {
        return at_risk;
    }
    let group = groups().find(is_at_exit);
    group.map_or(around_nearest(nearest, |_| true), |group| around_nearest(group, at_exit))
}

/// Returns the part of a group around the one of some of its connectors that is nearest to an obstacle: a chain that is hemmed
/// in along all of its length is one group, and a rollout of all of it would take the work of several seconds.
fn around_nearest(
    group: &[ConnectorAtRisk],
    counts: impl Fn(&ConnectorAtRisk) -> bool,
) -> &[ConnectorAtRisk] {
    let some = group.iter().filter(|at_risk| counts(at_risk));
    let nearest = some.min_by(|a, b| a.gap_m.total_cmp(&b.gap_m));
    let Some(middle) = nearest.map(|at_risk| at_risk.k) else { return group };
    let from = group.partition_point(|at_risk| at_risk.k + MAX_CONNECTORS / 2 < middle);
    let to = group.partition_point(|at_risk| at_risk.k <= middle + MAX_CONNECTORS / 2);
    &group[from..to]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(from: usize, obstacle: u32, gap_m: f64) -> [ConnectorAtRisk; 2] {
        [from, from + 20].map(|k| ConnectorAtRisk {
            k,
            part: ChainPart::Connector(k),
            obstacle,
            gap_m,
        })
    }

    #[test]
    fn of_a_group_as_long_as_a_snake_the_part_around_its_nearest_connector_is_saved() {
        let long: Vec<_> = (0..20).flat_map(|k| group(20 * k, 1, 0.2)).collect();
        let mut hemmed_in = long.clone();
        hemmed_in[21].gap_m = 0.01;
        let saved = group_to_save(&hemmed_in, None);
        let middle = hemmed_in[21].k;
        assert!(saved.iter().any(|at_risk| at_risk.gap_m == 0.01));
        assert!(saved.iter().all(|at_risk| at_risk.k.abs_diff(middle) <= 50));
        assert!(saved[saved.len() - 1].k - saved[0].k >= 80, "{saved:?}");
        assert_eq!(group_to_save(&long[..4], Some(1)), &long[..4]);
    }

    #[test]
    fn the_group_nearest_to_an_obstacle_is_saved_unless_that_would_give_up_an_exit() {
        let [low, middle, high] = [group(5, 1, 0.1), group(60, 2, 0.2), group(300, 3, 0.05)];
        let all = [low, middle, high].concat();
        assert_eq!(group_to_save(&all, None), high);
        assert_eq!(group_to_save(&all, Some(3)), high);
        // Too far apart for all.
        assert_eq!(group_to_save(&all, Some(2)), middle);
        assert_eq!(group_to_save(&all, Some(9)), high);
        let near = [low, middle].concat();
        assert_eq!(group_to_save(&near, None), low);
        assert_eq!(group_to_save(&near, Some(2)), near);
        assert_eq!(group_to_save(&[], None), []);
    }
}
