//! Bodies and events of a recording, read back in order to show it without computing it again.

use std::ops::ControlFlow;
use std::path::Path;

use ::mcap::Summary;
use ::mcap::sans_io::indexed_reader::{
    IndexedReadEvent, IndexedReader, IndexedReaderOptions, ReadOrder,
};
use foxglove::Decode;
use foxglove::messages::{Log, SceneEntity, SceneUpdate, log};
use sidestep_kernel::view::{
    Body, BodyId, BodyRole, Kinds, LogEvent, LogEventKind, Pose, Severity, Shape,
};
use sidestep_kernel::{Cycle, InputError};

use super::messages;
use super::reader::{McapFile, damaged, describe_run};

/// Events beyond this number are left out, because all are kept in memory.
const MAX_EVENTS: usize = 200_000;

/// The size in bytes up to which any chunk is unpacked: many times that of our own chunks.
const MIN_RECORD_LIMIT_BYTES: u64 = 1 << 26;

/// The messages of a recording, by cycle.
pub struct McapSceneReader {
    source: McapFile,
    summary: Summary,
    cycle_s: f64,
    /// Time of the run's start in nanoseconds, 0 where times are those since then.
    start_ns: u64,
    kinds: Kinds,
}

impl McapSceneReader {
    /// Opens a recording that any version of this program made, with bodies of these kinds.
    ///
    /// # Errors
    /// A missing file; one of another program; one that is cut off or damaged.
    pub fn open(path: &Path, kinds: Kinds) -> Result<Self, InputError> {
        let mut source = McapFile::open(path)?;
        let summary = source.summary()?;
        let description = describe_run(&mut source, &summary)?;
        let cycle_s = description.get("cycle_s").and_then(|text| text.parse().ok());
        let cycle_s = cycle_s.filter(|s: &f64| s.is_finite() && *s > 0.0);
        let cycle_s =
            cycle_s.ok_or_else(|| damaged(path, "it does not say how long a cycle takes"))?;
        let start_ns = description.get("start_utc_ns").and_then(|text| text.parse().ok());
        Ok(Self { source, summary, cycle_s, start_ns: start_ns.unwrap_or(0), kinds })
    }

