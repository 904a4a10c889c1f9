//! The two messages whose commands may be of any dialect: those of ArduPilot are not in the common one.

use ::mavlink::bytes::Bytes;
use ::mavlink::bytes_mut::BytesMut;
use ::mavlink::dialects::common::{COMMAND_ACK_DATA, COMMAND_INT_DATA, MavMessage};
use ::mavlink::error::ParserError;
use ::mavlink::utils::remove_trailing_zeroes;
use ::mavlink::{MavlinkVersion, MessageData};

/// `COMMAND_INT`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CommandInt {
    /// The number of the command.
    pub command: u16,
    /// The first four parameters.
    pub params: [f32; 4],
    /// Latitude and longitude in 1e-7 degrees.
    pub place: [i32; 2],
    /// Altitude in meters, or the seventh parameter.
    pub z: f32,
    /// The number of the frame in which the altitude is given.
    pub frame: u8,
    /// System and component that are to obey.
    pub target: [u8; 2],
}

impl MessageData for CommandInt {
    type Message = MavMessage;
    const ID: u32 = COMMAND_INT_DATA::ID;
    const NAME: &'static str = COMMAND_INT_DATA::NAME;
    const EXTRA_CRC: u8 = COMMAND_INT_DATA::EXTRA_CRC;
    const ENCODED_LEN: usize = COMMAND_INT_DATA::ENCODED_LEN;

    fn ser(&self, _: MavlinkVersion, payload: &mut [u8]) -> usize {
        let mut out = BytesMut::new(payload);
        for param in self.params {
            out.put_f32_le(param);
        }
        for coordinate in self.place {
            out.put_i32_le(coordinate);
        }
        out.put_f32_le(self.z);
        out.put_u16_le(self.command);
        out.put_slice(&self.target);
        out.put_u8(self.frame);
        // No mission item is meant: neither current nor followed by another one.
        out.put_slice(&[0, 0]);
        remove_trailing_zeroes(&payload[..Self::ENCODED_LEN])
    }

    fn deser(_: MavlinkVersion, payload: &[u8]) -> Result<Self, ParserError> {
        let padded = padded::<{ COMMAND_INT_DATA::ENCODED_LEN }>(payload);
        let mut bytes = Bytes::new(&padded);
        let mut params = [0.0; 4];
        for param in &mut params {
            *param = bytes.get_f32_le()?;
        }
        let place = [bytes.get_i32_le()?, bytes.get_i32_le()?];
        let z = bytes.get_f32_le()?;
        let command = bytes.get_u16_le()?;
        let target = bytes.get_array()?;
        Ok(Self { command, params, place, z, frame: bytes.get_u8()?, target })
    }
}

/// `COMMAND_ACK`, with the extension that says to whom it goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CommandAck {
    /// The number of the command.
    pub command: u16,
    /// The number of the `MAV_RESULT`.
    pub result: u8,
    /// System and component that have commanded; zeros for any.
    pub target: [u8; 2],
}

/// The length of a `COMMAND_ACK` with its extensions.
const ACK_BYTES: usize = 10;

impl MessageData for CommandAck {
    type Message = MavMessage;
    const ID: u32 = COMMAND_ACK_DATA::ID;
    const NAME: &'static str = COMMAND_ACK_DATA::NAME;
    const EXTRA_CRC: u8 = COMMAND_ACK_DATA::EXTRA_CRC;
    const ENCODED_LEN: usize = ACK_BYTES;

    fn ser(&self, _: MavlinkVersion, payload: &mut [u8]) -> usize {
        let mut out = BytesMut::new(payload);
        out.put_u16_le(self.command);
        out.put_u8(self.result);
        // Progress and a second result, which nobody here needs.
        out.put_slice(&[0; 5]);
        out.put_slice(&self.target);
        remove_trailing_zeroes(&payload[..Self::ENCODED_LEN])
    }

    fn deser(_: MavlinkVersion, payload: &[u8]) -> Result<Self, ParserError> {
        let padded = padded::<ACK_BYTES>(payload);
        let mut bytes = Bytes::new(&padded);
        let command = bytes.get_u16_le()?;
        let result = bytes.get_u8()?;
        bytes.get_bytes(5)?;
        Ok(Self { command, result, target: bytes.get_array()? })
    }
}

/// Zeros at the end of a message are not sent, and newer versions of one may be longer.
fn padded<const N: usize>(payload: &[u8]) -> [u8; N] {
    let mut padded = [0; N];
    let length = payload.len().min(N);
    padded[..length].copy_from_slice(&payload[..length]);
    padded
}

/// Returns the name of a `MAV_RESULT`.
pub(super) fn result_name(result: u8) -> String {
    let name = match result {
        0 => "ACCEPTED",
        1 => "TEMPORARILY_REJECTED",
        2 => "DENIED",
        3 => "UNSUPPORTED",
        4 => "FAILED",
        5 => "IN_PROGRESS",
        6 => "CANCELLED",
        7 => "COMMAND_LONG_ONLY",
        8 => "COMMAND_INT_ONLY",
        9 => "UNSUPPORTED_MAV_FRAME",
        10 => "NOT_IN_CONTROL",
        _ => return format!("MAV_RESULT {result}"),
    };
    format!("MAV_RESULT_{name}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::mavlink::{MAVLinkV2MessageRaw, MavHeader, Message};

    #[test]
    fn a_command_of_the_common_dialect_is_the_same_message() {
        let ours = CommandInt {
            command: 192,
            params: [-1.0, 1.0, 0.0, 0.5],
            place: [474_000_000, 85_000_000],
            z: 120.0,
            frame: 6,
            target: [3, 1],
        };
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message_data(MavHeader::default(), &ours);
        assert!(raw.has_valid_crc::<MavMessage>());
        let theirs = MavMessage::parse(MavlinkVersion::V2, raw.message_id(), raw.payload());
        let Ok(MavMessage::COMMAND_INT(theirs)) = theirs else { panic!("{theirs:?}") };
        assert_eq!((theirs.command as u16, theirs.x, theirs.y), (192, 474_000_000, 85_000_000));
        assert_eq!((theirs.param4, theirs.z, theirs.frame as u8), (0.5, 120.0, 6));
        assert_eq!(CommandInt::deser(MavlinkVersion::V2, raw.payload()).expect("whole"), ours);
    }

    #[test]
    fn an_acknowledgment_comes_back_with_and_without_its_extensions() {
        for target in [[0, 0], [245, 191]] {
            let ack = CommandAck { command: 43002, result: 2, target };
            let mut payload = [0; 255];
            let length = ack.ser(MavlinkVersion::V2, &mut payload);
            assert_eq!(length, if target == [0, 0] { 3 } else { 10 });
            assert_eq!(
                CommandAck::deser(MavlinkVersion::V2, &payload[..length]).expect("whole"),
                ack
            );
        }
    }
}
