//! A robot that its program drives: measurements in, velocities out.

use super::DriveVelocity;
use super::beacon::DriveBeacon;
use super::controller::{ActionOutcome, ActionProgress, Controller, DriveLimits, DriveState};
use super::grid::{BodyGrid, GridLocalizer, Pose2};
use super::guard::{Guard, GuardCause, GuardCounts, GuardLimits, GuardView};
use super::neighbors::Neighbors;
use super::percept::{PerceptBuilder, RobotSituation};
use super::plan::{ActionPlanner, GridMotion};
use super::plan_executor::{PlanExecutor, PlanHold, PlanOrder};
use super::scan::RangeScan;
use super::team_plan::TeamPlan;
use crate::agents::{RobotAgent, RobotControl, RobotPercept};
use crate::decide::pass_request::{HEARD_REQUEST_WORD, OWN_REQUEST_WORD, own_request};
use crate::decide::{ActionId, Contact, TripEvent, order_action};
use crate::effector::STAY;
use crate::goal_agent::{GoalAgent, GoalRefusal};
use crate::plan::{action_id, place_in_team};
use crate::scenario::Compiled;
use crate::world::RobotsWorld;
use sidestep_kernel::{Cycle, EntityId, InputError};
use sidestep_planners::GridPose;
use sidestep_scenario::Source;
use std::fmt;
use std::sync::Arc;

/// An action that a robot has carried out.
#[derive(Debug, Clone, PartialEq)]
pub struct DrivenAction {
    /// The number of its decision, from 0.
    pub cycle: Cycle,
    /// Its number in the effector.
    pub action: ActionId,
    /// Where the robot stood after it.
    pub end: GridPose,
    /// What it came to, in boxes and quarter turns.
    pub motion: GridMotion,
    /// What stopped it.
    pub contact: Option<Contact>,
    /// Whether it took too long.
    pub is_timed_out: bool,
    /// How long it took, in seconds of the robot's own time.
    pub duration_s: f64,
}

/// The state of a drive.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct DriveCounts {
    /// Actions that are over.
    pub actions: u64,
    /// Actions that a contact ended.
    pub contacts: u64,
    /// Actions that took too long.
    pub timeouts: u64,
    /// Trips that are complete.
    pub trips: u64,
    /// Times that it began to wait until others have done an action of a plan.
    pub plan_waits: u64,
    /// How often the guard has stepped in.
    pub guard: GuardCounts,
}

/// What decides for a robot.
#[derive(Debug)]
enum DriveProgram {
    /// The behavior of the scenario.
    Own(RobotAgent),
    /// Goals from outside.
    Goals(Box<GoalAgent>),
}

impl DriveProgram {
    fn new(world: &Arc<RobotsWorld>, id: EntityId) -> Option<Self> {
        if let Some(agent) = RobotAgent::new(world.clone(), id) {
            return Some(Self::Own(agent));
        }
        GoalAgent::new(world.clone(), id).map(|agent| Self::Goals(Box::new(agent)))
    }

    /// Returns whether there is nothing that it could decide.
    fn is_idle(&self) -> bool {
        matches!(self, Self::Goals(agent) if agent.goal().is_none())
    }

    /// Decides by a percept, the memory of which has the request to make room that is heard.
    fn decide(&mut self, percept: &RobotPercept) -> Result<RobotControl, String> {
        match self {
            Self::Own(agent) => agent.decide(percept),
            Self::Goals(agent) => {
                agent.hear_request(percept.memory[HEARD_REQUEST_WORD]);
                agent.decide(percept)
            }
        }
    }
}

/// The reason why a robot that is driven does not take a goal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DriveGoalRefusal {
    /// It decides by a behavior of its own.
    OwnProgram,
    /// Where it stands is not known yet.
    NoPlace,
    /// It cannot get there.
    Goal(GoalRefusal),
}

impl fmt::Display for DriveGoalRefusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OwnProgram => write!(f, "the robot decides by a behavior of its own"),
            Self::NoPlace => write!(f, "where the robot stands is not known yet"),
            Self::Goal(refusal) => refusal.fmt(f),
        }
    }
}

