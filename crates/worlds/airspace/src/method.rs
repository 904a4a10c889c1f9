//! Methods by which airplanes choose where to fly: the built-in ones, and those of a program's own.
//!
//! A method of your own gives each airplane a heading or a turn rate, from what that airplane perceives, and if it wants a
//! level and a speed. It is asked once per step of `dtau`, as ORCA, MVP and track bands are; the airplane turns as fast as it can, and the shield, where it is on,
//! filters the result as it does that of any method.

use crate::baseline::AircraftState;
use crate::flight::{CommandKinds, MethodCommand, Point, SpeedFactors};
use crate::settings::BuiltInMethod;
use sidestep_kernel::Cycle;
use sidestep_kernel::stream::Draws;
use std::collections::BTreeMap;
use std::fmt::Debug;
use std::sync::Arc;

/// Methods of a program's own, by the names that scenarios call them.
pub type Methods = BTreeMap<String, Arc<dyn Method>>;

/// A rule by which an airplane avoids others. Implement it for methods of your own; see
/// `crates/sidestep/examples/own_method.rs`.
pub trait Method: Debug + Send + Sync {
    /// Returns what an airplane is to do in the next step. It may depend only on the percept and on the airplane's
    /// random stream of this cycle, because groups decide in any order; and because, with agents, each airplane of a
    /// group computes the same for all of it. What it has to know of the past it reads from headings and velocities.
    fn decide(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> Steering;

    /// Returns what it commands beside where to turn; nothing unless given. It must always be the same.
    fn command_kinds(&self) -> CommandKinds {
        CommandKinds::NONE
    }

    /// Returns the level and the speed that an airplane is to have; called after `decide` if
    /// [`Self::command_kinds`] has any. The last command of a cycle counts: from the next cycle on it overlays
    /// the filed flight, within what the airplane can fly and, with the shield, as far as that clears it. What is none is
    /// flown as filed. The percept has what is in force.
    fn command(&self, _: &MethodPercept<'_>, _: &mut Draws) -> MethodCommand {
        MethodCommand::NONE
    }
}

/// What an airplane perceives in one step of `dtau`. Positions are those that all see, with the errors of the scenario.
#[derive(Debug, Clone, Copy)]
pub struct MethodPercept<'a> {
    /// The present cycle.
    pub now: Cycle,
    /// Seconds since the cycle began.
    pub elapsed_s: f64,
    /// Seconds until it is asked again.
    pub step_s: f64,
    /// The airplane itself.
    pub own: &'a AircraftState,
    /// Its next way-point, meters.
    pub way_point_m: Point,
    /// Its greatest turn rate, in radians per second.
    pub omega_max_rad_s: f64,
    /// The altitude of its filed level, in meters.
    pub filed_altitude_m: f64,
    /// Its filed airspeed, in meters per second.
    pub filed_v_m_s: f64,
    /// The command that is in force.
    pub command: MethodCommand,
    /// The wind around the airplane, in meters per second; velocities of airplanes are relative to that air.
    pub wind_m_s: Point,
    /// The others of its group on its levels (on all levels, if the method commands levels), by rising id, and then those that avoid nobody. All that it could come
    /// too near to within `airspace.horizon_s` are among them.
    pub others: &'a [AircraftState],
}

/// What an airplane is to do in one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Steering {
    /// Fly to its way-point.
    Proceed,
    /// Turn to a heading in radians, counterclockwise from east.
    Heading(f64),
    /// Turn at a rate in radians per second, positive to the left; at its greatest rate if this is faster.
    TurnRate(f64),
    /// Turn to the direction of a velocity through the air in meters per second, east and north. Its speed stays, so
    /// that only the direction counts; without one it proceeds.
    Velocity(Point),
}

impl Steering {
    fn is_finite(&self) -> bool {
        match self {
            Self::Proceed => true,
            Self::Heading(number) | Self::TurnRate(number) => number.is_finite(),
            Self::Velocity(velocity) => velocity.iter().all(|number| number.is_finite()),
        }
    }
}

/// A heading in radians, or none for an airplane that is to proceed.
impl From<Option<f64>> for Steering {
    fn from(heading_rad: Option<f64>) -> Self {
        heading_rad.map_or(Self::Proceed, Self::Heading)
    }
}

/// The method of a world.
#[derive(Debug, Clone)]
pub enum MethodKind {
    /// Probability collectives.
    Pc,
    /// Optimal reciprocal collision avoidance.
    Orca,
    /// Modified voltage potential.
    Mvp,
    /// Track bands, as DAIDALUS computes them.
    Bands,
    /// Straight to the way-point, without regard to others.
    None,
    /// The orders of a caller of the library; without them, the flight plan.
    External,
    /// A method of the program's own.
    Own(OwnMethod),
}

/// A method of the program's own, with its name.
#[derive(Debug, Clone)]
pub struct OwnMethod {
    /// The name by which the scenario calls it.
    pub name: Arc<str>,
    method: Arc<dyn Method>,
}

impl OwnMethod {
    pub(crate) fn new(name: &str, method: &Arc<dyn Method>) -> Self {
        Self { name: name.into(), method: Arc::clone(method) }
    }

