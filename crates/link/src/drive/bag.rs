//! The bag of a drive: what the program has heard of its robot, the pose that it went by, and what it has commanded, as
//! `ros2 bag record` leaves it.

use sidestep::import::bag::cdr::decode;
use sidestep::import::bag::messages::{Message, TfMessage, Time};
use sidestep::kernel::ports::RecordError;
use sidestep_record::{BagSchema, BagWriter};
use sidestep_session::VERSION;
use sidestep_session::ros::RosMessage;
use std::fmt;
use std::fs;
use std::io;
use std::path::Path;

/// The files of a bag in its folder.
const BAG_FILES: [&str; 2] = ["bag_0.mcap", "metadata.yaml"];

/// A bag that is written while a robot drives.
pub struct DriveBag {
    writer: BagWriter,
    /// The time of the last message that has one, nanoseconds of the robot's clock: that of those that have none.
    time_ns: u64,
    /// The first error: then nothing more is written, and the drive goes on.
    error: Option<RecordError>,
}

impl fmt::Debug for DriveBag {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("DriveBag").field("time_ns", &self.time_ns).finish_non_exhaustive()
    }
}

impl DriveBag {
    /// Starts a bag in a folder, which is made. With `replaces` an earlier bag there is replaced, and nothing else.
    ///
    /// # Errors
    /// When the folder is there already, has other files, or cannot be written.
    pub fn create(folder: &Path, replaces: bool) -> io::Result<Self> {
        if replaces && folder.is_dir() {
            remove_bag(folder)?;
        } else {
            fs::create_dir(folder)?;
        }
        let writer = BagWriter::create(folder, VERSION).map_err(io::Error::other)?;
        Ok(Self { writer, time_ns: 0, error: None })
    }

    /// Records a message of another one as it came.
    pub fn record<M: Message>(&mut self, topic: &str, bytes: &[u8]) {
        if let Some(time_ns) = stamp_ns::<M>(bytes) {
            // Messages without a time are of the newest time that is known.
            self.time_ns = self.time_ns.max(time_ns);
        }
        let time_ns = stamp_ns::<M>(bytes).unwrap_or(self.time_ns);
        self.write(topic, BagSchema { name: M::NAME, definition: M::DEFINITION }, time_ns, bytes);
    }

    /// Records a message of this program.
    pub fn record_message(&mut self, message: &RosMessage) {
        let schema = BagSchema { name: message.type_name, definition: message.definition };
        self.write(&message.topic, schema, message.time_ns, &message.bytes);
    }

    fn write(&mut self, topic: &str, schema: BagSchema, time_ns: u64, bytes: &[u8]) {
        if self.error.is_none() {
            self.error = self.writer.write(topic, schema, time_ns, bytes).err();
        }
    }

    /// Completes the bag.
    ///
    /// # Errors
    /// When it cannot be written, or could not at some time before.
    pub fn finish(self) -> Result<(), RecordError> {
        let finished = self.writer.finish();
        self.error.map_or(finished, Err)
    }
}

/// Removes the files of a bag from their folder, if there are no others.
fn remove_bag(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let name = entry?.file_name();
        if !BAG_FILES.iter().any(|file| name == *file) {
            let words = format!("it has `{}`, which is no file of a bag", name.display());
            return Err(io::Error::new(io::ErrorKind::AlreadyExists, words));
        }
    }
    for file in BAG_FILES {
        match fs::remove_file(folder.join(file)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(error),
            _ => {}
        }
    }
    Ok(())
}

/// Returns the time of a message, nanoseconds; none of messages without one.
fn stamp_ns<M: Message>(bytes: &[u8]) -> Option<u64> {
    let stamp = if M::NAME == TfMessage::NAME {
        let message: TfMessage = decode(bytes).ok()?;
        message.transforms.first()?.header.stamp.clone()
    } else if M::DEFINITION.starts_with("std_msgs/Header header") {
        // The header is first, and its time is first in it.
        decode::<Time>(bytes).ok()?
    } else {
        return None;
    };
    Some((stamp.secs().max(0.0) * 1e9).round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::import::bag::cdr::encode;
    use sidestep::import::bag::messages::{Bool, Header, Pose, PoseStamped};

    #[test]
    fn times_are_those_of_headers_and_else_the_last_one() {
        let header = Header { stamp: Time::from_secs(2.5), frame_id: "map".into() };
        let pose = Pose { position: [0.0; 3], orientation: [0.0, 0.0, 0.0, 1.0] };
        let bytes = encode(&PoseStamped { header, pose });
        assert_eq!(stamp_ns::<PoseStamped>(&bytes), Some(2_500_000_000));
        assert_eq!(stamp_ns::<Bool>(&encode(&Bool { data: true })), None);
    }

    #[test]
    fn a_bag_replaces_a_bag_and_nothing_else() {
        let outer = tempfile::tempdir().expect("a folder");
        let folder = outer.path().join("bag");
        let press = encode(&Bool { data: true });
        let mut bag = DriveBag::create(&folder, false).expect("a new folder");
        bag.record::<Bool>("/bumper", &press);
        bag.finish().expect("written");
        assert!(DriveBag::create(&folder, false).is_err(), "it is there");
        let again = DriveBag::create(&folder, true).expect("an earlier bag");
        again.finish().expect("written");
        fs::write(folder.join("notes.txt"), "mine").expect("written");
        assert!(DriveBag::create(&folder, true).is_err(), "it has something else");
        assert!(folder.join("notes.txt").exists() && folder.join("metadata.yaml").exists());
    }
}
