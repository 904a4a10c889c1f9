//! The conventions of `rmw_zenoh`, by which ROS 2 names things on Zenoh: <https://github.com/ros2/rmw_zenoh>, its page
//! `docs/design.md` and the sources `liveliness_utils.cpp`, `attachment_helpers.cpp` and `rmw_publisher_data.cpp`.
//!
//! Whatever is in the graph of ROS has a *liveliness token*, a key of Zenoh that lasts as long as its owner. Messages are
//! samples on a key that has the type and the hash of its definition, so that only those who mean the same type hear each
//! other. Metadata of a message are in its attachment.

use sidestep_session::fleet::RosDistribution;
use std::fmt::Write as _;

/// The first part of all liveliness tokens.
const TOKEN_SPACE: &str = "@ros2_lv";

/// The enclave of nodes without security.
const NO_ENCLAVE: &str = "%";

/// What stands for the hash of a type in Humble, which knows none.
const NO_HASH: &str = "TypeHashNotSupported";

/// Number of bytes of a [`Gid`].
const GID_BYTES: usize = 16;

/// The identity of a publisher or a client, by which those who receive something know it.
pub type Gid = [u8; GID_BYTES];

/// The type of messages of a topic, or of a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RosType {
    /// Its name in ROS, e.g. `sensor_msgs/msg/LaserScan`.
    pub name: &'static str,
    /// The hash of its definition (REP 2011), e.g. `RIHS01_` and 64 digits.
    pub hash: &'static str,
}

impl RosType {
    /// Returns its name in DDS, e.g. `sensor_msgs::msg::dds_::LaserScan_`: keys have it.
    pub fn dds_name(&self) -> String {
        match self.name.rsplit_once('/') {
            Some((package, name)) => format!("{}::dds_::{name}_", package.replace('/', "::")),
            None => format!("{}_", self.name),
        }
    }

    /// Returns what keys of a distribution have in the place of the hash.
    pub fn hash_in_keys(&self, distribution: RosDistribution) -> &'static str {
        match distribution {
            RosDistribution::Humble => NO_HASH,
            RosDistribution::Jazzy => self.hash,
        }
    }
}

/// The quality of service of a topic, as far as those of runs differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct QualityOfService {
    /// Whether those who join late get the last messages (durability `transient_local`).
    pub is_latched: bool,
    /// Number of messages that are kept for a slow receiver, and of a latched topic for late ones.
    pub depth: u32,
}

impl QualityOfService {
    /// The default of ROS: reliable, volatile, ten messages.
    pub const DEFAULT: Self = Self { is_latched: false, depth: 10 };

    /// Quality of a topic of which late ones get the last message.
    pub const LATCHED: Self = Self { is_latched: true, depth: 1 };

    /// Returns its text in tokens: reliability, durability, history and depth, deadline, lifespan, liveliness. An empty part is
    /// the default of the reader; defaults of durability and depth have changed with versions, so these are never left out.
    pub fn token_text(&self) -> String {
        // The numbers are those of the enumerations of rmw: 1 is `transient_local`, 2 `volatile`.
        let durability = if self.is_latched { 1 } else { 2 };
        format!(":{durability}:,{}:,:,:,,", self.depth)
    }
}

/// The kinds of things in the graph that have a topic or a service.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndpointKind {
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
    /// The server of a service.
    Service,
}

impl EndpointKind {
    fn word(self) -> &'static str {
        match self {
            Self::Publisher => "MP",
            Self::Subscription => "MS",
            Self::Service => "SS",
        }
    }
}

/// A topic or a service: its full name and its type.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosEndpoint {
    /// What it is.
    pub kind: EndpointKind,
    /// Its full name, with a slash at its beginning.
    pub name: String,
    /// The type of its messages.
    pub ros_type: RosType,
    /// Its quality of service.
    pub quality: QualityOfService,
}

