//! The messages of the selected topics, in the order of the recording.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use sidestep_kernel::InputError;
use sidestep_kernel::view::Pose;

use super::cdr::{Encoding, decode_as};
use super::clock;
use super::frames::{self, Trajectory};
use super::messages::{LaserScan, Message, TfMessage};
use super::offsets;
use super::poses::{self, StampedPose, frame_name};
use super::scans::{self, RangeCounts};
use super::storage::{RawMessage, Topic};
use super::streams::{HasStamp, RecordedScan, Stream, Timing};
use super::topics::{PoseTopic, TopicSelection, is_static};
use crate::report::{ImportReport, Treatment};

/// Maximum number of ranges of all scans together: a robot that scans ten times a second sees the same again and again.
const MAX_RANGES: usize = 1 << 22;
/// Scans without any range are left out where they are at most this share of all.
const MAX_BLANK_FRACTION: f64 = 0.1;
/// Maximum number of names of frames.
const MAX_FRAMES: usize = 1 << 16;

/// Counts of messages on a topic, by whether they can be read.
#[derive(Debug, Default)]
pub(super) struct Tally {
    pub(super) good: u64,
    bad: u64,
    /// The first bad messages, with their causes.
    places: Vec<String>,
    /// The messages with an orientation of another length than 1: their number, and the first ones.
    scaled: u64,
    scaled_places: Vec<String>,
}

impl Tally {
    /// Adds what can be read of a message.
    pub(super) fn add_pose(&mut self, number: u64, pose: &StampedPose) {
        self.good += 1;
        if !pose.was_scaled {
            return;
        }
        self.scaled += 1;
        if self.scaled_places.len() < crate::report::MAX_PLACES {
            self.scaled_places.push(format!("message {number}"));
        }
    }

    pub(super) fn add_bad(&mut self, number: u64, cause: &str) {
        self.bad += 1;
        if self.places.len() < crate::report::MAX_PLACES {
            self.places.push(format!("message {number}: {cause}"));
        }
    }

    pub(super) fn bad(&self) -> u64 {
        self.bad
    }

    /// Returns the sum of two tallies, with the places of the first that has any.
    pub(super) fn sum(self, other: &Self) -> Self {
        let places = if self.places.is_empty() { other.places.clone() } else { self.places };
        Self { good: self.good + other.good, bad: self.bad + other.bad, places, ..self }
    }

    /// Checks that at most half of the messages on a topic are bad or lost.
    pub(super) fn check(&self, bag: &str, topic: &str, lost: u64) -> Result<(), InputError> {
        let bad = self.bad + lost;
        if bad <= self.good {
            return Ok(());
        }
        let first =
            self.places.first().map_or_else(String::new, |place| format!(", first {place}"));
        let cause = format!("{bad} of {} messages cannot be read{first}", bad + self.good);
        let remedy = "give another topic, or correct the program that publishes this one";
        Err(InputError::new(format!("{bag}: {topic}"), cause, remedy))
    }

    pub(super) fn report(&self, topic: &str, report: &mut ImportReport) {
        let rule = format!("messages on {topic} that cannot be read");
        for k in 0..self.bad {
            let place = self.places.get(k as usize).cloned().unwrap_or_default();
            report.record(Treatment::Dropped, rule.clone(), place, "");
        }
        let rule =
            format!("orientations on {topic} whose length is not 1, of which the direction counts");
        for k in 0..self.scaled {
            let place = self.scaled_places.get(k as usize).cloned().unwrap_or_default();
            report.record(Treatment::Repaired, rule.clone(), place, "");
        }
    }
}

/// Poses and scans of a bag.
pub(super) struct BagContent<'a> {
    bag: &'a str,
    selection: &'a TopicSelection,
    poses: BTreeMap<String, Vec<StampedPose>>,
    statics: Vec<StampedPose>,
    /// Transforms that were sent again and again, by their child; `None` once they have changed.
    fixed: BTreeMap<Arc<str>, Option<StampedPose>>,
    scans: Vec<RecordedScan>,
    thinning: Thinning,
    tallies: BTreeMap<String, Tally>,
    frames: BTreeSet<Arc<str>>,
}

