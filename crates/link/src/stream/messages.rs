//! The messages of a stream, as `docs/src/wire/` defines them.

#![allow(unreachable_pub, reason = "messages are public wherever they are declared")]

use sidestep::import::cdr_message;
use sidestep::kernel::view::{Body, BodyRole, EarthProjection, Frame, LogEvent, Scenery, Severity};

cdr_message!(
    /// `sidestep_msgs/msg/FleetDescription`: everything of a fleet that stays the same.
    #[derive(Default)]
    FleetDescription {
        /// The build of the program that publishes.
        build: String,
        /// The world's name.
        world: String,
        /// The scenario's name.
        scenario: String,
        /// The seed.
        seed: u64,
        /// Cycles planned.
        cycles: u64,
        /// Length of a cycle in seconds of the scenario.
        cycle_s: f64,
        /// `lockstep` or `realtime`.
        clock: String,
        /// Seconds of the scenario in a second of real time; 0 in lockstep.
        speed: f64,
        /// Whether it has a server.
        has_server: bool,
        /// What an agent is called.
        agent: String,
        /// 2 where everything lies in a plane, else 3.
        dimensions: u8,
        /// How meters stand for places on earth; empty if they stand for none.
        projection: String,
        /// Latitude and longitude of the origin.
        origin_deg: [f64; 2],
        /// Radius in meters of the sphere of an equirectangular projection.
        radius_m: f64,
    }
);

impl FleetDescription {
    /// Returns the same description with what a scenery says.
    pub(super) fn with_scenery(self, scenery: &Scenery) -> Self {
        let (projection, origin_deg, radius_m) = match scenery.earth.chart {
            None => ("", [0.0; 2], 0.0),
            Some(chart) => match chart.projection {
                EarthProjection::AzimuthalEquidistant => {
                    ("azimuthal-equidistant", chart.origin_deg, 0.0)
                }
                EarthProjection::Equirectangular { radius_m } => {
                    ("equirectangular", chart.origin_deg, radius_m)
                }
            },
        };
        Self {
            scenario: scenery.name.clone(),
            cycle_s: scenery.cycle_s,
            dimensions: scenery.dimensions,
            projection: projection.into(),
            origin_deg,
            radius_m,
            ..self
        }
    }
}

cdr_message!(
    /// `sidestep_msgs/msg/BodyState`: something that can move, at one moment.
    BodyState {
        /// Its name.
        name: String,
        /// Its position.
        position_m: [f64; 3],
        /// Its orientation, a unit quaternion x, y, z, w.
        orientation: [f64; 4],
        /// Its velocity over the ground.
        velocity_m_s: [f64; 3],
        /// Its condition.
        condition: String,
    }
);

impl From<&Body> for BodyState {
    fn from(body: &Body) -> Self {
        Self {
            name: body.name(),
            position_m: body.pose.at_m,
            orientation: body.pose.turn,
            velocity_m_s: body.velocity_m_s,
            condition: body.state.name().into(),
        }
    }
}

cdr_message!(
    /// `sidestep_msgs/msg/FleetState`: where everything is between two cycles.
    FleetState {
        /// Number of cycles that are done.
        cycle: u64,
        /// Seconds of the scenario since the start.
        time_s: f64,
        /// Whether it is the last state.
        is_over: bool,
        /// Number of the event that will happen next.
        next_event: u64,
        /// All bodies.
        bodies: Vec<BodyState>,
    }
);

impl FleetState {
    /// Returns the state that a frame shows, before the event with a number. Lines and areas that only pictures have are left
    /// out.
    pub(super) fn new(frame: &Frame, next_event: u64) -> Self {
        let is_real = |body: &&Body| {
            !matches!(
                body.kind.role(),
                BodyRole::LineThroughParts(_) | BodyRole::AroundAgent(_) | BodyRole::StartOf(_)
            )
        };
        Self {
            cycle: frame.cycle,
            time_s: frame.time_s,
            is_over: false,
            next_event,
            bodies: frame.bodies.iter().filter(is_real).map(BodyState::from).collect(),
        }
    }
}

cdr_message!(
    /// `sidestep_msgs/msg/FleetEvent`: something that has happened.
    FleetEvent {
        /// Its number.
        number: u64,
        /// The cycle in which it happened.
        cycle: u64,
        /// 0 info, 1 warning, 2 error.
        severity: u8,
        /// Its kind.
        kind: String,
        /// The body that it happened to.
        body: String,
        /// The other body; empty if there is none.
        other: String,
        /// Whether it has a position.
        has_position: bool,
        /// Its position.
        position_m: [f64; 3],
        /// Whether it has a value.
        has_value: bool,
        /// The value.
        value: f64,
        /// The unit of the value.
        unit: String,
        /// A sentence for people.
        text: String,
    }
);

impl FleetEvent {
    /// Returns the message of an event.
    pub(super) fn new(number: u64, event: &LogEvent) -> Self {
        let value = event.value.as_ref();
        Self {
            number,
            cycle: event.cycle,
            severity: match event.level {
                Severity::Info => 0,
                Severity::Warning => 1,
                Severity::Error => 2,
            },
            kind: event.kind.name().into(),
            body: event.who.to_string(),
            other: event.with.map(|other| other.to_string()).unwrap_or_default(),
            has_position: event.at_m.is_some(),
            position_m: event.at_m.unwrap_or_default(),
            has_value: value.is_some(),
            value: value.map_or(0.0, |value| value.value),
            unit: value.map(|value| value.unit.to_string()).unwrap_or_default(),
            text: event.words.clone(),
        }
    }
}

cdr_message!(
    /// `sidestep_msgs/msg/FleetEvents`: events by rising number.
    FleetEvents {
        /// Number of the oldest event that can still be asked for.
        oldest: u64,
        /// Number of the next event that will happen.
        next: u64,
        /// The events.
        events: Vec<FleetEvent>,
    }
);
