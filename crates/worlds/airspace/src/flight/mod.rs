//! Flight of airplanes: motion, actions and predictions, orders, recorded tracks.
//!
//! ```text
//! motion.rs                          a pose, and one step of it
//! performance.rs  acceleration.rs    what an airplane can fly, and changes of speed that take time
//! action.rs  change.rs               possible actions: turns, and changes of level and speed
//! autopilot.rs  air.rs               where they lead, in which wind
//! airplane.rs  order.rs  segment.rs  one airplane, its orders, and the flight between them
//! track.rs  levels.rs                recorded tracks, and ranges of altitude
//! leg.rs  proximity.rs               stretches of flight, how near two of them come, and how deep into each other's zone
//! surface.rs  pair_plane.rs          a plane or the earth, and the planes in which motions are computed and compared
//! wind.rs  gusts.rs                  a wind that differs from place to place, and one that no airplane knows
//! chart.rs                           how positions are drawn
//! ```

mod acceleration;
mod action;
mod air;
mod airplane;
mod autopilot;
mod change;
mod chart;
mod command;
mod gusts;
mod leg;
mod levels;
mod motion;
mod order;
mod pair_plane;
mod performance;
mod phase;
mod proximity;
mod segment;
mod surface;
mod track;
mod wind;

pub(crate) use acceleration::SpeedChanges;
pub(crate) use action::actions_at_turn_rate;
pub use action::{Action, DetourAlternatives, TurnAction, actions};
pub use air::{FlightConditions, RoutePosition};
pub(crate) use airplane::DoneOrders;
pub use airplane::{AirplaneStart, KnownAircraft};
pub use autopilot::{AfterLastWaypoint, Autopilot, Prediction, WaypointRule};
pub(crate) use change::ChangeableFlight;
pub use change::{ChangeAlternatives, FiledLevelSpeed, FlightChange, SteadyChange};
pub use chart::Chart;
pub use command::{CommandKinds, CommandLimits, LevelCommand, MethodCommand, SpeedFactors};
pub use gusts::Gusts;
pub(crate) use gusts::MAX_CORRELATION_CYCLES;
pub use leg::{ConstantRateLeg, PairApproach, SeparationMinima, is_separation_lost};
pub(crate) use leg::{KinematicState, ROUNDING_M};
pub use levels::FlightLevelRange;
pub use motion::{AircraftModel, Point, Pose2, TimeDiscretization, distance_m};
pub(crate) use motion::{MAX_STEPS_PER_DT, rotated};
pub use order::{FlightOrder, FlightTask, MAX_ORDERS};
pub use pair_plane::PairPlane;
pub(crate) use pair_plane::RigidMotion;
pub(crate) use performance::{CLIMB_M_S, GRAVITY_M_S2};
pub use performance::{Performance, TurnLimit};
pub use phase::FlightPhase;
pub(crate) use proximity::{PairZones, Proximity};
pub(crate) use segment::{InterOrderSegment, SegmentAfterOrder, segments_after_orders};
pub use surface::{Frame, Surface, coordinates_from_degrees};
pub use track::{Track, TrackPoint};
pub use wind::WindField;
pub(crate) use wind::{WindGridError, WindNode};
