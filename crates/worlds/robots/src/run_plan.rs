//! The plan of a run without errors: the poses through which planners lead the robots of a scenario.
//!
//! Whatever the planners do (whole plans, steps, tasks, goals one after the other), a run in which all actions succeed is
//! one plan of all robots, without a conflict. Vehicles that are late carry it out in its order, see
//! [`sidestep_planners::DependencyGraph`].

use super::policy::ConflictPolicy;
use super::scenario::Compiled;
use super::world::{RobotsWorld, Role};
use super::world_impl::RobotsRun;
use sidestep_kernel::{EntityId, InputError, Simulation};
use sidestep_map::planning::FreeSpace;
use sidestep_planners::{ActionModel, Agent, GridPose, Instance, Plan};
use sidestep_scenario::Source;

/// Most poses of a plan: 1,000 robots with 10,000 steps, 120 MB.
const MAX_POSES: usize = 10_000_000;

/// The plan of a run without errors.
#[derive(Debug, Clone)]
pub struct RunPlan {
    /// The robots by id, from their starts to where the plan ends.
    pub instance: Instance,
    /// The poses of each robot; steps in which nobody moves are left out.
    pub plan: Plan,
}

impl Compiled {
    /// Computes the plan by which the planners lead all robots through the cycles of the scenario, if no action fails.
    ///
    /// # Errors
    /// Where planners do not lead all bodies, the regime has errors, or the plan would be too long.
    pub fn run_plan(&self, source: &Source) -> Result<RunPlan, InputError> {
        let at_scenario =
            |[cause, remedy]: [String; 2]| InputError::new(&source.place, cause, remedy);
        self.world.check_all_are_planned().map_err(at_scenario)?;
        let mut run = self.clone().start(source, 1);
        let mut last = poses(&run);
        let mut paths: Vec<Vec<GridPose>> = last.iter().map(|&pose| vec![pose]).collect();
        let max_steps = MAX_POSES / paths.len();
        for _ in 0..self.cycles {
            if run.advance(1) == 0 {
                break;
            }
            let now = poses(&run);
            if now == last {
                continue;
            }
            if paths[0].len() >= max_steps {
                let cause = format!("its plan has more than {MAX_POSES} poses");
                let remedy = format!("give fewer cycles, such as --cycles {}", run.cycle() / 2);
                return Err(at_scenario([cause, remedy]));
            }
            for (path, &pose) in paths.iter_mut().zip(&now) {
                path.push(pose);
            }
            last = now;
        }
        self.run_plan_of(paths)
    }

    /// Returns the plan of these paths.
    fn run_plan_of(&self, paths: Vec<Vec<GridPose>>) -> Result<RunPlan, InputError> {
        let mut agents = Vec::with_capacity(paths.len());
        for (robot, path) in paths.iter().enumerate() {
            let size = self.world.type_of(robot as EntityId).size.0;
            // A path has a pose at its start.
            let end = path[path.len() - 1];
            agents.push(Agent { size, start: path[0], goal: end.position() });
        }
        let free = FreeSpace::from_map(&self.world.map);
        let instance = Instance::new(&free, ActionModel::Turns, agents)?;
        Ok(RunPlan { instance, plan: Plan::new(paths) })
    }
}

impl RobotsWorld {
    /// Checks that all bodies are robots that planners of the scenario lead, without errors.
    ///
    /// # Errors
    /// With the cause and the remedy.
    fn check_all_are_planned(&self) -> Result<(), [String; 2]> {
        if !self.regime.has_reliable_effectors() {
            let cause = "a plan of its run needs actions that succeed".to_string();
            return Err([cause, "give regime = \"reliable\"".to_string()]);
        }
        if self.bodies.is_empty() {
            let cause = "it has no robots".to_string();
            return Err([cause, "add a section [[robots]] with a planner".to_string()]);
        }
        for body in &self.bodies {
            let id = body.id;
            if !matches!(self.type_of(id).role, Role::Robot(_)) {
                let kind = &self.kinds[usize::from(self.type_of(id).kind)];
                let cause = format!("a {kind} moves by itself, which no plan can know");
                return Err([cause, "leave out [people] and [doors]".to_string()]);
            }
            let mut teams = self.planner_teams.iter();
            let Some(team) = teams.find(|team| team.robots.contains(&id)) else {
                let cause = format!("robot {id} decides alone, so it has no plan");
                let remedy = "add planner = { method = \"lacam\" } to each section of robots";
                return Err([cause, remedy.to_string()]);
            };
            if team.leader.orders.is_some() {
                let cause = format!("a program orders what robot {id} does, so it has no plan");
                let remedy = "give the planner another method, such as \"lacam\"";
                return Err([cause, remedy.to_string()]);
            }
        }
        Ok(())
    }

    /// Returns whether robots may move in a ring, each into the box that another one leaves in the same instant.
    pub fn allows_rings(&self) -> bool {
        self.policy == ConflictPolicy::Simultaneous
    }
}

fn poses(run: &RobotsRun) -> Vec<GridPose> {
    let world = run.world();
    let mut poses = Vec::with_capacity(world.bodies.len());
    for body in &world.bodies {
        let state = run.state().body(body.id);
        let position = world.map_position(state.position());
        poses.push(GridPose::new(position.0, position.1, state.facing.get().heading()));
    }
    poses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{Behaviours, StorageOrder};

    fn run_plan(keys: &str, more: &str) -> Result<RunPlan, InputError> {
        let text = format!(
            "format = 1\nworld = \"robots\"\ncycles = 60\nregime = \"reliable\"\n{more}\n\
             [map]\nascii = \"\"\"\n........\n...##...\n........\n\"\"\"\n[[robots]]\n\
             at = [[0, 0, 0], [7, 0, 2], [0, 2, 0]]\n{keys}\n"
        );
        let source = Source::new("s.toml", text, "");
        Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial)?.run_plan(&source)
    }

    const GOES: &str = "behaviour = { kind = \"shuttle\", a = [0, 0, 1, 3], b = [7, 0, 1, 3] }\n";

    #[test]
    fn the_plan_of_a_run_is_without_a_conflict_whatever_planner_makes_it() {
        for method in ["pibt", "lacam", "prioritized"] {
            for policy in ["", "conflict_policy = \"simultaneous\""] {
                let planner = format!("planner = {{ method = \"{method}\" }}");
                let found = run_plan(&format!("{GOES}{planner}"), policy).expect("a plan");
                assert_eq!(found.plan.validate(&found.instance), Ok(()), "{method} {policy}");
                assert!(found.plan.steps() >= 14, "they go to and fro: {}", found.plan.steps());
            }
        }
        let goto = "behaviour = { kind = \"goto\", goals = [[5, 0], [2, 2]] }\n\
                    planner = { method = \"lacam\" }\naction_cycles = 3";
        let found = run_plan(goto, "").expect("a plan");
        assert_eq!(found.plan.validate(&found.instance), Ok(()));
    }

    #[test]
    fn without_a_planner_for_all_there_is_no_plan_and_the_remedy_is_told() {
        let refused = |keys: &str, more: &str, cause: &str| {
            let error = run_plan(keys, more).expect_err(cause);
            assert!(error.cause().contains(cause), "{error}");
        };
        let planner = format!("{GOES}planner = {{ method = \"pibt\" }}");
        refused(GOES, "", "decides alone");
        refused(&planner.replace("pibt", "external"), "", "a program orders");
        refused(&format!("{planner}\n[people]\nat = [[3, 2]]"), "", "person moves by itself");
    }
}
