//! CARMEN logs (`.log`, `.log.gz`).
//!
//! Messages read: `ODOM x y theta tv rv accel time host logger_time`,
//! `FLASER n r1 .. rn x y theta odom_x odom_y odom_theta time host logger_time`, `ROBOTLASER1`, CARMEN's scan since 0.6,
//! with the pose of the laser and that of the robot, and
//! `TRUEPOS x y theta odom_x odom_y odom_theta time host logger_time`. Every other message (`NEFF`, `PARAM`, ...) is
//! counted, `#` comments are skipped. A damaged message is skipped and counted; a log of which more than half is damaged
//! is an error.
//!
//! What odometry is compared with, in this order:
//! - `TRUEPOS`: the true pose and that of odometry side by side.
//! - The poses of scans that a SLAM program has corrected. Where the first `ODOM` after a scan repeats its pose, with a
//!   time that is meaningless, `ODOM` continues from there with raw odometry, so that the last one before the next scan is
//!   the pose according to odometry. Otherwise `ODOM`, or the second pose of `FLASER`, is odometry in a frame of its own.
//!
//! A log whose scans are where odometry has them has not been corrected, and teaches nothing.

mod clean;
mod messages;
mod motion;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use sidestep_kernel::InputError;
use sidestep_scenario::file::read_text;

pub use self::clean::write_clean;
use self::messages::{CarmenMessage, ScanKind, ScanMessage, TimedPose};
use super::report::{ImportReport, Treatment};
use super::table::{MAX_TEXT_BYTES, data_lines};
use super::track::Track;

/// Maximum number of kinds of messages that a report lists.
const MAX_KINDS: usize = 20;

/// A pose in the world: x and y in m, heading in rad.
pub type PoseXyTheta = [f64; 3];

/// A log, and what was found in it.
#[derive(Debug, Clone, PartialEq)]
pub struct CarmenLog {
    /// Odometry, and what it is compared with.
    pub motion: CarmenMotion,
    /// What was found in the log.
    pub report: ImportReport,
}

/// Odometry, and what it is compared with.
#[derive(Debug, Clone, PartialEq)]
pub enum CarmenMotion {
    /// Odometry that starts again at each corrected scan.
    Corrected(CorrectedLog),
    /// Odometry and true poses over time, each in a frame of its own.
    Tracks {
        /// The poses by odometry.
        odometry: Track,
        /// The true poses.
        truth: Track,
    },
}

/// A corrected log: scans, and the odometry between them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct CorrectedLog {
    /// Odometry before the first scan.
    pub odometry_before: Vec<PoseXyTheta>,
    /// The scans with the odometry that follows each.
    pub scans: Vec<Scan>,
}

/// One scan and the `ODOM` messages up to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Scan {
    /// Time in s from the start of the log; not always increasing.
    pub t_secs: f64,
    /// Number of beams; their ranges are checked and not kept.
    pub n_beams: u32,
    /// Corrected pose.
    pub pose: PoseXyTheta,
    /// Poses according to odometry after this scan, starting at [`Scan::pose`].
    pub odometry: Vec<PoseXyTheta>,
}

/// Reads a log; `max_speed_mps` is the greatest speed of the robot, see [`SpeedRule`](super::track::SpeedRule).
///
/// # Errors
/// When the file cannot be read, more than half of its messages are damaged, or it has no poses to compare odometry with.
pub fn read(path: &Path, max_speed_mps: Option<f64>) -> Result<CarmenLog, InputError> {
    parse(&path.display().to_string(), &read_text(path, MAX_TEXT_BYTES)?, max_speed_mps)
}

/// Parses the text of a log; `place` is its name in errors.
///
/// # Errors
/// When more than half of its messages are damaged, or it has no poses to compare odometry with.
pub fn parse(place: &str, text: &str, max_speed_mps: Option<f64>) -> Result<CarmenLog, InputError> {
    let content = LogContent::parse(place, text)?;
    let mut report = content.report();
    let motion = motion::choose(place, &content, max_speed_mps, &mut report)?;
    Ok(CarmenLog { motion, report })
}

/// Reports what is in a log.
///
/// # Errors
/// When the file cannot be read, or more than half of its messages are damaged.
pub fn inspect(path: &Path) -> Result<ImportReport, InputError> {
    let text = read_text(path, MAX_TEXT_BYTES)?;
    let content = LogContent::parse(&path.display().to_string(), &text)?;
    let mut report = content.report();
    let chosen = motion::choose(&path.display().to_string(), &content, None, &mut report);
    if let Err(error) = chosen {
        let rule = format!("no wheels can be learned from it: {}", error.cause());
        report.record(Treatment::Suspicious, rule, "", error.remedy());
    }
    Ok(report)
}

