//! Frames in bytes. Anything may come: what is no frame is skipped and counted.

use super::counts::MavlinkCounts;
use ::mavlink::consts::{self, v2};
use ::mavlink::dialects::common::MavMessage;
use ::mavlink::{MAV_STX, MAV_STX_V2, MAVLinkV2MessageRaw, Message};

/// The length of a frame of version 1 without its content.
const VERSION_1_BYTES: usize = consts::STX_SIZE + consts::v1::HEADER_SIZE + consts::CHECKSUM_SIZE;

/// The length of a frame of version 2 without content and signature.
const VERSION_2_BYTES: usize = consts::STX_SIZE + v2::MIN_HEADER_SIZE + consts::CHECKSUM_SIZE;

/// Bytes that wait for the rest of a frame.
#[derive(Debug, Default)]
pub(super) struct Splitter {
    bytes: Vec<u8>,
    /// The first byte that was not looked at yet.
    at: usize,
    /// Whether the bytes before that were no frame either: they count once.
    is_astray: bool,
}

/// What stands at the beginning of some bytes.
enum Piece {
    /// A frame of version 2 of so many bytes.
    Frame(usize),
    /// A frame of version 1 of so many bytes.
    Version1(usize),
    /// The beginning of one that is not complete.
    Incomplete,
    /// No frame.
    Nothing,
}

impl Splitter {
    /// Adds bytes of a stream.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.at);
        self.at = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// Drops what is left of a datagram or of a stream that broke, and counts it.
    pub(super) fn clear(&mut self, counts: &mut MavlinkCounts) {
        if self.at < self.bytes.len() {
            self.skip(counts);
        }
        self.bytes.clear();
        self.at = 0;
        self.is_astray = false;
    }

    /// Returns the next frame of version 2. Those that no dialect here knows are among them; the checksums of all others
    /// are right.
    pub(super) fn next(&mut self, counts: &mut MavlinkCounts) -> Option<MAVLinkV2MessageRaw> {
        while self.at < self.bytes.len() {
            match piece(&self.bytes[self.at..]) {
                Piece::Incomplete => return None,
                Piece::Nothing => {
                    self.skip(counts);
                    self.at += 1;
                }
                Piece::Version1(length) => {
                    counts.version_1 += 1;
                    self.go_on(length);
                }
                Piece::Frame(length) => {
                    let raw = raw_frame(&self.bytes[self.at..self.at + length]);
                    if is_intact(&raw) {
                        self.go_on(length);
                        return Some(raw);
                    }
                    self.skip(counts);
                    self.at += 1;
                }
            }
        }
        None
    }

    fn go_on(&mut self, length: usize) {
        self.at += length;
        self.is_astray = false;
    }

    fn skip(&mut self, counts: &mut MavlinkCounts) {
        if !self.is_astray {
            counts.unreadable += 1;
        }
        self.is_astray = true;
    }
}

fn piece(bytes: &[u8]) -> Piece {
    let content_bytes = bytes.get(consts::PAYLOAD_LEN_OFFSET).map(|&length| usize::from(length));
    match bytes[0] {
        MAV_STX_V2 => {
            let flags = bytes.get(v2::INCOMPAT_FLAGS_OFFSET).copied();
            let Some((content_bytes, flags)) = content_bytes.zip(flags) else {
                return Piece::Incomplete;
            };
            // Systems with numbers above 255 are of no use here, and other flags are not known.
            if flags & !v2::IFLAG_SIGNED != 0 {
                return Piece::Nothing;
            }
            let signature_bytes =
                if flags & v2::IFLAG_SIGNED == 0 { 0 } else { v2::SIGNATURE_SIZE };
            let length = VERSION_2_BYTES + content_bytes + signature_bytes;
            if bytes.len() < length { Piece::Incomplete } else { Piece::Frame(length) }
        }
        MAV_STX => {
            let Some(content_bytes) = content_bytes else { return Piece::Incomplete };
            let length = VERSION_1_BYTES + content_bytes;
            if bytes.len() < length { Piece::Incomplete } else { Piece::Version1(length) }
        }
        _ => Piece::Nothing,
    }
}