/// The program of a robot, and all that it takes to drive by it.
#[derive(Debug)]
pub struct Driver {
    program: DriveProgram,
    grid: BodyGrid,
    localizer: GridLocalizer,
    percepts: PerceptBuilder,
    planner: ActionPlanner,
    limits: DriveLimits,
    guard: Guard,
    /// The kind of what stops the robot where the map has nothing.
    robot_kind: u8,
    present: Option<PresentAction>,
    cycle: Cycle,
    contact: Option<Contact>,
    memory: [u32; 4],
    counts: DriveCounts,
    neighbors: Neighbors,
    /// Its last word to others.
    word: Option<u64>,
    /// Where it has decided last.
    decided_at: Option<GridPose>,
    /// The robots whose words were a part of its last percept.
    heard: Vec<EntityId>,
    /// Its part in a plan; none where it decides by itself.
    executor: Option<PlanExecutor>,
    /// Why it stands instead of doing its next action of the plan.
    hold: Option<PlanHold>,
    /// Whether it has decided at the end of its plan, where it may have completed a trip.
    has_closed: bool,
}

/// What comes between two actions.
enum Turn {
    /// Its program decides for an action.
    Act,
    /// Its program decides once more at the end of the plan, where nothing is left to do.
    Close,
    /// It stands, and decides nothing.
    Stand,
}

#[derive(Debug)]
struct PresentAction {
    action: ActionId,
    controller: Controller,
}

/// What a step of a drive has brought.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveStep {
    /// The velocity that the robot is to have, after the guard.
    pub velocity: DriveVelocity,
    /// The action that is over.
    pub ended: Option<DrivenAction>,
    /// Why the guard steps in, if it does.
    pub guarded_by: Option<GuardCause>,
}

impl Driver {
    /// Returns the driver of a robot.
    ///
    /// # Errors
    /// With the cause and the remedy, when a real robot cannot be driven so.
    pub fn new(
        world: &Arc<RobotsWorld>,
        id: EntityId,
        limits: DriveLimits,
        guard: GuardLimits,
    ) -> Result<Self, (String, String)> {
        if place_in_team(world, id).is_some() {
            let cause = format!("robot {id} does what the planner of its team says");
            return Err((
                cause,
                "remove `planner`, or drive it by the plan of its scenario".into(),
            ));
        }
        Self::with_program(world, id, limits, guard)
    }

    /// Returns the driver of a robot of a scenario. Where planners lead the robots, it carries out its part of the plan of a
    /// run without errors, which each driver computes for itself.
    ///
    /// # Errors
    /// When a real robot cannot be driven so, or there is no plan without a ring.
    pub fn of_scenario(
        compiled: &Compiled,
        source: &Source,
        id: EntityId,
        limits: DriveLimits,
        guard: GuardLimits,
    ) -> Result<Self, InputError> {
        let world = &compiled.world;
        let refused =
            |(cause, remedy): (String, String)| InputError::new(&source.place, cause, remedy);
        // A robot that is not there is in no team, and is refused there.
        if place_in_team(world, id).is_none() {
            return Self::new(world, id, limits, guard).map_err(refused);
        }
        let plan = TeamPlan::new(compiled, source)?;
        let mut driver = Self::with_program(world, id, limits, guard).map_err(refused)?;
        driver.executor = Some(PlanExecutor::new(Arc::new(plan), id));
        Ok(driver)
    }

    fn with_program(
        world: &Arc<RobotsWorld>,
        id: EntityId,
        limits: DriveLimits,
        guard: GuardLimits,
    ) -> Result<Self, (String, String)> {
        let Some(grid) = BodyGrid::new(world, id) else {
            let cause = format!("there is no robot {id}");
            let last = world.robot_count().saturating_sub(1);
            return Err((cause, format!("give one of 0 to {last}")));
        };
        let no_program = || {
            let cause = format!("robot {id} has no program");
            (
                cause,
                "give its section a behavior, e.g. behaviour = { kind = \"wander\" }".to_string(),
            )
        };
        let program = DriveProgram::new(world, id).ok_or_else(no_program)?;
        let percepts = PerceptBuilder::new(world, id).ok_or_else(no_program)?;
        let planner = ActionPlanner::new(world, id).map_err(|cause| {
            let remedy = "a robot with two wheels goes ahead or back and turns; give it such an effector, e.g. nomad";
            (cause, remedy.to_string())
        })?;
        Ok(Self {
            program,
            localizer: GridLocalizer::new(grid.clone()),
            guard: Guard::new(guard, grid.clone()),
            grid,
            percepts,
            planner,
            limits,
            robot_kind: world.type_of(id).kind,
            present: None,
            cycle: 0,
            contact: None,
            memory: [0; 4],
            counts: DriveCounts::default(),
            neighbors: Neighbors::new(world.clone(), id),
            word: None,
            decided_at: None,
            heard: Vec::new(),
            executor: None,
            hold: None,
            has_closed: false,
        })
    }