    /// Returns what the method gives an airplane.
    ///
    /// # Panics
    /// When that is no number: an airplane would have no position any more.
    pub(crate) fn decide(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> Steering {
        let steering = self.method.decide(percept, draws);
        let Self { name, .. } = self;
        assert!(
            steering.is_finite(),
            "method `{name}` gave airplane {} {steering:?}",
            percept.own.slot
        );
        steering
    }

    /// Returns what the method commands beside where to turn.
    ///
    /// # Panics
    /// When that consists of no numbers with which an airplane could be flown.
    pub(crate) fn command_kinds(&self) -> CommandKinds {
        let kinds = self.method.command_kinds();
        let Self { name, .. } = self;
        let are_factors = |speeds: SpeedFactors| {
            speeds.least > 0.0
                && speeds.least <= 1.0
                && speeds.largest >= 1.0
                && speeds.largest.is_finite()
        };
        assert!(
            kinds.speeds.is_none_or(are_factors),
            "method `{name}` commands {kinds:?}; give factors above 0, up to 1 and from 1 on"
        );
        kinds
    }

    /// Returns the level and the speed that the method commands of an airplane: only what it says that it commands.
    ///
    /// # Panics
    /// When these are no numbers: an airplane would have no position any more.
    pub(crate) fn command(&self, percept: &MethodPercept<'_>, draws: &mut Draws) -> MethodCommand {
        let kinds = self.method.command_kinds();
        if kinds.is_none() {
            return MethodCommand::NONE;
        }
        let MethodCommand { level, v_m_s } = self.method.command(percept, draws);
        let command = MethodCommand {
            level: level.filter(|_| kinds.levels),
            v_m_s: v_m_s.filter(|_| kinds.speeds.is_some()),
        };
        let Self { name, .. } = self;
        let slot = percept.own.slot;
        assert!(command.is_valid(), "method `{name}` commanded of airplane {slot} {command:?}");
        command
    }
}

impl MethodKind {
    /// Returns its name in files.
    pub fn name(&self) -> &str {
        match self {
            Self::Pc => BuiltInMethod::Pc.name(),
            Self::Orca => BuiltInMethod::Orca.name(),
            Self::Mvp => BuiltInMethod::Mvp.name(),
            Self::Bands => BuiltInMethod::Bands.name(),
            Self::None => BuiltInMethod::None.name(),
            Self::External => BuiltInMethod::External.name(),
            Self::Own(own) => &own.name,
        }
    }
}

impl From<BuiltInMethod> for MethodKind {
    fn from(word: BuiltInMethod) -> Self {
        match word {
            BuiltInMethod::Pc => Self::Pc,
            BuiltInMethod::Orca => Self::Orca,
            BuiltInMethod::Mvp => Self::Mvp,
            BuiltInMethod::Bands => Self::Bands,
            BuiltInMethod::None => Self::None,
            BuiltInMethod::External => Self::External,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::AirspaceRun;
    use crate::scenario::CompiledAirspace;
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    /// Asks for one thing in all situations.
    #[derive(Debug)]
    struct Always(Steering);

    impl Method for Always {
        fn decide(&self, percept: &MethodPercept<'_>, _: &mut Draws) -> Steering {
            assert!(percept.others.iter().all(|other| other.slot != percept.own.slot));
            self.0
        }
    }

    fn run(method: &str, steering: Steering, more: &str) -> AirspaceRun {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\nmethod = \"{method}\"\n{more}\n\
             generator = {{ kind = \"superconflict\", n = 6 }}\n"
        );
        let source = Source::new("s.toml", text, "");
        let method: Arc<dyn Method> = Arc::new(Always(steering));
        let own = Methods::from([("own".to_string(), method)]);
        let mut run =
            CompiledAirspace::with_methods(&source, &own).expect("a scenario").start(&source, 1);
        run.advance(90);
        run
    }

    #[test]
    fn an_own_method_that_does_as_a_built_in_one_gives_its_bits() {
        let bare = "shield = \"off\"";
        for steering in [Steering::Proceed, Steering::Velocity([0.0; 2])] {
            let own = run("own", steering, bare);
            assert_eq!(own.digest(), run("none", steering, bare).digest(), "{steering:?}");
        }
    }

    #[test]
    fn headings_and_velocities_of_one_direction_give_the_same_flight() {
        let bare = "shield = \"off\"";
        let north = std::f64::consts::FRAC_PI_2;
        let by_heading = run("own", Steering::Heading(north), bare).digest();
        assert_eq!(run("own", Steering::Velocity([0.0, 3.0]), bare).digest(), by_heading);
        // Faster than an airplane can turn is as fast as it can.
        let spinning = run("own", Steering::TurnRate(100.0), bare).digest();
        assert_ne!(spinning, by_heading);
        assert_eq!(run("own", Steering::TurnRate(50.0), bare).digest(), spinning);
    }

    #[test]
    fn the_shield_keeps_airplanes_apart_by_any_method() {
        let losses =
            |more: &str| run("own", Steering::Proceed, more).metrics().losses_of_separation;
        assert!(losses("shield = \"off\"") > 0);
        assert_eq!(losses(""), 0);
    }

    #[test]
    #[should_panic(expected = "method `own` gave airplane 0 Heading(NaN)")]
    fn a_heading_that_is_no_number_ends_the_run() {
        run("own", Steering::Heading(f64::NAN), "");
    }
}
