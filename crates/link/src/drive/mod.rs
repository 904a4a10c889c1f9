//! The program of a robot that drives a plant: it waits for measurements, decides, and commands velocities, until it has
//! done what it was to do.
//!
//! ```text
//! beacon.rs      what robots tell each other
//! bag.rs         what was heard and commanded, as a bag of ROS 2
//! motion_log.rs  the table of its motions, from which `sidestep learn effector` learns
//! ```

pub mod bag;
pub mod beacon;
pub mod motion_log;

use crate::plant::{Plant, PlantState};
use beacon::Beacons;
use motion_log::MotionLog;
use sidestep::kernel::EntityId;
use sidestep::kernel::ports::RecordError;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::controller::DriveState;
use sidestep::worlds::robots::drive::driver::{DriveStep, Driver};
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::drive::guard::{GuardCause, GuardView};
use sidestep::worlds::robots::drive::plan_executor::{PlanExecutor, PlanHold};
use sidestep_session::fleet::{DriveStatus, PlanStatus};
use std::time::{Duration, Instant};

/// The longest wait for a pose: then the process looks whether it has to end, and whether measurements are still fresh.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// The reason why a drive has ended before it was done.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// It was asked to end.
    #[error("interrupted")]
    Interrupted,
    /// The robot cannot be reached anymore.
    #[error("the robot cannot be reached: {0}")]
    Plant(String),
    /// The program of the robot refuses a percept.
    #[error("the percept is refused: {0}")]
    Percept(String),
    /// The bag cannot be written.
    #[error(transparent)]
    Bag(#[from] RecordError),
    /// The table of motions cannot be written.
    #[error("the table of motions cannot be written: {0}")]
    Log(#[from] std::io::Error),
}

/// When a drive is done.
#[derive(Debug, Clone, Copy)]
pub struct DriveEnd {
    /// Number of actions; one that carries out a plan ends with the plan of all.
    pub actions: u64,
    /// Number of complete trips; none for any.
    pub trips: Option<u64>,
}

/// What changes with what others tell.
#[derive(Debug, Default, PartialEq, Eq)]
struct TeamNews {
    heard: Vec<EntityId>,
    silent: Vec<EntityId>,
    hold: Option<PlanHold>,
}

/// A drive.
#[derive(Debug)]
pub struct Drive<'a, P: Plant> {
    plant: &'a mut P,
    driver: Driver,
    end: DriveEnd,
    log: Option<MotionLog>,
    beacons: Beacons,
    /// What was told last of those who are silent, who are heard, and why it stands.
    team_news: TeamNews,
    /// The time of the last pose that was used, in seconds.
    last_s: Option<f64>,
    status: DriveStatus,
    cause: Option<GuardCause>,
    has_counted_blind_beams: bool,
}

impl<'a, P: Plant> Drive<'a, P> {
    /// Returns a drive that has not begun.
    pub fn new(
        plant: &'a mut P,
        driver: Driver,
        beacons: Beacons,
        end: DriveEnd,
        log: Option<MotionLog>,
    ) -> Self {
        Self {
            plant,
            driver,
            end,
            log,
            beacons,
            team_news: TeamNews::default(),
            last_s: None,
            status: DriveStatus::default(),
            cause: None,
            has_counted_blind_beams: false,
        }
    }

    /// Drives until it is done, or until `has_to_end` says so, and tells each change. However it ends, the robot is told to
    /// stand.
    ///
    /// # Errors
    /// When it is interrupted, or something cannot be sent or written.
    pub fn pass(
        &mut self,
        has_to_end: &dyn Fn() -> bool,
        on_status: &mut dyn FnMut(&DriveStatus),
    ) -> Result<(), DriveError> {
        let mut missing = None;
        while !self.is_done() {
            if has_to_end() {
                return Err(DriveError::Interrupted);
            }
            let state = self.plant.wait(POLL_INTERVAL);
            self.status.unreadable = state.unreadable;
            self.status.outdated = state.outdated;
            self.hear();
            let mut is_news = false;
            if let Some(step) = self.step(&state)? {
                self.plant.command(step.velocity).map_err(DriveError::Plant)?;
                is_news |= self.record(&step)? || missing != state.missing;
                missing.clone_from(&state.missing);
            }
            // After the step, by which it is known where the robot stands.
            is_news |= state.goal.as_ref().is_some_and(|goal| self.take_goal(goal));
            self.tell()?;
            is_news |= self.has_team_news();
            if is_news {
                on_status(&self.status(&state));
            }
        }
        Ok(())
    }

    /// Takes what other robots tell, and forgets those that are silent.
    fn hear(&mut self) {
        let arrived = self.plant.take_beacons();
        let now = Instant::now();
        self.beacons.count_overflow(arrived.dropped);
        for bytes in &arrived.messages {
            if let Some(beacon) = self.beacons.read(bytes, now) {
                self.driver.hear(beacon);
            }
        }
        for robot in self.beacons.find_silent(now) {
            self.driver.forget(robot);
        }
    }

    /// Tells the others of this robot, if there is something to tell.
    fn tell(&mut self) -> Result<(), DriveError> {
        let Some(beacon) = self.driver.beacon() else { return Ok(()) };
        let Some(message) = self.beacons.next_message(beacon, Instant::now()) else {
            return Ok(());
        };
        self.plant.tell(&message).map_err(DriveError::Plant)
    }

    fn has_team_news(&mut self) -> bool {
        let news = TeamNews {
            heard: self.driver.heard().to_vec(),
            silent: self.beacons.silent(),
            hold: self.driver.hold().cloned(),
        };
        let is_news = news != self.team_news;
        self.team_news = news;
        is_news
    }