/// Which scans are kept of a recording with too many.
struct Thinning {
    every: u64,
    seen: u64,
    ranges: usize,
}

impl<'a> BagContent<'a> {
    pub(super) fn new(bag: &'a str, selection: &'a TopicSelection) -> Self {
        Self {
            bag,
            selection,
            poses: BTreeMap::new(),
            statics: Vec::new(),
            fixed: BTreeMap::new(),
            scans: Vec::new(),
            thinning: Thinning { every: 1, seen: 0, ranges: 0 },
            tallies: BTreeMap::new(),
            frames: BTreeSet::new(),
        }
    }

    /// Adds a message; one that cannot be read is counted.
    ///
    /// # Errors
    /// When its topic is of another type or encoding.
    pub(super) fn add(&mut self, raw: &RawMessage<'_>) -> Result<(), InputError> {
        let is_selected = self.selection.contains(raw.topic);
        let Some(encoding) = raw.info.encoding() else {
            return if is_selected { Err(self.unknown_encoding(raw)) } else { Ok(()) };
        };
        if self.selection.scans.as_deref() == Some(raw.topic) {
            self.check_type(raw, &[LaserScan::NAME])?;
            self.add_scan(raw, encoding);
            return Ok(());
        }
        if is_selected {
            self.check_type(raw, &poses::SCHEMAS)?;
        } else if raw.info.schema != TfMessage::NAME {
            return Ok(());
        }
        self.add_poses(raw, encoding, is_selected);
        Ok(())
    }

    fn unknown_encoding(&self, raw: &RawMessage<'_>) -> InputError {
        let cause =
            format!("its messages are encoded as `{}`, not as cdr or ros1", raw.info.encoding);
        let remedy = "give a bag of ROS 2 or ROS 1";
        InputError::new(format!("{}: {}", self.bag, raw.topic), cause, remedy)
    }

    fn check_type(&self, raw: &RawMessage<'_>, known: &[&str]) -> Result<(), InputError> {
        if known.contains(&&*raw.info.schema) {
            return Ok(());
        }
        let cause = format!("its messages are of type `{}`", raw.info.schema);
        let remedy = format!("give a topic of type {}", known.join(", "));
        Err(InputError::new(format!("{}: {}", self.bag, raw.topic), cause, remedy))
    }

    fn tally(&mut self, topic: &str) -> &mut Tally {
        if !self.tallies.contains_key(topic) {
            self.tallies.insert(topic.into(), Tally::default());
        }
        self.tallies.get_mut(topic).expect("it was inserted")
    }

    fn add_scan(&mut self, raw: &RawMessage<'_>, encoding: Encoding) {
        let scan = decode_scan(raw, encoding);
        let tally = self.tally(raw.topic);
        let mut scan = match scan {
            Ok(scan) => scan,
            Err(cause) => return tally.add_bad(raw.number, &cause),
        };
        tally.good += 1;
        scan.header.frame_id = frame_name(&scan.header.frame_id).to_string();
        self.keep_scan(RecordedScan { message: raw.number, log_secs: log_secs(raw), scan });
    }

    /// Keeps a scan. Of a recording with too many ranges every second scan is kept, then every fourth, and so on.
    fn keep_scan(&mut self, scan: RecordedScan) {
        let thinning = &mut self.thinning;
        thinning.seen += 1;
        if !(thinning.seen - 1).is_multiple_of(thinning.every) {
            return;
        }
        thinning.ranges += scan.scan.ranges_m.len();
        self.scans.push(scan);
        if thinning.ranges > MAX_RANGES && self.scans.len() > 1 {
            thinning.every *= 2;
            let mut is_even = false;
            self.scans.retain(|_| {
                is_even = !is_even;
                is_even
            });
            thinning.ranges = self.scans.iter().map(|scan| scan.scan.ranges_m.len()).sum();
        }
    }

    fn add_poses(&mut self, raw: &RawMessage<'_>, encoding: Encoding, is_selected: bool) {
        let poses = raw
            .payload
            .clone()
            .and_then(|bytes| poses::decode_poses(&raw.info.schema, encoding, bytes));
        let poses = match poses {
            Ok(poses) => poses,
            Err(cause) => return self.tally(raw.topic).add_bad(raw.number, &cause),
        };
        for pose in poses {
            let pose = match pose {
                Ok(pose) => pose,
                Err(cause) => {
                    self.tally(raw.topic).add_bad(raw.number, cause);
                    continue;
                }
            };
            self.tally(raw.topic).add_pose(raw.number, &pose);
            self.keep_pose(raw, pose, is_selected);
        }
    }

