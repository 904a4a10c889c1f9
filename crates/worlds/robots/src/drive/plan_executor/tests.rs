use super::*;
use crate::scenario::{Behaviours, Compiled, StorageOrder};
use sidestep_scenario::Source;

/// Two robots who want to the other's side of a corridor of one box, with a bay for one of them.
fn plan() -> Arc<TeamPlan> {
    let text = "format = 1\nworld = \"robots\"\ncycles = 100\nregime = \"reliable\"\n[map]\nascii = \"\"\"\n\
        ..#...#..\n.........\n..#####..\n\"\"\"\n[[robots]]\nat = [[0, 1, 0]]\n\
        behaviour = { kind = \"goto\", goals = [[8, 1]] }\nname = \"all\"\nplanner = { method = \"lacam\" }\n\
        [[robots]]\nat = [[8, 1, 2]]\nbehaviour = { kind = \"goto\", goals = [[0, 1]] }\n\
        team = \"all\"\n";
    let source = Source::new("s.toml", text, "");
    let compiled = Compiled::new(&source, &Behaviours::new(), StorageOrder::Spatial);
    let compiled = compiled.expect("a scenario");
    Arc::new(TeamPlan::new(&compiled, &source).expect("a plan"))
}

/// Robots that are where they are meant to be, and hear each other when they are told to.
struct Team {
    plan: Arc<TeamPlan>,
    executors: Vec<PlanExecutor>,
    at: Vec<GridPose>,
}

impl Team {
    fn new(plan: &Arc<TeamPlan>) -> Self {
        let robots = plan.robots();
        let at = (0..robots).map(|robot| plan.pose_after(robot, 0).expect("a start")).collect();
        let executors = (0..robots as EntityId).map(|id| PlanExecutor::new(plan.clone(), id));
        Self { plan: plan.clone(), executors: executors.collect(), at }
    }

    fn beacon(&self, robot: usize) -> DriveBeacon {
        let executor = &self.executors[robot];
        DriveBeacon {
            robot: robot as EntityId,
            at: self.at[robot],
            word: None,
            request: 0,
            done: executor.done(),
            heard_done: executor.heard_done(),
        }
    }

    fn tell(&mut self, robot: usize) {
        let beacon = self.beacon(robot);
        for (other, executor) in self.executors.iter_mut().enumerate() {
            if other != robot {
                executor.hear(&beacon);
            }
        }
    }

    fn restart(&mut self, robot: usize) {
        self.executors[robot] = PlanExecutor::new(self.plan.clone(), robot as EntityId);
    }

    /// Lets a robot do its next action, if it may.
    fn act(&mut self, robot: usize) -> PlanOrder {
        let order = self.executors[robot].next_order(self.at[robot]);
        if let PlanOrder::Act(action) = order {
            self.at[robot] = self.at[robot].after(action).expect("on the map");
        }
        order
    }

    fn has_met(&self) -> bool {
        (1..self.at.len())
            .any(|k| self.at[..k].iter().any(|at| at.position() == self.at[k].position()))
    }
}

#[test]
fn each_computes_the_same_plan_and_both_arrive_in_its_order_however_one_of_them_starts_anew() {
    let plan = plan();
    let again = self::plan();
    for robot in 0..2 {
        let actions = plan.actions(robot);
        assert_eq!(again.actions(robot), actions);
        assert!((0..=actions).all(|k| plan.pose_after(robot, k) == again.pose_after(robot, k)));
    }
    assert_eq!(plan.pose_after(0, plan.actions(0)).map(GridPose::position), Some((8, 1)));
    let total: u32 = (0..2).map(|robot| plan.actions(robot)).sum();
    for restart_after in 0..total {
        for restarted in [&[0][..], &[1], &[0, 1]] {
            let mut team = Team::new(&plan);
            let mut rounds = 0;
            while !team.executors.iter().all(PlanExecutor::is_complete_for_all) {
                for robot in 0..2 {
                    team.tell(robot);
                    team.act(robot);
                    assert!(!team.has_met(), "{:?}", team.at);
                }
                if rounds == restart_after {
                    restarted.iter().for_each(|&robot| team.restart(robot));
                }
                rounds += 1;
                assert!(rounds < 4 * total, "restart of {restarted:?} after {restart_after}");
            }
        }
    }
}

#[test]
fn a_robot_that_depends_on_a_silent_one_waits_and_says_for_whom() {
    let plan = plan();
    let mut team = Team::new(&plan);
    let unheard = PlanOrder::Hold(PlanHold::Unheard(vec![1]));
    assert_eq!(team.act(0), unheard, "it cannot know that this is the start of all");
    (0..2).for_each(|robot| team.tell(robot));
    let mut order = team.act(0);
    for _ in 0..100 {
        order = team.act(0);
    }
    // Whoever of the two is first: the other one waits for it.
    let mut other = team.act(1);
    for _ in 0..100 {
        other = team.act(1);
    }
    let waits = [order, other].map(|order| matches!(order, PlanOrder::Hold(PlanHold::Others(_))));
    assert!(waits.contains(&true), "{:?}", team.at);
    let waiting = usize::from(!waits[0]);
    let hold = PlanOrder::Hold(PlanHold::Others(vec![1 - waiting as EntityId]));
    assert_eq!(team.act(waiting), hold);
    assert!(!team.has_met());
}

#[test]
fn a_robot_off_its_plan_stands_and_one_that_is_only_turned_turns_back() {
    let plan = plan();
    let mut team = Team::new(&plan);
    (0..2).for_each(|robot| team.tell(robot));
    team.act(0);
    let next = team.plan.pose_after(0, 1).expect("an action");
    team.at[0] = GridPose { heading: (next.heading + 3) % 4, ..next };
    team.executors[0].done = Some(1);
    assert_eq!(team.act(0), PlanOrder::Act(Action::TurnLeft));
    assert_eq!(team.at[0], next);
    team.at[0] = GridPose { col: 0, row: 0, heading: 0 };
    assert_eq!(team.act(0), PlanOrder::Hold(PlanHold::OffPlan));
    team.restart(0);
    team.tell(1);
    assert_eq!(team.act(0), PlanOrder::Hold(PlanHold::OffPlan), "nor does it find its place");
}

#[test]
fn beacons_of_more_than_there_is_are_no_progress() {
    let plan = plan();
    let mut team = Team::new(&plan);
    let beacon = team.beacon(1);
    let lie = DriveBeacon { done: Some(9_999), heard_done: vec![(0, 9_999), (7, 1)], ..beacon };
    team.executors[0].hear(&lie);
    team.executors[0].hear(&DriveBeacon { robot: 8, ..lie.clone() });
    assert_eq!(team.executors[0].heard_done(), []);
    assert_eq!(team.executors[0].uninformed(), [1]);
    assert!(!team.executors[0].is_complete_for_all());
}
