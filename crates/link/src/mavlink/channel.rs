//! Verified frames in, messages out.

use super::counts::MavlinkCounts;
use super::endpoint::MavlinkEndpoint;
use super::signature::KEY_BYTES;
use super::socket::{Arrival, Socket};
use super::splitter::Splitter;
use ::mavlink::consts::v2::IFLAG_SIGNED;
use ::mavlink::{MAVLinkV2MessageRaw, MavHeader, MessageData, SigningConfig, SigningData};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

/// More than the largest datagram that can come.
const BUFFER_BYTES: usize = 1 << 16;

/// Time after the end of a wait in which frames that are dropped are read on.
const MAX_DROP_TIME: Duration = Duration::from_millis(20);

/// The number of this link in signatures: one for each connection of a system.
const LINK_ID: u8 = 1;

/// A connection to an autopilot.
pub(super) struct Channel {
    socket: Socket,
    splitter: Splitter,
    buffer: Box<[u8]>,
    signing: Option<SigningData>,
    header: MavHeader,
    pub counts: MavlinkCounts,
    /// Whether what the splitter has left is the rest of a datagram.
    has_datagram: bool,
}

impl Channel {
    /// Opens a connection. With a key all frames are signed, and only signed ones are taken.
    ///
    /// # Errors
    /// When it cannot be opened.
    pub(super) fn open(
        endpoint: &MavlinkEndpoint,
        key: Option<[u8; KEY_BYTES]>,
        [system_id, component_id]: [u8; 2],
    ) -> Result<Self, String> {
        let signing =
            key.map(|key| SigningData::from_config(SigningConfig::new(key, LINK_ID, true, false)));
        Ok(Self {
            socket: Socket::open(endpoint)?,
            splitter: Splitter::default(),
            buffer: vec![0; BUFFER_BYTES].into_boxed_slice(),
            signing,
            header: MavHeader { system_id: system_id.into(), component_id, sequence: 0 },
            counts: MavlinkCounts::default(),
            has_datagram: false,
        })
    }

    /// Returns the system as which this end speaks.
    pub(super) fn own_system_id(&self) -> u8 {
        // It was made of a byte.
        self.header.system_id as u8
    }

    /// Returns the address of this end.
    pub(super) fn local_address(&self) -> Option<SocketAddr> {
        self.socket.local_address()
    }

    /// Returns the next frame whose signature is right, if one comes before a time.
    ///
    /// # Errors
    /// With a failure of the machine.
    pub(super) fn receive(
        &mut self,
        until: Instant,
    ) -> Result<Option<MAVLinkV2MessageRaw>, String> {
        loop {
            while let Some(raw) = self.splitter.next(&mut self.counts) {
                if self.is_authentic(&raw) {
                    return Ok(Some(raw));
                }
            }
            if self.has_datagram {
                self.splitter.clear(&mut self.counts);
                self.has_datagram = false;
            }
            // Whoever sends nothing but what is dropped may not hold up the caller.
            if Instant::now() > until + MAX_DROP_TIME {
                return Ok(None);
            }
            let within = until.saturating_duration_since(Instant::now());
            let arrival = self.socket.receive(&mut self.buffer, within);
            match arrival.map_err(|error| error.to_string())? {
                Arrival::Datagram(bytes) => {
                    self.splitter.push(&self.buffer[..bytes]);
                    self.has_datagram = true;
                }
                Arrival::Stream(bytes) => self.splitter.push(&self.buffer[..bytes]),
                Arrival::Reconnected => self.splitter.clear(&mut self.counts),
                Arrival::Nothing if Instant::now() >= until => return Ok(None),
                Arrival::Nothing => {}
            }
        }
    }

    fn is_authentic(&mut self, raw: &MAVLinkV2MessageRaw) -> bool {
        let Some(signing) = &self.signing else { return true };
        if raw.incompatibility_flags() & IFLAG_SIGNED == 0 {
            self.counts.unsigned += 1;
            return false;
        }
        let is_right = signing.verify_signature(raw);
        if !is_right {
            self.counts.badly_signed += 1;
        }
        is_right
    }

    /// Takes note that the last frame was from the vehicle: answers go there.
    pub(super) fn accept_source(&mut self) {
        self.socket.accept_source();
    }

    /// Returns the number of datagrams that were dropped because they came from another address.
    pub(super) fn strangers(&self) -> u64 {
        self.socket.strangers()
    }

    /// Sends a message.
    pub(super) fn send<D: MessageData>(&mut self, content: &D) {
        let mut raw = MAVLinkV2MessageRaw::new();
        if self.signing.is_some() {
            *raw.incompatibility_flags_mut() = IFLAG_SIGNED;
        }
        raw.serialize_message_data(self.header, content);
        if let Some(signing) = &self.signing {
            signing.sign_message(&mut raw);
        }
        self.header.sequence = self.header.sequence.wrapping_add(1);
        if !self.socket.send(raw.raw_bytes()) {
            self.counts.unsent += 1;
        }
    }
}
