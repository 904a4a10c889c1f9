//! An airplane of a group in its own frame.

use crate::flight::{
    AircraftModel, Autopilot, FlightConditions, Frame, InterOrderSegment, KnownAircraft, Point,
    Pose2, RoutePosition,
};
use crate::world::AirspaceWorld;
use std::borrow::Cow;

/// An airplane of a group in the frame that touches the surface where all see it.
pub(super) struct LocalFlight<'a> {
    pub(super) model: Cow<'a, AircraftModel>,
    pub(super) frame: Frame,
    pub(super) pose: Pose2,
    /// The air around it.
    pub(super) air: FlightConditions,
    /// The way-points of its route, as far as it can get.
    pub(super) mission: Cow<'a, [Point]>,
    /// Number of way-points done with.
    pub(super) next: usize,
}

impl<'a> LocalFlight<'a> {
    /// Returns an airplane with the way-points that it can get to in some seconds.
    pub(super) fn new(world: &'a AirspaceWorld, known: KnownAircraft, seconds: f64) -> Self {
        let InterOrderSegment { model, mission, .. } = world.known_segment(known);
        let frame = world.surface.frame_at(known.pose.at);
        let pose = frame.pose_to_local(known.pose);
        let next = known.next;
        let route = RoutePosition { mission, next, pose };
        let air = world.air_around(known);
        let mission = air.local_mission(frame, &model, route, seconds);
        Self { model, frame, pose, air, mission, next }
    }

    pub(super) fn autopilot(&self) -> Autopilot<'_> {
        self.air.autopilot(&self.model, &self.mission)
    }

    /// Returns its next way-point, if it has one.
    pub(super) fn goal(&self) -> Option<Point> {
        self.mission.get(self.next).copied()
    }
}