    fn keep_pose(&mut self, raw: &RawMessage<'_>, pose: StampedPose, is_selected: bool) {
        let [parent, child] = [&pose.parent, &pose.child].map(|name| self.frame(name));
        let pose =
            StampedPose { message: raw.number, log_secs: log_secs(raw), parent, child, ..pose };
        if raw.info.schema == TfMessage::NAME {
            if is_static(raw.topic) {
                self.statics.push(pose.clone());
            } else {
                self.keep_if_fixed(&pose);
            }
        }
        if !is_selected {
            return;
        }
        match self.poses.get_mut(raw.topic) {
            Some(poses) => poses.push(pose),
            None => drop(self.poses.insert(raw.topic.into(), vec![pose])),
        }
    }

    /// Returns the name of a frame, shared with the poses that have it already.
    fn frame(&mut self, name: &Arc<str>) -> Arc<str> {
        if let Some(known) = self.frames.get(name) {
            return known.clone();
        }
        if self.frames.len() < MAX_FRAMES {
            self.frames.insert(name.clone());
        }
        name.clone()
    }

    fn keep_if_fixed(&mut self, pose: &StampedPose) {
        let Some(known) = self.fixed.get_mut(&pose.child) else {
            if self.fixed.len() < MAX_FRAMES {
                self.fixed.insert(pose.child.clone(), Some(pose.clone()));
            }
            return;
        };
        if known.as_ref().is_some_and(|known| known.pose != pose.pose) {
            *known = None;
        }
    }

    /// Checks that at most half of the messages on each selected topic are bad.
    pub(super) fn check(&self, topics: &BTreeMap<String, Topic>) -> Result<(), InputError> {
        for (name, tally) in &self.tallies {
            if self.selection.contains(name) {
                let lost = topics.get(name).map_or(0, |topic| topic.lost);
                tally.check(self.bag, name, lost)?;
            }
        }
        Ok(())
    }

    pub(super) fn report(&self, report: &mut ImportReport) {
        for (name, tally) in &self.tallies {
            tally.report(name, report);
        }
        if self.thinning.every > 1 {
            let rule = format!(
                "scans of a recording with more than {MAX_RANGES} ranges: every {}th is used",
                self.thinning.every
            );
            report.record(Treatment::NotUsed, rule, "", "");
        }
    }

    /// Puts all stamps on one axis of time.
    pub(super) fn align_clocks(&mut self, report: &mut ImportReport) -> Result<(), InputError> {
        self.drop_unusable_stamps(report);
        let mut streams: BTreeMap<String, Vec<&mut dyn HasStamp>> = BTreeMap::new();
        for (topic, poses) in &mut self.poses {
            for pose in poses {
                let name = match (&*pose.parent, &*pose.child) {
                    (_, "") => topic.clone(),
                    (parent, child) => format!("{topic} ({parent} > {child})"),
                };
                streams.entry(name).or_default().push(pose);
            }
        }
        if let Some(topic) = &self.selection.scans {
            for scan in &mut self.scans {
                streams.entry(topic.clone()).or_default().push(scan);
            }
        }
        let mut streams: Vec<Stream<'_>> =
            streams.into_iter().map(|(name, items)| Stream { name, items }).collect();
        clock::align(self.bag, &mut streams, report)
    }

