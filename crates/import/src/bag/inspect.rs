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
use super::topic_clock::TopicClock;
use super::topic_motion::TopicMotion;
use super::topics::{self, is_static};
use crate::report::ImportReport;

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
        return Ok(Checked::Transforms(poses));
    }
    Ok(poses.into_iter().next().map_or(Checked::Other, |pose| Checked::Pose(Box::new(pose))))
}

/// A message that can be read.
pub(super) enum Checked {
    Scan(Box<LaserScan>),
    Pose(Box<StampedPose>),
    Transforms(Vec<StampedPose>),
    Other,
}

/// What was found on each topic.
#[derive(Default)]
struct TopicFindings {
    tallies: BTreeMap<String, Tally>,
    ranges: BTreeMap<String, RangeCounts>,
    clocks: BTreeMap<String, TopicClock>,
    recorded_secs: Option<[f64; 2]>,
    /// Numbers of transforms by topic, parent and child.
    frames: BTreeMap<(String, String, String), u64>,
    /// By the name of the topic, with the frames of transforms.
    motions: BTreeMap<String, TopicMotion>,
}

/// Maximum number of pairs of frames that are listed.
const MAX_FRAMES: usize = 20;
/// Maximum number of topics whose stamps are listed.
const MAX_STAMPED: usize = 20;
/// Maximum number of bodies whose motion is looked at.
const MAX_MOTIONS: usize = 64;

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
            Ok(Checked::Pose(pose)) => {
                tally.add_pose(raw.number, &pose);
                self.add_stamp(raw, pose.t_secs);
                let name = match &*pose.child {
                    "" => raw.topic.to_owned(),
                    child => format!("{} ({} > {child})", raw.topic, pose.parent),
                };
                self.add_motion(&name, &pose);
            }
            Ok(Checked::Transforms(transforms)) => {
                tally.good += 1;
                // Transforms of several programs share a topic, and not their time.
                self.add_frames(raw.topic, &transforms);
            }
            Ok(Checked::Scan(scan)) => {
                tally.good += 1;
                self.ranges.entry(raw.topic.into()).or_default().add(&scan);
                self.add_stamp(raw, scan.header.stamp.secs());
            }
        }
    }

    fn add_frames(&mut self, topic: &str, transforms: &[StampedPose]) {
        for transform in transforms {
            let [parent, child] = [&transform.parent, &transform.child].map(ToString::to_string);
            let name = format!("{topic} ({parent} > {child})");
            let key = (topic.to_owned(), parent, child);
            if self.frames.len() <= MAX_FRAMES || self.frames.contains_key(&key) {
                *self.frames.entry(key).or_insert(0) += 1;
            }
            if !is_static(topic) {
                self.add_motion(&name, transform);
            }
        }
    }

    fn add_motion(&mut self, name: &str, pose: &StampedPose) {
        if let Some(motion) = self.motions.get_mut(name) {
            motion.add(pose.to_planar());
        } else if self.motions.len() < MAX_MOTIONS {
            let mut motion = TopicMotion::default();
            motion.add(pose.to_planar());
            self.motions.insert(name.to_owned(), motion);
        }
    }

    fn add_stamp(&mut self, raw: &RawMessage<'_>, t_secs: f64) {
        let timing = Timing { t_secs, log_secs: log_secs(raw) };
        if let Some(clock) = self.clocks.get_mut(raw.topic) {
            clock.add(raw.number, timing);
        } else {
            self.clocks.insert(raw.topic.into(), TopicClock::from_first(timing));
        }
    }

    fn bad(&self) -> u64 {
        self.tallies.values().map(Tally::bad).sum()
    }

    fn report(&mut self, bag: &str, report: &mut ImportReport) -> Result<(), InputError> {
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
        self.report_clocks(report);
        for ((topic, parent, child), n) in self.frames.iter().take(MAX_FRAMES) {
            report.add_fact("frames", format!("{topic}: {parent} > {child}, {n} transforms"));
        }
        if self.frames.len() > MAX_FRAMES {
            report.add_fact("frames", "and others");
        }
        for (name, motion) in &mut self.motions {
            motion.report(name, report);
        }
        for (topic, counts) in &self.ranges {
            counts.convention(topic, None, report);
        }
        Ok(())
    }

    fn report_clocks(&self, report: &mut ImportReport) {
        for (topic, clock) in self.clocks.iter().take(MAX_STAMPED) {
            report.add_fact("stamps", format!("{topic}: {}", clock.describe()));
        }
        if self.clocks.len() > MAX_STAMPED {
            report.add_fact("stamps", format!("{} more topics", self.clocks.len() - MAX_STAMPED));
        }
        for (topic, clock) in &self.clocks {
            clock.report(topic, report);
        }
        let sources: Vec<(&str, &[Timing])> =
            self.clocks.iter().map(|(topic, clock)| (&**topic, clock.timings())).collect();
        offsets::record_rates(&sources, report);
        offsets::record_differences(&sources, report);
    }
}