/// A node of ROS 2, as keys have it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RosNodeName {
    /// The domain.
    pub domain: u32,
    /// The namespace: `/`, or names with a slash before each.
    pub namespace: String,
    /// Its name.
    pub name: String,
    /// The distribution, which determines what stands for hashes.
    pub distribution: RosDistribution,
    /// The id of the session of Zenoh, in hexadecimal digits.
    pub session: String,
}

/// The number of a node in its session: a run has one node.
const NODE_NUMBER: u32 = 0;

impl RosNodeName {
    /// Returns its full name, e.g. `/hall/sidestep`.
    pub fn full_name(&self) -> String {
        self.resolve(&self.name)
    }

    /// Returns the full name of a topic or a service: a name without a slash at its beginning is one of the namespace.
    pub fn resolve(&self, name: &str) -> String {
        match name.strip_prefix('/') {
            Some(_) => name.into(),
            None => format!("{}/{name}", self.namespace.trim_end_matches('/')),
        }
    }

    /// Returns the full name of something that belongs to the node (`~/name`), e.g. `/hall/sidestep/pause`.
    pub fn resolve_private(&self, name: &str) -> String {
        format!("{}/{name}", self.full_name())
    }

    /// Returns the key on which the messages of a topic, or the requests of a service, go.
    pub fn data_key(&self, endpoint: &RosEndpoint) -> String {
        let name = endpoint.name.trim_matches('/');
        let ros_type = &endpoint.ros_type;
        let hash = ros_type.hash_in_keys(self.distribution);
        format!("{}/{name}/{}/{hash}", self.domain, ros_type.dds_name())
    }

    /// Returns the liveliness token of the node.
    pub fn node_token(&self) -> String {
        self.token(NODE_NUMBER, "NN")
    }

    /// Returns the liveliness token of a topic or a service, which has a number of its own in the session.
    pub fn endpoint_token(&self, endpoint: &RosEndpoint, number: u32) -> String {
        let mut token = self.token(number, endpoint.kind.word());
        let name = without_slashes(&endpoint.name);
        let ros_type = &endpoint.ros_type;
        let hash = ros_type.hash_in_keys(self.distribution);
        let quality = endpoint.quality.token_text();
        // Writing to a string cannot fail.
        let _ = write!(token, "/{name}/{}/{hash}/{quality}", ros_type.dds_name());
        token
    }

    fn token(&self, number: u32, kind: &str) -> String {
        let namespace = without_slashes(&self.namespace);
        format!(
            "{TOKEN_SPACE}/{}/{}/{NODE_NUMBER}/{number}/{kind}/{NO_ENCLAVE}/{namespace}/{}",
            self.domain, self.session, self.name
        )
    }

    /// Returns the key at which a latched topic keeps its last messages for late ones: that of an *advanced publisher* of
    /// Zenoh, whose samples have no sequence numbers (`uhlc`) and no further metadata (`_`). Its liveliness token has the same
    /// key.
    pub fn history_key(&self, endpoint: &RosEndpoint) -> String {
        format!("{}/@adv/pub/{}/uhlc/_", self.data_key(endpoint), self.session)
    }
}

/// Returns a name with `%` in the place of each slash: a name is one part of a token.
fn without_slashes(name: &str) -> String {
    if name.is_empty() { "%".into() } else { name.replace('/', "%") }
}

/// The metadata of a message, of a request or of a response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// The number of the message of its publisher, or of the request of its client; from 1 on.
    pub sequence_number: i64,
    /// The time at which it was sent, nanoseconds since 1970.
    pub source_time_ns: i64,
    /// The publisher, or the client.
    pub gid: Gid,
}

/// Bytes of an attachment: two numbers, the length of the identity, and the identity.
const ATTACHMENT_BYTES: usize = 8 + 8 + 1 + GID_BYTES;

impl Attachment {
    /// Returns it as bytes: in the format of `zenoh-ext`, numbers have the little end first, and a list of less than 128
    /// values has its length in a byte.
    pub fn to_bytes(&self) -> [u8; ATTACHMENT_BYTES] {
        let mut bytes = [0; ATTACHMENT_BYTES];
        bytes[..8].copy_from_slice(&self.sequence_number.to_le_bytes());
        bytes[8..16].copy_from_slice(&self.source_time_ns.to_le_bytes());
        bytes[16] = GID_BYTES as u8;
        bytes[17..].copy_from_slice(&self.gid);
        bytes
    }