    /// Takes what another robot tells of itself, in place of what it told before.
    pub fn hear(&mut self, beacon: DriveBeacon) {
        if let Some(executor) = &mut self.executor {
            executor.hear(&beacon);
        }
        self.neighbors.hear(beacon);
    }

    /// Forgets the place and the words of a robot that is silent. What it has done of a plan stays done.
    pub fn forget(&mut self, robot: EntityId) {
        self.neighbors.forget(robot);
    }

    /// Returns what this robot tells others; nothing as long as its place is not known.
    pub fn beacon(&self) -> Option<DriveBeacon> {
        let at = self.localizer.present()?;
        let request = own_request(self.memory[OWN_REQUEST_WORD]).map_or(0, |request| request.1);
        // A request is for what is before the place where it was made; from the next box it would reach farther.
        let is_there = self.decided_at.is_some_and(|asked| asked.position() == at.position());
        let plan = self.executor.as_ref();
        Some(DriveBeacon {
            robot: self.neighbors.own(),
            at,
            word: self.word,
            request: if self.neighbors.has_requests() && is_there { request } else { 0 },
            done: plan.and_then(PlanExecutor::done),
            heard_done: plan.map_or(Vec::new(), PlanExecutor::heard_done),
        })
    }

    /// Returns the robots whose words were a part of its last percept.
    pub fn heard(&self) -> &[EntityId] {
        &self.heard
    }

    /// Returns its part in a plan; none where it decides by itself.
    pub fn plan(&self) -> Option<&PlanExecutor> {
        self.executor.as_ref()
    }

    /// Returns why it stands instead of doing its next action of a plan.
    pub fn hold(&self) -> Option<&PlanHold> {
        self.hold.as_ref()
    }

    /// Returns the percepts' builder, which knows the beams of the scenario.
    pub fn percepts(&self) -> &PerceptBuilder {
        &self.percepts
    }

    /// Returns whether it goes where it is told ([`Self::set_goal`]).
    pub fn takes_goals(&self) -> bool {
        matches!(self.program, DriveProgram::Goals(_))
    }

    /// Takes a pose in the frame of the map as its goal, in place of the one before. An action that is under way is
    /// completed first.
    ///
    /// # Errors
    /// When it takes none, or cannot get there; the goal before stays then.
    pub fn set_goal(&mut self, pose: &Pose2) -> Result<GridPose, DriveGoalRefusal> {
        let DriveProgram::Goals(agent) = &mut self.program else {
            return Err(DriveGoalRefusal::OwnProgram);
        };
        let from = self.localizer.present().ok_or(DriveGoalRefusal::NoPlace)?;
        agent.set_goal(from, pose).map_err(DriveGoalRefusal::Goal)
    }

