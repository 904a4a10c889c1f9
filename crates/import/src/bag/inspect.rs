//! What is in a bag, without what is learned from it: every topic, every message that can be read, every clock.

use std::collections::BTreeMap;
use std::path::Path;

use sidestep_kernel::InputError;

use super::content::{Tally, decode_scan, log_secs};
use super::messages::{LaserScan, Message, TfMessage};
use super::offsets;
use super::poses::{self, StampedPose};
use super::scans::RangeCounts;
use super::storage::{self, RawMessage};
use super::streams::Timing;
use super::topics;
use crate::report::{ImportReport, Treatment};

/// Stamps further back than this are from a clock that was set back.
const MAX_BACKWARD_STEP_SECS: f64 = 0.5;

/// Reads a bag message by message and reports what is in it. Nothing of it is kept, whatever its size.
///
/// # Errors
/// When the bag is missing, damaged altogether or of another kind, or more than half of the messages of known types are
/// bad.
pub fn inspect(path: &Path) -> Result<ImportReport, InputError> {
    let mut findings = TopicFindings::default();
    let storage = storage::read(path, &|_| true, &mut |message| {
        findings.add(&message);
        Ok(())
    })?;
    let mut report = storage.report;
    topics::add_facts(&storage.topics, &mut report);
    findings.report(&path.display().to_string(), &mut report)?;
    let messages: u64 = storage.topics.values().map(|topic| topic.messages).sum();
    if let (0, Some(damage)) = (messages, report.findings.first()) {
        let cause = format!("no message of the bag can be read: {damage}");
        return Err(InputError::new(path.display(), cause, "give another bag"));
    }
    report.add_kept("topics", storage.topics.len());
    report.add_kept("messages", usize::try_from(messages - findings.bad()).unwrap_or(usize::MAX));
    Ok(report)
}

/// Checks one message of a bag: `Err` says why it cannot be read. Messages of other types are not looked into.
pub(super) fn check(raw: &RawMessage<'_>) -> Result<Checked, String> {
    let bytes = raw.payload.clone()?;
    let Some(encoding) = raw.info.encoding() else { return Ok(Checked::Other) };
    if raw.info.schema == LaserScan::NAME {
        return Ok(Checked::Scan(Box::new(decode_scan(raw, encoding)?)));
    }
    if !poses::SCHEMAS.contains(&&*raw.info.schema) {
        return Ok(Checked::Other);
    }
    let poses = poses::decode_poses(&raw.info.schema, encoding, bytes)?;
    let poses: Vec<StampedPose> = poses.into_iter().collect::<Result<_, _>>()?;
    if raw.info.schema == TfMessage::NAME {
        let pairs =
            poses.iter().map(|pose| [&pose.parent, &pose.child].map(|name| name.to_string()));
        return Ok(Checked::Transforms(pairs.collect()));
    }
    Ok(poses.first().map_or(Checked::Other, |pose| Checked::Poses(pose.t_secs)))
}

/// A message that can be read.
pub(super) enum Checked {
    Scan(Box<LaserScan>),
    /// Poses, and the stamp of the first in s.
    Poses(f64),
    /// Transforms, by their frames.
    Transforms(Vec<[String; 2]>),
    Other,
}

/// What was found on each topic.
#[derive(Default)]
struct TopicFindings {
    tallies: BTreeMap<String, Tally>,
    ranges: BTreeMap<String, RangeCounts>,
    clocks: BTreeMap<String, ClockFindings>,
    recorded_secs: Option<[f64; 2]>,
    /// Numbers of transforms by topic, parent and child.
    frames: BTreeMap<(String, String, String), u64>,
}

/// Maximum number of pairs of frames that are listed.
const MAX_FRAMES: usize = 20;
/// Maximum number of topics whose stamps are listed.
const MAX_STAMPED: usize = 20;
/// Maximum number of stamps of a topic that are compared with the recording: of more every second, every fourth, and so on.
const MAX_TIMINGS: usize = 1 << 12;

/// The stamps of a topic.
struct ClockFindings {
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

impl TopicFindings {
    fn add(&mut self, raw: &RawMessage<'_>) {
        let secs = log_secs(raw);
        let [first, last] = self.recorded_secs.unwrap_or([secs; 2]);
        self.recorded_secs = Some([first.min(secs), last.max(secs)]);
        let checked = check(raw);
        if !self.tallies.contains_key(raw.topic) {
            self.tallies.insert(raw.topic.into(), Tally::default());
        }
        let tally = self.tallies.get_mut(raw.topic).expect("it was inserted");
        match checked {
            Err(cause) => tally.add_bad(raw.number, &cause),
            Ok(Checked::Other) => tally.good += 1,
            Ok(Checked::Poses(t_secs)) => {
                tally.good += 1;
                self.add_stamp(raw, t_secs);
            }
            Ok(Checked::Transforms(pairs)) => {
                tally.good += 1;
                // Transforms of several programs share a topic, and not their time.
                self.add_frames(raw.topic, pairs);
            }
            Ok(Checked::Scan(scan)) => {
                tally.good += 1;
                self.ranges.entry(raw.topic.into()).or_default().add(&scan);
                self.add_stamp(raw, scan.header.stamp.secs());
            }
        }
    }