    fn plan_status(&self, plan: &PlanExecutor) -> PlanStatus {
        let hold = self.driver.hold();
        PlanStatus {
            actions: plan.actions(),
            done: plan.done(),
            waits: self.driver.counts().plan_waits,
            hold: hold.map(|hold| self.hold_text(hold)),
            waits_for: hold.map_or(Vec::new(), |hold| hold.robots().to_vec()),
        }
    }

    /// Returns why it stands, and which of those for whom it waits are silent.
    fn hold_text(&self, hold: &PlanHold) -> String {
        let silent = self.beacons.silent();
        let silent = silent.iter().filter(|robot| hold.robots().contains(robot));
        let silent: Vec<String> = silent.map(ToString::to_string).collect();
        if silent.is_empty() {
            return hold.to_string();
        }
        format!("{hold}; silent: {}", silent.join(", "))
    }

    /// Returns the state so far.
    pub fn status(&self, state: &PlantState) -> DriveStatus {
        let guarded_by = self.cause.map(|cause| match (cause, &state.missing) {
            (GuardCause::OldState, Some(missing)) => format!("waits: {missing}"),
            (GuardCause::OldState, None) => "stands: its measurements are too old".into(),
            (GuardCause::OffMap, _) => "stands: it is off the free boxes of the map".into(),
            (GuardCause::Obstacle, _) => "brakes: something is near".into(),
        });
        DriveStatus { guarded_by, ..self.final_status() }
    }

    /// Returns the counts so far.
    pub fn final_status(&self) -> DriveStatus {
        let counts = self.driver.counts();
        DriveStatus {
            actions: counts.actions,
            contacts: counts.contacts,
            timeouts: counts.timeouts,
            trips: counts.trips,
            guarded_by: None,
            old_states: counts.guard.old_states,
            off_map: counts.guard.off_map,
            obstacles: counts.guard.obstacles,
            beacons: self.beacons.counts(),
            heard: self.driver.heard().to_vec(),
            silent: self.beacons.silent(),
            plan: self.driver.plan().map(|plan| self.plan_status(plan)),
            ..self.status.clone()
        }
    }

    fn is_done(&self) -> bool {
        if let Some(plan) = self.driver.plan() {
            // Others may still wait to be told of its end, as long as they are there.
            let silent = self.beacons.silent();
            let is_told = plan.uninformed().iter().all(|robot| silent.contains(robot));
            return plan.is_complete_for_all() && is_told;
        }
        let counts = self.driver.counts();
        let has_all_trips = self.end.trips.is_some_and(|trips| counts.trips >= trips);
        counts.actions >= self.end.actions || has_all_trips
    }

    /// Takes a goal, or refuses and tells it; returns true, because both are news.
    fn take_goal(&mut self, goal: &Result<Pose2, String>) -> bool {
        let taken = goal
            .clone()
            .and_then(|pose| self.driver.set_goal(&pose).map_err(|refusal| refusal.to_string()));
        match taken {
            Ok(place) => {
                self.status.goals += 1;
                self.status.goal = Some((place.col, place.row));
            }
            Err(reason) => {
                self.status.refused_goals += 1;
                tracing::warn!(
                    "a goal is refused: {reason} ({} refused so far)",
                    self.status.refused_goals
                );
            }
        }
        true
    }

    /// Goes on by a pose that is new. Without one the last velocity stays, but not for longer than measurements are fresh.
    fn step(&mut self, state: &PlantState) -> Result<Option<DriveStep>, DriveError> {
        let age_s = state.age_s(Instant::now());
        let measured = state.pose.as_ref().zip(state.scan.as_ref());
        if let Some((pose, scan)) = measured
            && self.last_s != Some(pose.time_s)
            && self.driver.is_fresh(age_s)
        {
            self.last_s = Some(pose.time_s);
            self.warn_of_blind_beams(&scan.value);
            let at = DriveState {
                time_s: pose.time_s,
                pose: pose.value,
                is_touching: state.is_touching,
            };
            let step = self.driver.step(&at, &scan.value, age_s).map_err(DriveError::Percept)?;
            return Ok(Some(step));
        }
        if self.driver.is_fresh(age_s) {
            return Ok(None);
        }
        let view = GuardView {
            pose: state.pose.as_ref().map(|pose| &pose.value),
            scan: state.scan.as_ref().map(|scan| &*scan.value),
            age_s,
        };
        Ok(Some(self.driver.stop(&view)))
    }

    fn warn_of_blind_beams(&mut self, scan: &sidestep::worlds::robots::drive::scan::RangeScan) {
        if std::mem::replace(&mut self.has_counted_blind_beams, true) {
            return;
        }
        let blind = self.driver.percepts().blind_beams(scan);
        if blind > 0 {
            tracing::warn!(
                "{blind} beams of the scenario look where the scanner does not: they always report nothing"
            );
        }
    }

    /// Keeps what a step has brought, and returns whether others want to know it.
    fn record(&mut self, step: &DriveStep) -> Result<bool, DriveError> {
        let mut is_news = step.guarded_by != self.cause;
        self.cause = step.guarded_by;
        if let Some(driven) = &step.ended {
            is_news = true;
            self.status.at = Some((driven.end.col, driven.end.row));
            if let Some(log) = &mut self.log {
                log.record(driven, self.last_s.unwrap_or(0.0))?;
            }
        }
        Ok(is_news)
    }
}

impl<P: Plant> Drop for Drive<'_, P> {
    fn drop(&mut self) {
        // On every way out, panics included. An error means that nothing can be sent anymore: then the robot stops by its own
        // timeout for commands.
        let _ = self.plant.command(DriveVelocity::ZERO);
    }
}

#[cfg(test)]
mod tests;
