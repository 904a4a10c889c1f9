//! Remarks on laws of a scenario that rule something out.

use super::action::Action;
use super::effector::ObstacleRule;
use super::world::{RobotModel, RobotsWorld, Role};
use sidestep_scenario::Remark;
use std::collections::BTreeSet;

/// Returns warnings of the effectors with which robots can never have a contact: where
/// `renormalise` strikes out blocked transitions, and each of their actions may also end in
/// place, which is never blocked.
pub(super) fn no_contact_remarks(world: &RobotsWorld) -> Vec<Remark> {
    if world.obstacle_rule != ObstacleRule::Renormalise {
        return Vec::new();
    }
    let models = world.types.iter().filter_map(|ty| match &ty.role {
        Role::Robot(model) if can_move(model) && !must_move(model) => Some(model),
        _ => None,
    });
    let effectors: BTreeSet<&str> = models.map(|m| m.body.effector.name.as_str()).collect();
    effectors.into_iter().map(no_contact_remark).collect()
}

fn no_contact_remark(effector: &str) -> Remark {
    let words = format!(
        "no robot with the effector `{effector}` ever has a contact: each of its actions may \
         also leave it in place, so something is always left when \"renormalise\" strikes out \
         what is blocked. Behaviours that turn on contact may push a wall forever: use \
         obstacle_rule = \"cut\" or \"stay\", or sensors that see what is ahead"
    );
    Remark::warning("obstacle_rule", words)
}

/// Returns whether some action may end elsewhere.
fn can_move(model: &RobotModel) -> bool {
    model.body.actions.iter().any(|action| possible_lengths(action).any(|steps| steps > 0))
}

/// Returns whether some action always goes somewhere, so that all of its transitions may be blocked.
fn must_move(model: &RobotModel) -> bool {
    model.body.actions.iter().any(|action| possible_lengths(action).all(|steps| steps > 0))
}

/// Returns the number of steps of each transition in which an action may end.
fn possible_lengths(action: &Action) -> impl Iterator<Item = usize> + '_ {
    let walks = action.probabilities.iter().zip(&action.walks);
    walks.filter(|(p, _)| **p > 0.0).map(|(_, walk)| walk.steps.len())
}

#[cfg(test)]
mod tests {
    use crate::scenario::{Behaviours, Compiled, StorageOrder};
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    fn compiled(rule: &str, effector: &str, regime: &str) -> (Source, Compiled) {
        let text = format!(
            "format = 1\nworld = \"robots\"\nobstacle_rule = \"{rule}\"\nregime = \"{regime}\"\n\
             map.ascii = \"......\"\n[robots]\nat = [[0, 0, 0]]\neffector = \"{effector}\"\n"
        );
        let source = Source::new("s", &text, "");
        let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
        (source.clone(), compiled.expect("fits"))
    }

    #[test]
    fn a_law_that_makes_contacts_impossible_is_warned_of_and_only_then() {
        let cases = [
            ("renormalise", "nomad", "both", true),
            ("renormalise", "nomad", "reliable", false),
            ("renormalise", "perfect", "both", false),
            ("cut", "nomad", "both", false),
            ("stay", "nomad", "both", false),
        ];
        for (rule, effector, regime, is_warned) in cases {
            let (source, compiled) = compiled(rule, effector, regime);
            let warned = compiled.remarks.iter().any(|r| r.words.contains("contact"));
            assert_eq!(warned, is_warned, "{rule}, {effector}, {regime}");
            let mut run = compiled.start(&source, 1);
            run.advance(500);
            assert_eq!(run.metrics().total.contacts == 0, is_warned, "{rule}, {effector}");
        }
    }
}
