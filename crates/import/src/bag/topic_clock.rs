//! The stamps of one topic against the times of the recording, without keeping them all.

use super::offsets;
use super::streams::Timing;
use crate::report::{ImportReport, MAX_PLACES, Treatment};

/// Stamps further back than this are from a clock that was set back.
const MAX_BACKWARD_STEP_SECS: f64 = 0.5;
/// Maximum number of stamps of a topic that are compared with the recording: of more every second, every fourth, and so on.
const MAX_TIMINGS: usize = 1 << 12;

/// The stamps of a topic.
pub(super) struct TopicClock {
    stamps: u64,
    first_secs: f64,
    last_secs: f64,
    latest_secs: f64,
    /// Every so many stamps are kept with the times of the recording.
    every: u64,
    timings: Vec<Timing>,
    backward_steps: Vec<String>,
    backward: u64,
}

impl TopicClock {
    pub(super) fn from_first(timing: Timing) -> Self {
        let t_secs = timing.t_secs;
        Self {
            stamps: 1,
            first_secs: t_secs,
            last_secs: t_secs,
            latest_secs: t_secs,
            every: 1,
            timings: vec![timing],
            backward_steps: Vec::new(),
            backward: 0,
        }
    }

    /// Adds the stamp of the message of this number.
    pub(super) fn add(&mut self, message: u64, timing: Timing) {
        let t_secs = timing.t_secs;
        self.keep_timing(timing);
        self.stamps += 1;
        let back_secs = self.latest_secs - t_secs;
        if back_secs > MAX_BACKWARD_STEP_SECS {
            self.backward += 1;
            if self.backward_steps.len() < MAX_PLACES {
                self.backward_steps.push(format!("message {message}: {back_secs:.3} s"));
            }
            self.latest_secs = t_secs;
        }
        self.latest_secs = self.latest_secs.max(t_secs);
        self.first_secs = self.first_secs.min(t_secs);
        self.last_secs = self.last_secs.max(t_secs);
    }

    fn keep_timing(&mut self, timing: Timing) {
        if !self.stamps.is_multiple_of(self.every) {
            return;
        }
        self.timings.push(timing);
        if self.timings.len() > MAX_TIMINGS {
            self.every *= 2;
            let mut is_even = false;
            self.timings.retain(|_| {
                is_even = !is_even;
                is_even
            });
        }
    }

    /// Returns the stamps that were kept, with the times of the recording.
    pub(super) fn timings(&self) -> &[Timing] {
        &self.timings
    }

    /// Returns the time that the stamps span.
    pub(super) fn describe(&self) -> String {
        format!("from {:.3} to {:.3} s", self.first_secs, self.last_secs)
    }

    /// Records what can hardly be right with the stamps.
    pub(super) fn report(&self, topic: &str, report: &mut ImportReport) {
        let rule = format!("stamps of {topic} that go back");
        for k in 0..self.backward {
            let place = self.backward_steps.get(k as usize).cloned().unwrap_or_default();
            report.record(Treatment::Suspicious, rule.clone(), place, "");
        }
        self.report_forward(topic, report);
        let offset_secs = offsets::known_offset(&self.timings);
        if let Some(ahead_secs) = offset_secs.filter(|secs| *secs > offsets::MAX_AHEAD_SECS) {
            let rule = format!(
                "stamps of {topic} that lie {ahead_secs:.3} s after the recording of their messages"
            );
            let remedy = "synchronize the clocks of the machines";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
        if self.stamps > 1 && self.first_secs == 0.0 && self.last_secs == 0.0 {
            let rule =
                format!("the stamps of {topic} are all 0: the times of the recording are used");
            report.record(Treatment::Guessed, rule, "", "");
        }
    }

    fn report_forward(&self, topic: &str, report: &mut ImportReport) {
        // Of stamps that are not all kept, no single one is known to be wrong.
        let unusable =
            if self.every == 1 { offsets::unusable_stamps(&self.timings) } else { Vec::new() };
        for (k, why) in &unusable {
            let place = format!("message {}", k + 1);
            report.record(Treatment::Suspicious, format!("messages on {topic} {why}"), place, "");
        }
        let mut usable = self.timings.clone();
        let mut index = 0;
        usable.retain(|_| {
            index += 1;
            !unusable.iter().any(|(k, _)| k + 1 == index)
        });
        for (item, step_secs) in offsets::forward_steps(&usable) {
            let place = format!("at {:.3} s by {step_secs:.3} s", usable[item].t_secs);
            let rule = format!("stamps of {topic} that jump ahead");
            report.record(Treatment::Suspicious, rule, place, "");
        }
    }
}