    /// Reads one; `None` where the bytes are none.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; ATTACHMENT_BYTES] = bytes.try_into().ok()?;
        if usize::from(bytes[16]) != GID_BYTES {
            return None;
        }
        Some(Self {
            sequence_number: i64::from_le_bytes(bytes[..8].try_into().ok()?),
            source_time_ns: i64::from_le_bytes(bytes[8..16].try_into().ok()?),
            gid: bytes[17..].try_into().ok()?,
        })
    }
}

/// Returns the identity of something with a token, which is unique as the token is.
pub fn gid_of_token(token: &str) -> Gid {
    let digest = ring::digest::digest(&ring::digest::SHA256, token.as_bytes());
    let mut gid = Gid::default();
    gid.copy_from_slice(&digest.as_ref()[..GID_BYTES]);
    gid
}

#[cfg(test)]
mod tests {
    use super::*;

    const STRING: RosType = RosType { name: "std_msgs/msg/String", hash: "RIHS01_df66" };

    fn node() -> RosNodeName {
        RosNodeName {
            domain: 7,
            namespace: "/hall".into(),
            name: "sidestep".into(),
            distribution: RosDistribution::Jazzy,
            session: "aac3178e146ba6f1fc6e6a4085e77f21".into(),
        }
    }

    fn chatter(is_latched: bool) -> RosEndpoint {
        let quality =
            if is_latched { QualityOfService::LATCHED } else { QualityOfService::DEFAULT };
        let name = node().resolve("chatter");
        RosEndpoint { kind: EndpointKind::Publisher, name, ros_type: STRING, quality }
    }

    #[test]
    fn keys_have_domain_name_type_and_hash() {
        let key = "7/hall/chatter/std_msgs::msg::dds_::String_/RIHS01_df66";
        assert_eq!(node().data_key(&chatter(false)), key);
        let humble = RosNodeName { distribution: RosDistribution::Humble, ..node() };
        let key = "7/hall/chatter/std_msgs::msg::dds_::String_/TypeHashNotSupported";
        assert_eq!(humble.data_key(&chatter(false)), key);
    }

    #[test]
    fn tokens_are_those_of_rmw_zenoh() {
        let node_token =
            "@ros2_lv/7/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%hall/sidestep".to_string();
        assert_eq!(node().node_token(), node_token);
        let token = "@ros2_lv/7/aac3178e146ba6f1fc6e6a4085e77f21/0/3/MP/%/%hall/sidestep/%hall%chatter/\
                     std_msgs::msg::dds_::String_/RIHS01_df66/:1:,1:,:,:,,";
        assert_eq!(node().endpoint_token(&chatter(true), 3), token);
        let alone = RosNodeName { namespace: "/".into(), ..node() };
        assert!(alone.node_token().ends_with("/0/0/NN/%/%/sidestep"));
        assert_eq!(alone.full_name(), "/sidestep");
        assert_eq!(alone.resolve_private("pause"), "/sidestep/pause");
        assert_eq!(node().resolve("/clock"), "/clock");
    }

    #[test]
    fn attachments_come_back_and_nothing_else_is_one() {
        let attachment = Attachment { sequence_number: -2, source_time_ns: 1 << 40, gid: [7; 16] };
        let bytes = attachment.to_bytes();
        assert_eq!(bytes.len(), 33);
        assert_eq!(Attachment::from_bytes(&bytes), Some(attachment));
        for end in 0..bytes.len() {
            assert_eq!(Attachment::from_bytes(&bytes[..end]), None);
        }
        let mut shorter_gid = bytes;
        shorter_gid[16] = 15;
        assert_eq!(Attachment::from_bytes(&shorter_gid), None);
    }
}
