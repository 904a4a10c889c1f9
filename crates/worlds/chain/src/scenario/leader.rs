//! Refusals of tasks that their connector can never do.

use super::super::driver::{Task, TaskKind};
use super::ChainScenarioCompiler;
use super::chains::ChainSection;
use super::tasks::TaskSection;
use sidestep_arms::Arm;
use sidestep_arms::plan::JointGoal;
use sidestep_kernel::InputError;
use sidestep_rods::geometry::distance;
use sidestep_rods::{Chain, Mobility};
use sidestep_scenario::Spanned;

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Refuses a task that moves a fixed or failed connector, and targets off the line, the plane or the
    /// box on which it belongs, unless a change may let it go.
    pub(super) fn check_leader(
        &self,
        s: &ChainSection<D>,
        section: &Spanned<TaskSection<D>>,
        task: &Task<D>,
        start: &Chain<D>,
    ) -> Result<(), InputError> {
        let k = task.agent;
        let moves = !matches!(task.driver, TaskKind::Rest | TaskKind::External);
        if !moves || s.changes.0.iter().any(|change| change.get_ref().may_release_connector(k)) {
            return Ok(());
        }
        let connector = &start.connectors()[k];
        if connector.is_still() {
            let why = if connector.failed { "has failed" } else { "is fixed" };
            let cause = format!("connector {k} leads, and it {why}: it can never move");
            let at = self.source.key_span(section.span(), &["connector", "kind"]);
            let last = start.points().len() - 1;
            let remedy = match s.arm {
                Some(_) => format!("give connector = {last}, the tool"),
                None => format!("give another connector, 0 to {last}, or kind = \"rest\""),
            };
            return Err(self.source.error(at, cause, remedy));
        }
        self.check_targets_allowed(section, task, start)
    }

    /// Refuses targets to which no joints of an arm bring the connector that leads, with the reason.
    pub(super) fn check_arm_targets_reachable(
        &self,
        section: &Spanned<TaskSection<D>>,
        task: &Task<D>,
        arm: &Arm,
    ) -> Result<(), InputError> {
        let TaskKind::Targets(targets) = &task.driver else { return Ok(()) };
        for (i, at) in targets.places.iter().enumerate() {
            let (chain, goal) = match targets.goals.get(i) {
                // Joint values are within the limits, as was checked when they were read.
                Some(JointGoal::Values(_)) => continue,
                Some(JointGoal::Pose(pose)) => (arm.serial.clone(), pose.clone()),
                None => arm.goal(task.agent, *at, targets.tolerance_m),
            };
            let answer = chain
                .solve(&goal, &arm.values)
                .map_err(|error| self.source.error_from(section.span(), &error))?;
            if let Some(reason) = answer.reason {
                let cause = format!("connector {} cannot reach target {i}: {reason}", task.agent);
                let at = self.source.key_span(section.span(), &["targets_m"]);
                let remedy =
                    "give a target that the joints reach; `sidestep ik` shows which they do";
                return Err(self.source.error(at, cause, remedy));
            }
        }
        Ok(())
    }

    /// Refuses targets where the connector that leads may never be.
    fn check_targets_allowed(
        &self,
        section: &Spanned<TaskSection<D>>,
        task: &Task<D>,
        start: &Chain<D>,
    ) -> Result<(), InputError> {
        let TaskKind::Targets(targets) = &task.driver else { return Ok(()) };
        let k = task.agent;
        let mobility = start.connectors()[k].mobility;
        if mobility == Mobility::Free {
            return Ok(());
        }
        for (i, &target) in targets.places.iter().enumerate() {
            let off_m = distance(mobility.project(target, start.points()[k]), target);
            if off_m > targets.tolerance_m {
                let cause =
                    format!("target {i} is {off_m:.4} m off the places where connector {k} may be");
                let at = self.source.key_span(section.span(), &["targets_m"]);
                let remedy =
                    "give targets where its mobility allows it, or make another connector lead";
                return Err(self.source.error(at, cause, remedy));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::scenario::ChainScenario;
    use sidestep_scenario::Source;

    /// Compiles a chain of four with a limited first connector and a task.
    fn told(limit: &str, task: &str, change: &str) -> Option<String> {
        let text = format!(
            "format = 1\nworld = \"chain\"\n[[chains]]\nconnectors = 4\nrod_m = 0.5\n\
             [[chains.limits]]\nconnector = 0\n{limit}\n[[chains.tasks]]\n{task}\n{change}"
        );
        let source = Source::new("s.toml", text, "");
        ChainScenario::<2>::new(&source).err().map(|error| error.cause().to_string())
    }

    #[test]
    fn who_can_never_move_does_not_lead() {
        let goes = "kind = \"targets\"\ntargets_m = [[1.0, 0.0]]";
        let fixed = "mobility = \"fixed\"";
        let cause = "connector 0 leads, and it is fixed: it can never move";
        assert_eq!(told(fixed, goes, "").as_deref(), Some(cause));
        assert_eq!(told(fixed, "kind = \"wander\"", "").as_deref(), Some(cause));
        assert!(told("failed = true", goes, "").is_some_and(|said| said.contains("has failed")));
        for (limit, task, change) in [
            (fixed, "kind = \"targets\"\ntargets_m = [[1.0, 0.0]]\nconnector = 3", ""),
            (fixed, "kind = \"rest\"", ""),
            (fixed, "kind = \"external\"", ""),
            (fixed, goes, "[[chains.changes]]\nat_s = 1.0\nconnector = 0\nmobility = \"free\""),
            (
                "failed = true",
                goes,
                "[[chains.changes]]\nat_s = 1.0\nconnector = 0\nfailed = false",
            ),
        ] {
            assert_eq!(told(limit, task, change), None, "{limit}, {task}, {change}");
        }
    }

    #[test]
    fn targets_lie_where_the_leader_may_be() {
        let rail = "mobility = { on_segment = [[0.0, 0.0], [2.0, 0.0]] }";
        let goes = |to: &str| format!("kind = \"targets\"\ntargets_m = [[1.0, 0.0], {to}]");
        assert_eq!(told(rail, &goes("[2.0, 0.0]"), ""), None);
        let cause = told(rail, &goes("[2.0, 0.3]"), "").expect("refused");
        assert!(cause.starts_with("target 1 is 0.3000 m off"), "{cause}");
    }

    /// Compiles the shipped arm with a task and further keys.
    fn told_of_arm(beside: &str, task: &str) -> Option<String> {
        let text = format!(
            "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
             arm = {{ urdf = \"scenarios/chain/arm.urdf\" }}\n[[chains.tasks]]\n{task}\n{beside}"
        );
        let source = Source::new("s.toml", text, sidestep_testing::root());
        ChainScenario::<3>::new(&source).err().map(|error| error.cause().to_string())
    }

    #[test]
    fn targets_of_an_arm_are_where_its_joints_reach() {
        let goes = |to: &str| format!("kind = \"targets\"\nconnector = 3\ntargets_m = [{to}]");
        assert_eq!(told_of_arm("", &goes("[0.4, 0.1, 0.6]")), None);
        let cause = told_of_arm("", &goes("[0.4, 0.1, 0.6], [2.0, 0.0, 0.3]")).expect("refused");
        let says = "connector 3 cannot reach target 1: the target is 2.000000 m from the arm's first connector, \
                    and its rods reach 0.950000 m";
        assert_eq!(cause, says);
        // As near to its shoulder as this, its elbow would have to bend beyond its limit.
        let cause = told_of_arm("", &goes("[0.02, 0.0, 0.35]")).expect("refused");
        assert!(cause.starts_with("connector 3 cannot reach target 0"), "{cause}");
    }

    #[test]
    fn an_arm_stays_whole_and_on_its_base() {
        let rests = "kind = \"rest\"";
        for (beside, words) in [
            ("[[chains.limits]]\nconnector = 0\nmobility = \"free\"", "whose base may move"),
            ("[[chains.changes]]\nat_s = 1.0\nscatter = [1, 2]\nby_m = 0.1", "never scattered"),
            ("[[chains.changes]]\nat_s = 1.0\nconnector = 0\nmobility = \"free\"", "off its base"),
        ] {
            let cause = told_of_arm(beside, rests).expect("refused");
            assert!(cause.contains(words), "{cause}");
        }
        let fails = "[[chains.changes]]\nat_s = 1.0\nconnector = 2\nfailed = true";
        assert_eq!(told_of_arm(fails, rests), None);
    }
}