    /// Returns the bodies of the last recorded frame up to a cycle; none before the first.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn bodies(&mut self, cycle: Cycle) -> Result<Vec<Body>, InputError> {
        let flown_ns = messages::to_ns(cycle as f64 * self.cycle_s);
        let until_ns = self.start_ns.saturating_add(flown_ns);
        let last = IndexedReaderOptions::new().with_order(ReadOrder::ReverseLogTime);
        let mut update = None;
        self.for_each::<SceneUpdate>("/scene", last.ending_at(until_ns), |scene| {
            update = Some(scene);
            ControlFlow::Break(())
        })?;
        let entities = update.into_iter().flat_map(|update| update.entities);
        Ok(entities.flat_map(|entity| bodies(&entity, &self.kinds)).collect())
    }

    /// Returns the events, by cycle; beyond some hundred thousand they are left out.
    ///
    /// # Errors
    /// When the file is damaged.
    pub fn events(&mut self) -> Result<Vec<LogEvent>, InputError> {
        let mut events = Vec::new();
        let Self { cycle_s, start_ns, .. } = *self;
        let kinds = self.kinds.clone();
        self.for_each::<Log>("/log", IndexedReaderOptions::new(), |entry| {
            events.extend(parse_event(&entry, (cycle_s, start_ns), &kinds));
            if events.len() < MAX_EVENTS {
                ControlFlow::Continue(())
            } else {
                ControlFlow::Break(())
            }
        })?;
        Ok(events)
    }

    /// Passes on the messages of a topic, until `take` breaks.
    fn for_each<T: Decode>(
        &mut self,
        topic: &str,
        options: IndexedReaderOptions,
        mut take: impl FnMut(T) -> ControlFlow<()>,
    ) -> Result<(), InputError> {
        if !self.summary.channels.values().any(|channel| channel.topic == topic) {
            // A filter on a topic that the file does not have would pass all topics.
            return Ok(());
        }
        // Unpacked data may be larger, but a damaged length must not ask for all memory.
        // A chunk is smaller than the file, and no compression is known to reach a thousandth.
        let most = self.source.length.saturating_mul(1 << 10).max(MIN_RECORD_LIMIT_BYTES);
        let limit = usize::try_from(most).unwrap_or(usize::MAX);
        let options = options.include_topics([topic]).with_record_length_limit(limit);
        let path = self.source.path.clone();
        let mut reader = IndexedReader::new_with_options(&self.summary, options)
            .map_err(|e| damaged(&path, e))?;
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| damaged(&path, e))? {
                IndexedReadEvent::ReadChunkRequest { offset, length } => {
                    let bytes = self.source.record(offset, length as u64)?;
                    reader
                        .insert_chunk_record_data(offset, &bytes)
                        .map_err(|e| damaged(&path, e))?;
                }
                IndexedReadEvent::Message { data, .. } => {
                    let message = T::decode(data).map_err(|e| damaged(&path, e))?;
                    if take(message).is_break() {
                        break;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Returns the bodies that an entity shows; those of a body of parts are the parts, in their order.
fn bodies(entity: &SceneEntity, kinds: &Kinds) -> Vec<Body> {
    let Some(BodyId { kind, number, .. }) = kinds.parse_body_id(&entity.id) else {
        return Vec::new();
    };
    let mut bodies = Vec::new();
    for (k, (pose, shape)) in (0u32..).zip(shapes(entity)) {
        let part = (kind.role() == BodyRole::PartOfBody).then_some(k);
        bodies.push(Body { part, ..Body::new(kind, number, pose, shape) });
    }
    bodies
}

/// Returns the poses and shapes of an entity's primitives. Arrows are bodies only where there is nothing else; else
/// they show where something heads.
fn shapes(entity: &SceneEntity) -> Vec<(Pose, Shape)> {
    let at = messages::read_pose;
    let cubes = entity.cubes.iter().map(|cube| {
        (
            at(cube.pose.as_ref()),
            Shape::Cuboid { size_m: messages::read_vector(cube.size.as_ref()) },
        )
    });
    let cylinders = entity.cylinders.iter().map(|cylinder| {
        let [width_m, _, height_m] = messages::read_vector(cylinder.size.as_ref());
        (at(cylinder.pose.as_ref()), Shape::Cylinder { radius_m: 0.5 * width_m, height_m })
    });
    let spheres = entity.spheres.iter().map(|ball| {
        let [width_m, ..] = messages::read_vector(ball.size.as_ref());
        (at(ball.pose.as_ref()), Shape::Sphere { radius_m: 0.5 * width_m })
    });
    let lines = entity.lines.iter().map(|line| {
        let points_m = line.points.iter().map(|point| [point.x, point.y, point.z]).collect();
        let thickness_m = if line.scale_invariant { 0.0 } else { line.thickness };
        (at(line.pose.as_ref()), Shape::Line { points_m, thickness_m })
    });
    let solids: Vec<_> = cubes.chain(cylinders).chain(spheres).chain(lines).collect();
    if !solids.is_empty() {
        return solids;
    }
    let darts = entity.arrows.iter().map(|arrow| {
        let tail = at(arrow.pose.as_ref());
        let length_m = arrow.shaft_length + arrow.head_length;
        let pose = Pose { at_m: tail.transform_point([0.5 * length_m, 0.0, 0.0]), ..tail };
        (pose, Shape::Dart { length_m, width_m: arrow.head_diameter })
    });
    darts.collect()
}

/// Returns the event of a body that a message reports. Its words are all that is known of it.
fn parse_event(entry: &Log, (cycle_s, start_ns): (f64, u64), kinds: &Kinds) -> Option<LogEvent> {
    let words = entry.message.strip_prefix(&entry.name).unwrap_or(&entry.message).trim();
    let level = match log::Level::try_from(entry.level) {
        Ok(log::Level::Warning) => Severity::Warning,
        Ok(log::Level::Error | log::Level::Fatal) => Severity::Error,
        _ => Severity::Info,
    };
    let time_s = messages::log_time_ns(entry).saturating_sub(start_ns) as f64 / 1e9;
    Some(LogEvent {
        cycle: (time_s / cycle_s).round() as Cycle,
        level,
        kind: LogEventKind::Changed,
        who: kinds.parse_body_id(&entry.name)?,
        with: None,
        at_m: None,
        value: None,
        words: words.to_string(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_airspace::kinds::AIRPLANE;
    use sidestep_chain::kinds::{CONNECTOR, RODS};
    use sidestep_kernel::view::{BodyKind, Frame};
    use sidestep_robots::kinds::{PERSON, ROBOT};
    use std::collections::BTreeSet;

    #[test]
    fn bodies_of_every_shape_are_read_back_as_they_were_written() {
        let all = Kinds::new([
            ROBOT,
            PERSON,
            BodyKind::OBSTACLE,
            RODS,
            CONNECTOR,
            AIRPLANE,
            BodyKind::GOAL,
        ]);
        let turned = Pose::from_heading([1.0, 2.0, 0.5], 0.25);
        let shapes = [
            Shape::Cuboid { size_m: [1.0, 2.0, 3.0] },
            Shape::Cylinder { radius_m: 0.5, height_m: 2.0 },
            Shape::Sphere { radius_m: 0.25 },
            Shape::Line { points_m: vec![[0.0; 3], [1.0, 2.0, 3.0]], thickness_m: 0.0 },
            Shape::Line { points_m: vec![[0.0; 3], [1.0; 3]], thickness_m: 0.5 },
        ];
        let kinds = [ROBOT, PERSON, BodyKind::OBSTACLE, RODS, BodyKind::GOAL];
        let mut written: Vec<Body> = shapes
            .into_iter()
            .zip(kinds)
            .map(|(shape, kind)| Body::new(kind, 4, turned, shape))
            .collect();
        let ball = || Shape::Sphere { radius_m: 0.1 };
        written.extend((0..3).map(|k| {
            Body::new(CONNECTOR, 1, Pose::from_position([f64::from(k), 0.0, 0.0]), ball())
                .with_part(k)
        }));
        let frame = Frame { bodies: written.clone(), ..Frame::default() };
        let update = messages::scene(&frame, 0, 3, &mut BTreeSet::new());
        let read: Vec<Body> =
            update.entities.iter().flat_map(|entity| bodies(entity, &all)).collect();
        assert_eq!(read, written);

        let dart = Shape::Dart { length_m: 2.0, width_m: 1.0 };
        let frame =
            Frame { bodies: vec![Body::new(AIRPLANE, 7, turned, dart)], ..Frame::default() };
        let update = messages::scene(&frame, 0, 2, &mut BTreeSet::new());
        let [read] = &bodies(&update.entities[0], &all)[..] else { panic!("one airplane") };
        let Shape::Dart { length_m, width_m } = read.shape else { panic!("{read:?}") };
        assert!((length_m - 2.0).abs() < 1e-12 && width_m == 1.0);
        let off = read.pose.at_m.iter().zip(turned.at_m).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-12 && read.pose.turn == turned.turn, "{read:?}");
    }
}