    fn add_frames(&mut self, topic: &str, pairs: Vec<[String; 2]>) {
        for [parent, child] in pairs {
            let key = (topic.to_owned(), parent, child);
            if self.frames.len() <= MAX_FRAMES || self.frames.contains_key(&key) {
                *self.frames.entry(key).or_insert(0) += 1;
            }
        }
    }

    fn add_stamp(&mut self, raw: &RawMessage<'_>, t_secs: f64) {
        let secs = log_secs(raw);
        let Some(clock) = self.clocks.get_mut(raw.topic) else {
            let clock = ClockFindings {
                stamps: 1,
                first_secs: t_secs,
                last_secs: t_secs,
                latest_secs: t_secs,
                every: 1,
                timings: vec![Timing { t_secs, log_secs: secs }],
                backward_steps: Vec::new(),
                backward: 0,
            };
            self.clocks.insert(raw.topic.into(), clock);
            return;
        };
        clock.keep_timing(Timing { t_secs, log_secs: secs });
        clock.stamps += 1;
        let back_secs = clock.latest_secs - t_secs;
        if back_secs > MAX_BACKWARD_STEP_SECS {
            clock.backward += 1;
            if clock.backward_steps.len() < crate::report::MAX_PLACES {
                clock.backward_steps.push(format!("message {}: {back_secs:.3} s", raw.number));
            }
            clock.latest_secs = t_secs;
        }
        clock.latest_secs = clock.latest_secs.max(t_secs);
        clock.first_secs = clock.first_secs.min(t_secs);
        clock.last_secs = clock.last_secs.max(t_secs);
    }

    fn bad(&self) -> u64 {
        self.tallies.values().map(Tally::bad).sum()
    }

    fn report(&self, bag: &str, report: &mut ImportReport) -> Result<(), InputError> {
        if let Some([first, last]) = self.recorded_secs {
            report.add_fact(
                "recorded",
                format!("from {first:.3} to {last:.3} s since 1970, {:.3} s", last - first),
            );
        }
        let all = self.tallies.values().fold(Tally::default(), Tally::sum);
        all.check(bag, "all topics", 0)?;
        for (topic, tally) in &self.tallies {
            tally.report(topic, report);
        }
        for (k, (topic, clock)) in self.clocks.iter().enumerate() {
            if k < MAX_STAMPED {
                let value =
                    format!("{topic}: from {:.3} to {:.3} s", clock.first_secs, clock.last_secs);
                report.add_fact("stamps", value);
            }
            clock.report(topic, report);
        }
        if self.clocks.len() > MAX_STAMPED {
            report.add_fact("stamps", format!("{} more topics", self.clocks.len() - MAX_STAMPED));
        }
        for ((topic, parent, child), n) in self.frames.iter().take(MAX_FRAMES) {
            report.add_fact("frames", format!("{topic}: {parent} > {child}, {n} transforms"));
        }
        if self.frames.len() > MAX_FRAMES {
            report.add_fact("frames", "and others");
        }
        for (topic, counts) in &self.ranges {
            counts.convention(topic, None, report);
        }
        Ok(())
    }
}

impl ClockFindings {
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

    fn report(&self, topic: &str, report: &mut ImportReport) {
        let Self { first_secs, last_secs, .. } = self;
        let rule = format!("stamps of {topic} that go back");
        for k in 0..self.backward {
            let place = self.backward_steps.get(k as usize).cloned().unwrap_or_default();
            report.record(Treatment::Suspicious, rule.clone(), place, "");
        }
        let offset_secs = offsets::known_offset(&self.timings);
        if let Some(ahead_secs) = offset_secs.filter(|secs| *secs > offsets::MAX_AHEAD_SECS) {
            let rule = format!(
                "stamps of {topic} that lie {ahead_secs:.3} s after the recording of their messages"
            );
            report.record(
                Treatment::Suspicious,
                rule,
                "",
                "synchronize the clocks of the machines",
            );
        }
        if self.stamps > 1 && *first_secs == 0.0 && *last_secs == 0.0 {
            let rule =
                format!("the stamps of {topic} are all 0: the times of the recording are used");
            report.record(Treatment::Guessed, rule, "", "");
        }
    }
}
