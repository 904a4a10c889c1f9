//! Remarks on targets for which a search finds no posture, though the rods would reach.

use crate::driver::TaskKind;
use crate::world::{ChainSpec, ChainWorld};
use sidestep_arms::ik::{ChainIkGoal, IkEngine, IkSolver};
use sidestep_arms::plan::{ChainBases, chain_bases};
use sidestep_scenario::Remark;

/// Postures from which one at a target is sought: few, because all targets of a scenario are asked.
const RESTARTS: usize = 25;
/// Rods up to which postures are sought: the time of a search grows with the square of their number.
const MAX_RODS: usize = 64;

/// Pairs of rods in all searches of a scenario at most: about a second.
const MAX_EFFORT: usize = 25_000;

/// Returns a warning on the targets of each task of a chain on a fixed base for which no posture is found.
pub(super) fn no_posture_remarks<const D: usize>(
    world: &ChainWorld<D>,
    k: usize,
    spec: &ChainSpec<D>,
) -> Vec<Remark> {
    // Arms are asked by `sidestep ik`, and a change may let go of the base.
    if spec.arm.is_some() || !spec.changes.is_empty() || spec.start.rods().len() > MAX_RODS {
        return Vec::new();
    }
    let rods = spec.start.rods().len().max(1);
    let mut searches = MAX_EFFORT / (rods * rods * world.chains.len());
    let tasks = spec.tasks.iter().enumerate();
    let remarks = tasks.filter_map(|(number, task)| {
        let TaskKind::Targets(targets) = &task.driver else { return None };
        let Ok(ChainBases::One(base)) = chain_bases(&spec.start, task.agent) else { return None };
        if !spec.start.connectors()[base].is_still() {
            return None;
        }
        let has_no_posture = |target: usize| {
            let goal = ChainIkGoal {
                engine: IkEngine::Dls,
                tolerance_m: targets.tolerance_m,
                restarts: RESTARTS,
                ..ChainIkGoal::new(task.agent, base, targets.places[target])
            };
            let found = IkSolver::new(world.rules).solve(&spec.start, &world.obstacles, &goal);
            found.is_ok_and(|result| !result.reached)
        };
        let asked = searches.min(targets.places.len());
        searches -= asked;
        let without_posture = (0..asked).filter(|target| has_no_posture(*target));
        let numbers: Vec<String> = without_posture.map(|target| target.to_string()).collect();
        if numbers.is_empty() {
            return None;
        }
        let words = format!(
            "a search found no posture at the targets {} of the first {asked}, counted from 0, though the rods reach that far; obstacles, \
             the chain's own body or bend limits may be in the way: move them, or expect `target-given-up`",
            numbers.join(", ")
        );
        Some(Remark::warning(format!("chains.{k}.tasks.{number}.targets_m"), words))
    });
    remarks.collect()
}

#[cfg(test)]
mod tests {
    use crate::remarks::remarks;
    use crate::scenario::ChainScenario;
    use sidestep_scenario::Source;

    #[test]
    fn targets_inside_an_obstacle_are_told_by_number() {
        let told = |more: &str| {
            let text = format!(
                "format = 1\nworld = \"chain\"\n{more}\n[[chains]]\nconnectors = 6\nat_m = [0.0, 1.5]\n\
                 along = [0.0, -1.0]\nrod_m = 0.3\nradius_m = 0.02\nrod_radius_m = 0.01\n\
                 limits = [{{ connector = 5, mobility = \"fixed\" }}]\n\
                 [[chains.tasks]]\nkind = \"targets\"\ntargets_m = [[0.5, 0.5], [-0.9, 0.4], [0.0, 1.2]]\n"
            );
            let source = Source::new("s.toml", text, "");
            let compiled = ChainScenario::<2>::new(&source).unwrap_or_else(|e| panic!("{e}"));
            let told = remarks(&compiled).into_iter();
            told.map(|told| (told.key, told.words)).collect::<Vec<_>>()
        };
        assert_eq!(told(""), []);
        let ball = "[[obstacles]]\nat_m = [-0.9, 0.4]\nradius_m = 0.2\n";
        let [(key, words)] = &told(ball)[..] else { panic!("one remark") };
        assert_eq!(key, "chains.0.tasks.0.targets_m");
        assert!(
            words.contains("no posture at the targets 1 of the first 3, counted from 0"),
            "{words}"
        );
    }
}