    /// Returns the number of the next decision.
    pub fn cycle(&self) -> Cycle {
        self.cycle
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> DriveCounts {
        DriveCounts { guard: self.guard.counts(), ..self.counts }
    }

    /// Takes a measurement that is fresh, and the scan before it with its age in seconds.
    ///
    /// # Errors
    /// When the percept is none of this robot, with the reason.
    pub fn step(
        &mut self,
        state: &DriveState,
        scan: &RangeScan,
        age_s: f64,
    ) -> Result<DriveStep, String> {
        let view = GuardView { pose: Some(&state.pose), scan: Some(scan), age_s };
        let Some(at) = self.localizer.update(&state.pose) else {
            // Off the map there is no percept; the action goes on when the robot is back.
            return Ok(self.guarded(DriveVelocity::ZERO, None, &view));
        };
        let mut ended = None;
        if let Some(present) = &mut self.present {
            match present.controller.update(state) {
                ActionProgress::UnderWay(wanted) => return Ok(self.guarded(wanted, None, &view)),
                ActionProgress::Done(outcome) => ended = self.end_action(outcome, at),
            }
        }
        if !self.program.is_idle() {
            match self.turn(at) {
                Turn::Stand => {}
                Turn::Close => {
                    self.decide(state, scan, at)?;
                }
                Turn::Act => self.begin_action(state, scan, at)?,
            }
        }
        Ok(self.guarded(DriveVelocity::ZERO, ended, &view))
    }

    /// Returns whether it decides now. Under a plan it does when the plan has an action for it, which is then in its memory,
    /// as planners of a run leave it there.
    fn turn(&mut self, at: GridPose) -> Turn {
        let Some(executor) = &mut self.executor else { return Turn::Act };
        let order = executor.next_order(at);
        let was_waiting = matches!(self.hold, Some(PlanHold::Others(_)));
        self.hold = None;
        match order {
            PlanOrder::Act(action) => {
                order_action(&mut self.memory, action_id(action));
                Turn::Act
            }
            PlanOrder::Complete if self.has_closed => Turn::Stand,
            PlanOrder::Complete => {
                order_action(&mut self.memory, STAY);
                self.has_closed = true;
                Turn::Close
            }
            PlanOrder::Hold(hold) => {
                let is_wait = matches!(hold, PlanHold::Others(_));
                self.counts.plan_waits += u64::from(is_wait && !was_waiting);
                self.hold = Some(hold);
                Turn::Stand
            }
        }
    }

    /// Returns whether measurements of an age in seconds are fresh enough to move by.
    pub fn is_fresh(&self, age_s: f64) -> bool {
        self.guard.is_fresh(age_s)
    }

    /// Takes note that there is no fresh measurement: the robot is to stand.
    pub fn stop(&mut self, view: &GuardView<'_>) -> DriveStep {
        self.guarded(DriveVelocity::ZERO, None, view)
    }

    fn guarded(
        &mut self,
        wanted: DriveVelocity,
        ended: Option<DrivenAction>,
        view: &GuardView<'_>,
    ) -> DriveStep {
        let velocity = self.guard.limit(wanted, view);
        DriveStep { velocity, ended, guarded_by: self.guard.cause() }
    }

    fn end_action(&mut self, outcome: ActionOutcome, end: GridPose) -> Option<DrivenAction> {
        let present = self.present.take()?;
        self.contact = outcome.contact;
        self.counts.actions += 1;
        self.counts.contacts += u64::from(outcome.contact.is_some());
        self.counts.timeouts += u64::from(outcome.is_timed_out);
        let driven = DrivenAction {
            cycle: self.cycle,
            action: present.action,
            end,
            motion: GridMotion::between(present.controller.plan().start, end),
            contact: outcome.contact,
            is_timed_out: outcome.is_timed_out,
            duration_s: present.controller.duration_s(),
        };
        self.cycle += 1;
        Some(driven)
    }

    /// Returns the action for which the program decides.
    fn decide(
        &mut self,
        state: &DriveState,
        scan: &RangeScan,
        at: GridPose,
    ) -> Result<ActionId, String> {
        if self.neighbors.has_requests() {
            // Of what it has heard before it has taken notice.
            self.memory[HEARD_REQUEST_WORD] = self.neighbors.request_to(at);
        }
        let situation = RobotSituation {
            cycle: self.cycle,
            at,
            pose: state.pose,
            contact: self.contact,
            memory: self.memory,
        };
        let heard = self.neighbors.words_heard(at);
        self.heard = heard.iter().map(|message| message.sender).collect();
        let percept = RobotPercept { heard, ..self.percepts.percept(&situation, scan) };
        let control = self.program.decide(&percept)?;
        self.decided_at = Some(at);
        self.memory = control.memory;
        // The last word stays until there is another one, as in a run.
        self.word = control.broadcast.or(self.word);
        self.counts.trips += u64::from(control.trip == Some(TripEvent::Completed));
        Ok(control.action)
    }

    fn begin_action(
        &mut self,
        state: &DriveState,
        scan: &RangeScan,
        at: GridPose,
    ) -> Result<(), String> {
        let action = self.decide(state, scan, at)?;
        let plan = self.planner.plan(action, at);
        let controller = Controller::start(self.limits, &self.grid, plan, state, self.robot_kind);
        self.present = Some(PresentAction { action, controller });
        Ok(())
    }
}
