//! What was dropped or refused, by name.

/// Counts of what is wrong with what has come from an autopilot, or went to it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MavlinkCounts {
    /// Pieces of bytes that are no frame, and frames whose checksum or content is wrong.
    pub unreadable: u64,
    /// Frames of version 1: they cannot be signed, and are dropped.
    pub version_1: u64,
    /// Frames without a signature where one is required.
    pub unsigned: u64,
    /// Frames with a wrong or an old signature.
    pub badly_signed: u64,
    /// Frames of other systems.
    pub other_systems: u64,
    /// Frames of the vehicle that did not arrive, by their sequence.
    pub lost: u64,
    /// Frames of the vehicle that arrived after later ones, or twice.
    pub out_of_order: u64,
    /// Positions older than one before, and such that are none.
    pub bad_positions: u64,
    /// Times that the vehicle's clock began anew: it has booted.
    pub reboots: u64,
    /// Times that the vehicle's clock went ahead by a jump.
    pub clock_jumps: u64,
    /// Times that heartbeats stopped.
    pub silences: u64,
    /// Commands that the autopilot has refused.
    pub refused_commands: u64,
    /// Commands that were repeated in vain.
    pub unanswered_commands: u64,
    /// Frames that could not be sent.
    pub unsent: u64,
    /// Reports of traffic that are incomplete, old or too many.
    pub dropped_traffic: u64,
    /// Reports of traffic that come back from those that were told.
    pub traffic_echoes: u64,
}

impl MavlinkCounts {
    /// Returns all counts by their names.
    pub fn list(&self) -> Vec<(String, u64)> {
        let named = [
            ("unreadable", self.unreadable),
            ("version_1", self.version_1),
            ("unsigned", self.unsigned),
            ("badly_signed", self.badly_signed),
            ("other_systems", self.other_systems),
            ("lost", self.lost),
            ("out_of_order", self.out_of_order),
            ("bad_positions", self.bad_positions),
            ("reboots", self.reboots),
            ("clock_jumps", self.clock_jumps),
            ("silences", self.silences),
            ("refused_commands", self.refused_commands),
            ("unanswered_commands", self.unanswered_commands),
            ("unsent", self.unsent),
            ("dropped_traffic", self.dropped_traffic),
            ("traffic_echoes", self.traffic_echoes),
        ];
        named.map(|(name, count)| (name.to_string(), count)).to_vec()
    }
}
