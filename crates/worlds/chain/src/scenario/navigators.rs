//! Initiators on wheels, and the robots that follow them.

use super::super::formation::RobotSwarmConfig;
use super::super::navigate::{NavigationGoal, Navigator};
use super::super::swarm::drive::DifferentialDrive;
use super::super::swarm::follower::Follower;
use super::super::swarm::laser::Laser;
use super::super::swarm::leader::{
    LeaderController, TargetDetector, TurnMode, WallLeaveRule, WallLossCriterion,
};
use super::{ChainScenarioCompiler, MAX_VALUE, PositiveRule};
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::{Value, json};
use sidestep_kernel::InputError;
use sidestep_scenario::{Number, Point, Rule, Spanned};
use std::f64::consts::PI;

/// Distance between points of a corridor's middle, meters.
const LINE_STEP_M: f64 = 0.1;
/// Default lag of a robot at which a leader waits for it, meters: behind a margin of 0.05 m robots
/// lagged 0.1 m on average and 0.13 to 0.25 m at most, so a leader waits for the few that are held up.
const DEFAULT_LAG_LIMIT_M: f64 = 0.15;
/// Default distance at which a navigator's target counts as reached, meters.
const DEFAULT_TOLERANCE_M: f64 = 0.5;
/// Default number of beams of a laser: one each 2 degrees.
const DEFAULT_BEAMS: usize = 180;
/// Default radius of a robot's body, meters.
const DEFAULT_RADIUS_M: f64 = 0.25;
/// Default speed of the wheels of followers, as a multiple of the speed at which the chain is led: on the outside of
/// bends connectors were measured at up to 1.26 times the leader's speed, and wheels a fifth faster were enough.
const WHEEL_SPEED_FACTOR: f64 = 1.2;
/// Default distance between the wheels of a robot, meters.
const DEFAULT_WHEELBASE_M: f64 = 0.4;

/// A measure of a robot, limited because squares and quotients of others would overflow.
type RobotSize = Number<RobotSizeRule>;

#[derive(Debug, Clone, Copy)]
pub(super) struct RobotSizeRule;

impl Rule for RobotSizeRule {
    fn allows(number: f64) -> bool {
        (1e-6..=MAX_VALUE).contains(&number)
    }

    fn description() -> String {
        "a number from 1e-6 to 1e6".into()
    }

    fn limits() -> Value {
        json!({ "minimum": 1e-6, "maximum": MAX_VALUE })
    }
}

/// Angles up to a whole turn to either side, degrees.
#[derive(Debug, Clone, Copy)]
pub(super) struct DegreesRangeRule;

impl Rule for DegreesRangeRule {
    fn allows(number: f64) -> bool {
        number.abs() <= 360.0
    }

    fn description() -> String {
        "a number from -360 to 360".into()
    }

    fn limits() -> Value {
        json!({ "minimum": -360, "maximum": 360 })
    }
}

#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "LeavingWord")]
enum WallLossWord {
    #[default]
    Latched,
    Range,
    Level,
}

#[derive(Debug, Clone, Copy, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
#[schemars(rename = "TurningWord")]
enum TurnModeWord {
    #[default]
    AboutAWheel,
    OnTheSpotWhereBlocked,
}

