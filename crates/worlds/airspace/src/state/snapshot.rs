//! Snapshots of a state by id, and their digests.

use super::command::AirplaneCommand;
use super::end::PackedFlightEnd;
use super::hold::HoldState;
use crate::agents::traffic_state::TrafficPicture;
use crate::baseline::mvp::ActiveResolutions;
use crate::external_action::ExternalAction;
use crate::flight::Pose2;
use crate::measures::FlightEffort;
use crate::pilot::AirplaneControl;
use crate::shield::Fallback;
use crate::surveillance::StateVectorHistory;
use serde::{Deserialize, Serialize};
use sidestep_kernel::column::Packed;
use sidestep_kernel::digest::Hasher;
use sidestep_kernel::{Cycle, Digest, EntityId};

/// One airplane in a snapshot, as checkpoints have it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct AirplaneSnapshot {
    /// Pose at the start of the cycle.
    pub pose: Pose2,
    /// See [`super::AirplaneState::end`].
    pub ended: PackedFlightEnd,
    /// Number of way-points done with, overrides, orbits, and orbits in a row.
    pub counts: [u32; 4],
    /// The stored fallback.
    pub fallback: Fallback,
    /// Whether all know it who have watched the flight.
    pub is_tracked: bool,
    /// Altitude in meters.
    pub altitude_m: f64,
    /// Number of orders carried out, and of times that one had to wait.
    pub orders: [u16; 2],
    /// Turn rate in the step that it flew last, in radians per second.
    pub turn_rate_rad_s: f64,
}

/// Closest approach and losses of a pair of airplanes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairRecord {
    /// Closest approach in meters.
    pub nearest_m: f64,
    /// Time in which they were nearer than their separation: in whole nanoseconds, so that the sum
    /// does not depend on the order.
    pub lost_ns: u64,
    /// Number of separate losses of separation.
    pub losses: u32,
}

impl PairRecord {
    /// Adds another record of the same pair, in any order.
    pub fn add(&mut self, other: Self) {
        self.nearest_m = self.nearest_m.min(other.nearest_m);
        self.lost_ns += other.lost_ns;
        self.losses += other.losses;
    }
}

/// A state by id: the content of a checkpoint, and the input of a digest.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Number of cycles done.
    pub cycle: Cycle,
    /// The airplanes by id.
    pub airplanes: Vec<AirplaneSnapshot>,
    /// Each airplane's knowledge of others; empty where the network is reliable.
    pub contacts: Vec<TrafficPicture>,
    /// The conflicts that each airplane resolves; empty unless the method is MVP.
    pub resolving: Vec<ActiveResolutions>,
    /// The pairs whose separation the shield does not guarantee now, by ids.
    pub exempt: Vec<(EntityId, EntityId)>,
    /// Each airplane's pose on its stored fallback; empty where no gust takes it off that.
    pub orbit_poses: Vec<Pose2>,
    /// What the method commands of each airplane; empty unless a method commands levels or speeds.
    pub commands: Vec<AirplaneCommand>,
    /// The action that a caller has ordered for each airplane; empty unless callers decide.
    pub external_actions: Vec<Option<ExternalAction>>,
    /// Controls of airplanes for the next cycle, if pilots outside of the run have submitted them.
    pub controls: Option<Vec<AirplaneControl>>,
    /// What the flight of each airplane has cost, which affects no future; empty unless that is measured.
    pub efforts: Vec<FlightEffort>,
    /// The holds of each airplane by the shield, which affect no future; empty where none can be held.
    pub holds: Vec<HoldState>,
    /// The past states of each airplane, of which its reports tell; empty where all see all.
    pub state_vectors: Vec<StateVectorHistory>,
}

impl Snapshot {
    /// Returns the digest of this state (promise D1): every value by id.
    pub fn digest(&self) -> Digest {
        let mut hasher = Hasher::default();
        hasher.write_u64(self.cycle);
        hasher.write_u64(self.airplanes.len() as u64);
        for pose in &self.orbit_poses {
            hash_pose(&mut hasher, pose);
        }
        for airplane in &self.airplanes {
            hash_pose(&mut hasher, &airplane.pose);
            hasher.write_u64(airplane.ended.to_bits());
            airplane.counts.iter().for_each(|&n| hasher.write_u32(n));
            // Nobody has to know it unless messages get lost.
            let tracked_bit = u64::from(airplane.is_tracked) << 16;
            hasher.write_u64(u64::from(airplane.fallback.to_bits()) | tracked_bit);
            // Left out without orders, because the altitude then is the scenario's, or that of the
            // track.
            let [orders, waits] = airplane.orders;
            if orders > 0 || waits > 0 {
                hasher.write_u64(airplane.altitude_m.to_bits());
                hasher.write_u32(u32::from(orders) << 16 | u32::from(waits));
            }
        }
        for &(a, b) in &self.exempt {
            hasher.write_u32(a);
            hasher.write_u32(b);
        }
        if !self.contacts.is_empty() {
            hash_data(&mut hasher, &self.contacts);
        }
        if !self.resolving.is_empty() {
            hash_data(&mut hasher, &self.resolving);
        }
        // Commands change levels without any order.
        if !self.commands.is_empty() {
            self.airplanes.iter().for_each(|a| hasher.write_u64(a.altitude_m.to_bits()));
            hash_data(&mut hasher, &self.commands);
        }
        // Turn rates do not affect the future, unless a caller outside decides by them.
        if !self.external_actions.is_empty() {
            self.airplanes.iter().for_each(|a| hasher.write_u64(a.turn_rate_rad_s.to_bits()));
            hash_data(&mut hasher, &self.external_actions);
        }
        if !self.state_vectors.is_empty() {
            hash_data(&mut hasher, &self.state_vectors);
        }
        if let Some(controls) = &self.controls {
            hash_data(&mut hasher, controls);
        }
        hasher.finish()
    }
}

fn hash_pose(hasher: &mut Hasher, pose: &Pose2) {
    let Pose2 { at: [x, y], heading_rad } = *pose;
    [x, y, heading_rad].iter().for_each(|v| hasher.write_u64(v.to_bits()));
}

/// Adds the bytes of a value as a checkpoint has them.
fn hash_data(hasher: &mut Hasher, value: &impl Serialize) {
    let bytes = postcard::to_stdvec(value).expect("parts of a state are plain data");
    bytes.iter().for_each(|&byte| hasher.write_u8(byte));
}