/// The messages of a log, in the order of the file.
#[derive(Debug, Default)]
struct LogContent {
    entries: Vec<LogEntry>,
    /// Counts of messages that are read, by name.
    counts: BTreeMap<&'static str, usize>,
    /// Counts of other messages, by name.
    others: BTreeMap<String, u64>,
    damaged: Vec<InputError>,
    n_damaged: u64,
}

/// A message with a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
enum LogEntry {
    Odometry(TimedPose),
    Scan(ScanMessage),
    TruePose(TimedPose, PoseXyTheta),
}

impl LogContent {
    fn parse(place: &str, text: &str) -> Result<Self, InputError> {
        let mut content = Self::default();
        for (line, words) in data_lines(text) {
            match messages::parse(place, line, words) {
                Ok(message) => content.add(message),
                Err(error) => content.add_damaged(error),
            }
        }
        match content.damaged.first() {
            Some(first) if content.n_damaged as usize > content.entries.len() => Err(first.clone()),
            _ => Ok(content),
        }
    }

    fn add(&mut self, message: CarmenMessage<'_>) {
        let (name, entry) = match message {
            CarmenMessage::Odometry(pose) => ("ODOM", LogEntry::Odometry(pose)),
            CarmenMessage::Scan(scan) => (scan.kind.name(), LogEntry::Scan(scan)),
            CarmenMessage::TruePose(truth, odometry) => {
                ("TRUEPOS", LogEntry::TruePose(truth, odometry))
            }
            CarmenMessage::Other(name) => {
                if self.others.len() < MAX_KINDS || self.others.contains_key(name) {
                    *self.others.entry(name.into()).or_insert(0) += 1;
                }
                return;
            }
        };
        *self.counts.entry(name).or_insert(0) += 1;
        self.entries.push(entry);
    }

    fn add_damaged(&mut self, error: InputError) {
        self.n_damaged += 1;
        if self.damaged.len() < crate::report::MAX_PLACES {
            self.damaged.push(error);
        }
    }

    fn count(&self, name: &str) -> usize {
        self.counts.get(name).copied().unwrap_or(0)
    }

    fn scans(&self, kind: ScanKind) -> usize {
        self.count(kind.name())
    }

    fn report(&self) -> ImportReport {
        let mut report = ImportReport::new("CARMEN log");
        if let Some([first, last]) = self.time_range() {
            report
                .add_fact("time", format!("from {first:.3} to {last:.3} s, {:.3} s", last - first));
        }
        for (name, n) in &self.counts {
            report.add_kept(*name, *n);
        }
        for k in 0..self.n_damaged {
            let place = self.damaged.get(k as usize).map_or_else(String::new, |error| {
                let line = error.line_and_column().map_or(0, |(line, _)| line);
                format!("line {line}: {}", error.cause())
            });
            report.record(
                Treatment::Dropped,
                "messages that are damaged",
                place,
                "restore the lines",
            );
        }
        for (name, n) in &self.others {
            let rule = format!("messages {name}, {n} of them");
            report.record(Treatment::NotUsed, rule, "", "");
        }
        report
    }

    /// Returns the times of the first and the last scan or true pose: those of `ODOM` may be meaningless.
    fn time_range(&self) -> Option<[f64; 2]> {
        let times = self.entries.iter().filter_map(|entry| match entry {
            LogEntry::Odometry(_) => None,
            LogEntry::Scan(scan) => Some(scan.at.t_secs),
            LogEntry::TruePose(truth, _) => Some(truth.t_secs),
        });
        times.fold(None, |range, t_secs| {
            let [first, last] = range.unwrap_or([t_secs; 2]);
            Some([first.min(t_secs), last.max(t_secs)])
        })
    }

    /// Returns the messages as an error lists them.
    fn describe(&self) -> String {
        let read = self.counts.iter().map(|(name, n)| format!("{n} {name}"));
        let others = self.others.iter().map(|(name, n)| format!("{n} {name}"));
        let all: Vec<String> = read.chain(others).take(MAX_KINDS).collect();
        if all.is_empty() { "no message".into() } else { all.join(", ") }
    }
}
