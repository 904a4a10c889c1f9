//! Purposes of random draws of this world.

use sidestep_kernel::network::FaultStreams;
use sidestep_kernel::stream::{Purpose, Streams};
use sidestep_kernel::{Cycle, EntitySlot};

/// Starts and goals of generated airplanes.
pub(crate) const PLACE: Purpose = Purpose(1);
/// Samples of the optimizer, one stream per airplane and cycle.
pub(crate) const SAMPLE: Purpose = Purpose(2);
/// Errors of known positions.
pub(crate) const POSITION: Purpose = Purpose(3);
/// Disturbed headings.
pub(crate) const HEADING: Purpose = Purpose(4);
/// Faults of messages.
pub(crate) const NETWORK: Purpose = Purpose(5);
/// States of links: in a burst of losses or not.
pub(crate) const BURST: Purpose = Purpose(6);
/// Messages lost in a burst.
pub(crate) const BURST_LOSS: Purpose = Purpose(7);
/// Methods of a program's own, one stream per airplane and cycle.
pub(crate) const METHOD: Purpose = Purpose(8);
/// Gusts.
pub(crate) const GUST: Purpose = Purpose(9);
/// Errors of reported velocities.
pub(crate) const VELOCITY: Purpose = Purpose(10);
/// Reports that observers receive, and the errors of their sensors.
pub(crate) const REPORT: Purpose = Purpose(11);
/// Times at which airplanes report.
pub(crate) const REPORT_OFFSET: Purpose = Purpose(12);

/// Returns the streams and purposes from which a network's faults are drawn.
pub(crate) fn network_fault_streams(streams: Streams) -> FaultStreams {
    FaultStreams { streams, network: NETWORK, burst: BURST, burst_loss: BURST_LOSS }
}

/// Returns the `k`-th uniform number in [0, 1) of an airplane's samples in a cycle.
pub(crate) fn sample(streams: &Streams, slot: EntitySlot, now: Cycle, k: u64) -> f64 {
    // A block of the stream has four words of 32 bits.
    let words = streams.block(slot, now, SAMPLE, (k / 4) as u16);
    f64::from(words[(k % 4) as usize]) / 4_294_967_296.0
}