    /// Leaves out messages with a stamp that is none.
    fn drop_unusable_stamps(&mut self, report: &mut ImportReport) {
        for (topic, poses) in &mut self.poses {
            let mut is_kept = vec![true; poses.len()];
            for indices in by_frames(poses) {
                let timings: Vec<Timing> = indices.iter().map(|k| Timing::of(&poses[*k])).collect();
                for (item, why) in offsets::unusable_stamps(&timings) {
                    let k = indices[item];
                    is_kept[k] = false;
                    let rule = format!("messages on {topic} {why}");
                    let place = format!("message {}", poses[k].message);
                    report.record(Treatment::Dropped, rule, place, "");
                }
            }
            let mut kept = is_kept.into_iter();
            poses.retain(|_| kept.next().unwrap_or(true));
        }
        let Some(topic) = &self.selection.scans else { return };
        let timings: Vec<Timing> = self.scans.iter().map(|scan| Timing::of(scan)).collect();
        let unusable = offsets::unusable_stamps(&timings);
        for (k, why) in &unusable {
            let rule = format!("messages on {topic} {why}");
            report.record(
                Treatment::Dropped,
                rule,
                format!("message {}", self.scans[*k].message),
                "",
            );
        }
        let mut k = 0;
        self.scans.retain(|_| {
            k += 1;
            unusable.binary_search_by_key(&(k - 1), |(item, _)| *item).is_err()
        });
    }

    pub(super) fn trajectory(&self, source: &PoseTopic) -> Result<Trajectory, InputError> {
        let poses = self.poses.get(&source.topic).map_or(&[][..], Vec::as_slice);
        frames::trajectory(self.bag, source, poses, &self.statics)
    }

    /// Moves the scans out, by time and as REP 117 has them.
    pub(super) fn take_scans(&mut self, report: &mut ImportReport) -> Vec<LaserScan> {
        let Some(topic) = &self.selection.scans else { return Vec::new() };
        let mut recorded = std::mem::take(&mut self.scans);
        let blank: Vec<u64> = recorded
            .iter()
            .filter(|scan| scans::is_blank(&scan.scan))
            .map(|scan| scan.message)
            .collect();
        if blank.len() as f64 <= MAX_BLANK_FRACTION * recorded.len() as f64 {
            recorded.retain(|scan| !scans::is_blank(&scan.scan));
            let rule = format!("scans on {topic} in which every range is NaN or 0");
            for message in blank {
                report.record(Treatment::Dropped, rule.clone(), format!("message {message}"), "");
            }
        }
        let mut counts = RangeCounts::default();
        recorded.iter().for_each(|scan| counts.add(&scan.scan));
        let convention = counts.convention(topic, self.selection.no_echo, report);
        recorded.sort_by(|a, b| a.t_secs().total_cmp(&b.t_secs()));
        let mut scans: Vec<LaserScan> = recorded.into_iter().map(|scan| scan.scan).collect();
        scans.iter_mut().for_each(|scan| convention.apply(scan));
        scans
    }

    /// Returns the pose on the robot of each frame of scans, as far as the bag places it.
    pub(super) fn mounts(&self, scans: &[LaserScan], bodies: &[&str]) -> BTreeMap<String, Pose> {
        let mut links = self.statics.clone();
        let known: BTreeSet<&str> = self.statics.iter().map(|link| &*link.child).collect();
        for link in self.fixed.values().flatten() {
            if !known.contains(&*link.child) {
                links.push(link.clone());
            }
        }
        let names: BTreeSet<&str> = scans.iter().map(|scan| &*scan.header.frame_id).collect();
        let mut mounts = BTreeMap::new();
        for name in names {
            if let Some(mount) = frames::mount(&links, name, bodies) {
                mounts.insert(name.to_owned(), mount);
            }
        }
        mounts
    }
}

/// Returns the indices of poses by their frames.
fn by_frames(poses: &[StampedPose]) -> Vec<Vec<usize>> {
    let mut groups: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
    for (k, pose) in poses.iter().enumerate() {
        groups.entry((&pose.parent, &pose.child)).or_default().push(k);
    }
    groups.into_values().collect()
}

/// Returns the scan in a message, without the strengths of its echoes.
pub(super) fn decode_scan(raw: &RawMessage<'_>, encoding: Encoding) -> Result<LaserScan, String> {
    let bytes = raw.payload.clone()?;
    let mut scan: LaserScan = decode_as(encoding, bytes).map_err(|e| e.to_string())?;
    scan.intensities = Vec::new();
    scans::check(&scan)?;
    Ok(scan)
}

/// Returns the time of the recording of a message in s.
pub(super) fn log_secs(raw: &RawMessage<'_>) -> f64 {
    raw.log_time_ns as f64 / 1e9
}
