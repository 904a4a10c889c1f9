//! The program of a robot that drives a plant: it waits for measurements, decides, and commands velocities, until it has
//! done what it was to do.
//!
//! ```text
//! bag.rs         what was heard and commanded, as a bag of ROS 2
//! motion_log.rs  the table of its motions, from which `sidestep learn effector` learns
//! ```

pub mod bag;
pub mod motion_log;

use crate::plant::{Plant, PlantState};
use motion_log::MotionLog;
use sidestep::kernel::ports::RecordError;
use sidestep::worlds::robots::drive::DriveVelocity;
use sidestep::worlds::robots::drive::controller::DriveState;
use sidestep::worlds::robots::drive::driver::{DriveStep, Driver};
use sidestep::worlds::robots::drive::grid::Pose2;
use sidestep::worlds::robots::drive::guard::{GuardCause, GuardView};
use sidestep_session::fleet::DriveStatus;
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
    /// Number of actions.
    pub actions: u64,
    /// Number of complete trips; none for any.
    pub trips: Option<u64>,
}

/// A drive.
#[derive(Debug)]
pub struct Drive<'a, P: Plant> {
    plant: &'a mut P,
    driver: Driver,
    end: DriveEnd,
    log: Option<MotionLog>,
    /// The time of the last pose that was used, in seconds.
    last_s: Option<f64>,
    status: DriveStatus,
    cause: Option<GuardCause>,
    has_counted_blind_beams: bool,
}

impl<'a, P: Plant> Drive<'a, P> {
    /// Returns a drive that has not begun.
    pub fn new(plant: &'a mut P, driver: Driver, end: DriveEnd, log: Option<MotionLog>) -> Self {
        Self {
            plant,
            driver,
            end,
            log,
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
            let step = self.step(&state)?;
            // After the step, by which it is known where the robot stands.
            let has_goal = state.goal.as_ref().is_some_and(|goal| self.take_goal(goal));
            let Some(step) = step else {
                if has_goal {
                    on_status(&self.status(&state));
                }
                continue;
            };
            self.plant.command(step.velocity).map_err(DriveError::Plant)?;
            let is_news = self.record(&step)? || has_goal || missing != state.missing;
            missing.clone_from(&state.missing);
            if is_news {
                on_status(&self.status(&state));
            }
        }
        Ok(())
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
            ..self.status.clone()
        }
    }

    fn is_done(&self) -> bool {
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
