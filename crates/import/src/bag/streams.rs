//! Messages with stamps, by the sources that send them.

use super::messages::LaserScan;
use super::poses::StampedPose;

/// A value of a message with a stamp.
pub(super) trait HasStamp {
    /// Returns the time in s.
    fn t_secs(&self) -> f64;
    /// Returns the time of the recording in s.
    fn log_secs(&self) -> f64;
    /// Returns the number of its message on its topic from 1, which reports give.
    fn message(&self) -> u64;
    /// Sets the time.
    fn set_t_secs(&mut self, t_secs: f64);
}

impl HasStamp for StampedPose {
    fn t_secs(&self) -> f64 {
        self.t_secs
    }

    fn log_secs(&self) -> f64 {
        self.log_secs
    }

    fn message(&self) -> u64 {
        self.message
    }

    fn set_t_secs(&mut self, t_secs: f64) {
        self.t_secs = t_secs;
    }
}

/// A scan, and when it was recorded.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RecordedScan {
    pub(super) message: u64,
    pub(super) log_secs: f64,
    pub(super) scan: LaserScan,
}

impl HasStamp for RecordedScan {
    fn t_secs(&self) -> f64 {
        self.scan.header.stamp.secs()
    }

    fn log_secs(&self) -> f64 {
        self.log_secs
    }

    fn message(&self) -> u64 {
        self.message
    }

    fn set_t_secs(&mut self, t_secs: f64) {
        self.scan.header.stamp = super::messages::Time::from_secs(t_secs);
    }
}

/// The messages of one source in the order of the recording.
pub(super) struct Stream<'a> {
    /// Its name for people: `/odom`.
    pub(super) name: String,
    pub(super) items: Vec<&'a mut dyn HasStamp>,
}

impl Stream<'_> {
    /// Returns the stamps with the times of the recording.
    pub(super) fn timings(&self) -> Vec<Timing> {
        self.items.iter().map(|item| Timing::of(&**item)).collect()
    }

    /// Moves the stamps from a message on.
    pub(super) fn shift_from(&mut self, start: usize, secs: f64) {
        for item in &mut self.items[start..] {
            let t_secs = item.t_secs() + secs;
            item.set_t_secs(t_secs);
        }
    }
}

/// A stamp, and the time of the recording, in s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Timing {
    pub(super) t_secs: f64,
    pub(super) log_secs: f64,
}

impl Timing {
    pub(super) fn of(item: &dyn HasStamp) -> Self {
        Self { t_secs: item.t_secs(), log_secs: item.log_secs() }
    }

    /// Returns by how much the stamp is ahead of the recording, in s.
    pub(super) fn ahead_secs(self) -> f64 {
        self.t_secs - self.log_secs
    }
}