fn raw_frame(bytes: &[u8]) -> MAVLinkV2MessageRaw {
    let mut raw = MAVLinkV2MessageRaw::new();
    raw.as_mut_slice()[..bytes.len()].copy_from_slice(bytes);
    raw
}

/// The checksum of a message that is not known cannot be checked: it is not used, only its sequence is counted.
fn is_intact(raw: &MAVLinkV2MessageRaw) -> bool {
    MavMessage::extra_crc(raw.message_id()) == 0 || raw.has_valid_crc::<MavMessage>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::mavlink::MavHeader;
    use ::mavlink::dialects::common::{ATTITUDE_DATA, HEARTBEAT_DATA};
    use proptest::prelude::*;

    fn heartbeat(sequence: u8) -> Vec<u8> {
        let header = MavHeader { system_id: 1, component_id: 1, sequence };
        let mut raw = MAVLinkV2MessageRaw::new();
        let content =
            HEARTBEAT_DATA { custom_mode: 4, mavlink_version: 3, ..HEARTBEAT_DATA::DEFAULT };
        raw.serialize_message_data(header, &content);
        raw.raw_bytes().to_vec()
    }

    fn attitude() -> Vec<u8> {
        let mut raw = MAVLinkV2MessageRaw::new();
        let content = ATTITUDE_DATA { yaw: 1.5, time_boot_ms: 7, ..ATTITUDE_DATA::DEFAULT };
        raw.serialize_message_data(MavHeader::default(), &content);
        raw.raw_bytes().to_vec()
    }

    fn sequences(splitter: &mut Splitter, counts: &mut MavlinkCounts) -> Vec<u8> {
        std::iter::from_fn(|| splitter.next(counts)).map(|raw| raw.sequence()).collect()
    }

    #[test]
    fn frames_are_found_wherever_a_stream_is_cut() {
        let stream =
            [heartbeat(1), vec![MAV_STX, 1, 0, 9, 9, 0, 5, 1, 2], heartbeat(2), attitude()];
        let stream = stream.concat();
        for cut in 0..stream.len() {
            let mut splitter = Splitter::default();
            let mut counts = MavlinkCounts::default();
            splitter.push(&stream[..cut]);
            let mut found = sequences(&mut splitter, &mut counts);
            splitter.push(&stream[cut..]);
            found.extend(sequences(&mut splitter, &mut counts));
            assert_eq!(found, [1, 2, 0], "cut at {cut}");
            assert_eq!(counts, MavlinkCounts { version_1: 1, ..MavlinkCounts::default() });
        }
    }

    #[test]
    fn a_frame_whose_checksum_is_wrong_is_skipped_and_counted_once() {
        let mut broken = heartbeat(1);
        broken[11] ^= 1;
        let mut splitter = Splitter::default();
        let mut counts = MavlinkCounts::default();
        splitter.push(&[vec![1, 2, 3], broken, heartbeat(2)].concat());
        assert_eq!(sequences(&mut splitter, &mut counts), [2]);
        assert_eq!(counts.unreadable, 1);
        splitter.push(&[MAV_STX_V2, 4]);
        assert!(splitter.next(&mut counts).is_none());
        splitter.clear(&mut counts);
        assert_eq!(counts.unreadable, 2);
    }

    proptest! {
        #[test]
        fn any_bytes_are_taken_and_the_next_datagram_is_read(
            bytes in proptest::collection::vec(prop_oneof![any::<u8>(), Just(MAV_STX_V2)], 0..600),
        ) {
            let mut splitter = Splitter::default();
            let mut counts = MavlinkCounts::default();
            splitter.push(&bytes);
            while splitter.next(&mut counts).is_some() {}
            splitter.clear(&mut counts);
            splitter.push(&heartbeat(3));
            prop_assert_eq!(sequences(&mut splitter, &mut counts), [3]);
        }
    }
}