#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum MoversWord {
    /// It stands until that is gone, for 10 s at most.
    #[default]
    GiveWay,
    /// It takes them for walls, as the slides do.
    Walls,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NavigatorSection {
    /// Distance at which a wall is close.
    near_m: Option<f64>,
    /// Distance at which a wall is far.
    far_m: Option<f64>,
    /// Distance at which a wall is lost.
    lost_m: Option<f64>,
    /// Sector of the laser that looks at the wall.
    sector_deg: Option<[Number<DegreesRangeRule>; 2]>,
    /// Rule by which a wall is left.
    leaving: WallLossWord,
    /// Whether walls are left at all.
    leave_rule: Option<bool>,
    /// Way to turn.
    turning: TurnModeWord,
    /// The answer to a body that moves ahead.
    movers: MoversWord,
    /// Number of beams of the laser.
    beams: Option<usize>,
    /// Length of the beams.
    range_m: Option<RobotSize>,
    /// Field of view of the laser.
    field_deg: Option<f64>,
    /// Standard deviation of its distances.
    noise_m: Option<f64>,
    /// Distance between the wheels.
    wheelbase_m: Option<RobotSize>,
    /// Place to go to; the end of the corridor by default.
    target_m: Option<Point<2>>,
    /// Distance at which the target counts as reached.
    tolerance_m: Option<Number<PositiveRule>>,
    /// Distance from which the target is seen.
    detects_from_m: Option<Number<PositiveRule>>,
    /// Whether walls hide the target.
    needs_line_of_sight: bool,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RobotsSection {
    radius_m: Option<RobotSize>,
    pub(super) margin_m: Option<f64>,
    /// Distance between the wheels.
    wheelbase_m: Option<RobotSize>,
    wheel_speed_m_s: Option<RobotSize>,
    sensors_m: Option<RobotSize>,
    lag_limit_m: Option<Number<PositiveRule>>,
    gain_per_s: Option<RobotSize>,
    /// Turn rate per angle to the way.
    turn_gain_per_s: Option<RobotSize>,
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Returns a navigator that drives at `speed_m_s`.
    pub(super) fn navigator(
        &self,
        section: Option<&Spanned<NavigatorSection>>,
        speed_m_s: f64,
    ) -> Result<Navigator, InputError> {
        let Some(section) = section else {
            let s = NavigatorSection::default();
            return Ok(Navigator {
                leader: s.leader(speed_m_s)?,
                drive: s.differential_drive(speed_m_s)?,
                goal: self.goal(&s)?,
            });
        };
        self.check_target_keys(section)?;
        let s = section.get_ref();
        let leader = s.leader(speed_m_s);
        let leader = leader.map_err(|error| self.source.error_from(section.span(), &error))?;
        let drive = s.differential_drive(speed_m_s);
        let drive = drive.map_err(|error| self.source.error_from(section.span(), &error))?;
        Ok(Navigator { leader, drive, goal: self.goal(s)? })
    }

    /// Refuses keys about a target where there is none.
    fn check_target_keys(&self, section: &Spanned<NavigatorSection>) -> Result<(), InputError> {
        let s = section.get_ref();
        let seeks = s.target_m.is_some();
        let keys = [
            ("tolerance_m", s.tolerance_m.is_some(), seeks),
            ("detects_from_m", s.detects_from_m.is_some(), seeks),
            ("needs_line_of_sight", s.needs_line_of_sight, seeks),
        ];
        self.source.refuse_unused_keys(section.span(), &keys, "without target_m")
    }

    /// Returns the target, or the end of the scenario's corridor.
    fn goal(&self, s: &NavigatorSection) -> Result<Option<NavigationGoal>, InputError> {
        if let Some(at) = s.target_m {
            let tolerance_m = s.tolerance_m.map_or(DEFAULT_TOLERANCE_M, f64::from);
            return Ok(Some(NavigationGoal::Target { at: at.get(), tolerance_m }));
        }
        let middle = self.corridor_center_line(LINE_STEP_M)?;
        Ok(middle.map(|(line, width_m)| NavigationGoal::EndOf { line, width_m }))
    }

    /// Returns the robots of a swarm with a leader that drives at `speed_m_s`.
    pub(super) fn compile_robots(
        &self,
        section: &Spanned<RobotsSection>,
        speed_m_s: f64,
    ) -> Result<RobotSwarmConfig, InputError> {
        let robots = section.get_ref().robots(speed_m_s);
        robots.map_err(|error| self.source.error_from(section.span(), &error))
    }
}

impl NavigatorSection {
    fn differential_drive(&self, speed_m_s: f64) -> Result<DifferentialDrive, InputError> {
        let wheelbase_m = self.wheelbase_m.map_or(DEFAULT_WHEELBASE_M, f64::from);
        DifferentialDrive::new(wheelbase_m, speed_m_s)
    }

    fn leader(&self, speed_m_s: f64) -> Result<LeaderController, InputError> {
        let usual = LeaderController::new(speed_m_s)?;
        let laser = Laser::new(
            self.beams.unwrap_or(DEFAULT_BEAMS),
            self.range_m.map_or(usual.laser.range_m(), f64::from),
            // Half of the field of view lies on each side.
            self.field_deg.map_or(PI, |deg| 0.5 * deg.to_radians()),
            self.noise_m.unwrap_or(0.0),
        )?;
        let sector_rad = match self.sector_deg {
            Some(ends) => ends.map(|deg| f64::from(deg).to_radians()),
            None => usual.sector_rad,
        };
        let leader = LeaderController {
            laser,
            sector_rad,
            speed_m_s,
            near_m: self.near_m.unwrap_or(usual.near_m),
            far_m: self.far_m.unwrap_or(usual.far_m),
            lost_m: self.lost_m.unwrap_or(usual.lost_m),
            leaving: match self.leaving {
                WallLossWord::Latched => WallLossCriterion::Latched,
                WallLossWord::Range => WallLossCriterion::Range,
                WallLossWord::Level => WallLossCriterion::Level,
            },
            leave_rule: self.leave_rule.unwrap_or(true).then(WallLeaveRule::default),
            target_sense: TargetDetector {
                range_m: self.detects_from_m.map_or(f64::INFINITY, f64::from),
                needs_line_of_sight: self.needs_line_of_sight,
            },
            turning: match self.turning {
                TurnModeWord::AboutAWheel => TurnMode::AboutAWheel,
                TurnModeWord::OnTheSpotWhereBlocked => TurnMode::OnTheSpotWhereBlocked,
            },
            gives_way: self.movers == MoversWord::GiveWay,
        };
        leader.check()?;
        Ok(leader)
    }
}

impl RobotsSection {
    fn robots(&self, speed_m_s: f64) -> Result<RobotSwarmConfig, InputError> {
        let wheel_m_s = self.wheel_speed_m_s.map_or(WHEEL_SPEED_FACTOR * speed_m_s, f64::from);
        let wheelbase_m = self.wheelbase_m.map_or(DEFAULT_WHEELBASE_M, f64::from);
        let drive = DifferentialDrive::new(wheelbase_m, wheel_m_s)?;
        let mut follower = Follower::new(drive, self.radius_m())?;
        follower.gain_per_s = self.gain_per_s.map_or(follower.gain_per_s, f64::from);
        follower.turn_gain_per_s = self.turn_gain_per_s.map_or(follower.turn_gain_per_s, f64::from);
        follower.ring.range_m = self.sensors_m.map_or(follower.ring.range_m, f64::from);
        Ok(RobotSwarmConfig {
            follower,
            lag_limit_m: self.lag_limit_m.map_or(DEFAULT_LAG_LIMIT_M, f64::from),
        })
    }

    pub(super) fn radius_m(&self) -> f64 {
        self.radius_m.map_or(DEFAULT_RADIUS_M, f64::from)
    }
}
