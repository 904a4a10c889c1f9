//! Reactions of a program's own: where a connector goes when its master has moved, or its veto.
//!
//! Such a reaction takes the place of the rule by which free connectors push, pull, resize and rotate. Connectors that
//! are fixed, have failed, or belong on a line or a plane keep the built-in rule, which leaves them hardly a choice.

use super::geometry::Point;
use super::veto::VetoReason;
use std::fmt::{self, Debug, Formatter};

/// A rule by which a connector passes on the motion of its master, or vetoes it. Implement it for reactions of your
/// own, and give them to a [`Propagator`](crate::Propagator) or to the world of chains.
pub trait Reaction: Debug + Send + Sync {
    /// Returns the place to which a connector goes; its present one, bit for bit, if it stays. It may depend only on
    /// the percept, and draws nothing: a motion is tried several times, and by agents each of which computes it alone.
    ///
    /// The chain keeps its laws in any case: a place that breaks one is a veto of this connector, with the law as its
    /// reason.
    ///
    /// # Errors
    /// The reason for a veto; then no part of the chain moves.
    fn react(&self, percept: &MasterMove<'_>) -> Result<Point<3>, VetoReason>;
}

/// The motion of a master, as its slave perceives it: places in meters; in the plane the last coordinate is 0.
pub struct MasterMove<'a> {
    /// The place of the slave.
    pub at_m: Point<3>,
    /// The place of the master before the motion.
    pub master_from_m: Point<3>,
    /// The place of the master after it.
    pub master_to_m: Point<3>,
    /// The connector on the master's other side, if its new place is settled.
    pub behind_master_m: Option<Point<3>>,
    /// The place where the slave is pushed or pulled to: on the line from the master to its present place, at the
    /// nearest length that the rod allows. It is the present place if it need not move.
    pub guided_m: Point<3>,
    /// Least and greatest length of the rod between them, meters.
    pub rod_m: [f64; 2],
    /// Radius of the slave's body, meters.
    pub radius_m: f64,
    /// Greatest angle of the bend at the master, rad.
    pub max_bend_rad: f64,
    pub(super) check: &'a dyn Fn(Point<3>) -> Result<(), VetoReason>,
}

impl MasterMove<'_> {
    /// Checks whether the slave may be at a place, and its rod on the way there.
    ///
    /// # Errors
    /// The law that this would break: the length of the rod, the bend at the master, an obstacle, the chain's own
    /// parts, the longest step, or the region of the slave.
    pub fn check(&self, at_m: Point<3>) -> Result<(), VetoReason> {
        (self.check)(at_m)
    }
}

impl Debug for MasterMove<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.debug_struct("MasterMove")
            .field("at_m", &self.at_m)
            .field("master_from_m", &self.master_from_m)
            .field("master_to_m", &self.master_to_m)
            .field("guided_m", &self.guided_m)
            .finish_non_exhaustive()
    }
}
