//! Initiators on wheels, and the robots that follow them.

use super::super::formation::Robots;
use super::super::geometry::Point;
use super::super::navigate::{Goal, Navigator};
use super::super::swarm::drive::Drive;
use super::super::swarm::follower::Follower;
use super::super::swarm::laser::Laser;
use super::super::swarm::leader::{Leader, LeaveRule, Leaving, TargetSense, Turning};
use super::{Compiler, MOST};
use serde::Deserialize;
use sidestep_kernel::InputError;
use std::f64::consts::PI;
use std::ops::Range;
use toml::Spanned;

/// A point of a corridor's middle so often.
const LINE_STEP_M: f64 = 0.1;
/// A leader waits for a robot that is so late, unless it is said, meters.
const LAG_LIMIT_M: f64 = 0.15;
/// Distance of the wheels of a robot, unless it is said.
const WHEELBASE_M: f64 = 0.4;

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum LeavingWord {
    #[default]
    Latched,
    Range,
    Level,
}

#[derive(Debug, Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum TurningWord {
    #[default]
    AboutAWheel,
    OnTheSpotWhereBlocked,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct NavigatorSection {
    near_m: Option<f64>,
    far_m: Option<f64>,
    lost_m: Option<f64>,
    sector_deg: Option<[f64; 2]>,
    leaving: LeavingWord,
    leave_rule: Option<bool>,
    turning: TurningWord,
    beams: Option<usize>,
    range_m: Option<f64>,
    field_deg: Option<f64>,
    noise_m: Option<f64>,
    wheelbase_m: Option<f64>,
    target_m: Option<Point<2>>,
    tolerance_m: Option<f64>,
    detects_from_m: Option<f64>,
    needs_line_of_sight: bool,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RobotsSection {
    pub(super) radius_m: Option<f64>,
    pub(super) margin_m: Option<f64>,
    wheelbase_m: Option<f64>,
    wheel_speed_m_s: Option<f64>,
    sensors_m: Option<f64>,
    lag_limit_m: Option<f64>,
    gain_per_s: Option<f64>,
    turn_gain_per_s: Option<f64>,
}

impl Compiler<'_> {
    /// A navigator that drives with `speed_m_s`.
    pub(super) fn navigator(
        &self,
        section: Option<&Spanned<NavigatorSection>>,
        speed_m_s: f64,
    ) -> Result<Navigator, InputError> {
        let preset = NavigatorSection::default();
        let (s, at) = match section {
            Some(section) => (section.get_ref(), Some(section.span())),
            None => (&preset, None),
        };
        let told = |error: InputError| match at.clone() {
            Some(at) => self.at(at, &error),
            None => error,
        };
        let numbers = [("range_m", s.range_m), ("wheelbase_m", s.wheelbase_m)];
        self.has_measures(at.clone(), &numbers)?;
        let usual = Leader::new(speed_m_s).map_err(told)?;
        let laser = Laser::new(
            s.beams.unwrap_or(180),
            s.range_m.unwrap_or(usual.laser.range_m()),
            s.field_deg.map_or(PI, |deg| 0.5 * deg.to_radians()),
            s.noise_m.unwrap_or(0.0),
        );
        let leader = Leader {
            laser: laser.map_err(told)?,
            sector_rad: s.sector_deg.map_or(usual.sector_rad, |deg| deg.map(f64::to_radians)),
            speed_m_s,
            near_m: s.near_m.unwrap_or(usual.near_m),
            far_m: s.far_m.unwrap_or(usual.far_m),
            lost_m: s.lost_m.unwrap_or(usual.lost_m),
            leaving: match s.leaving {
                LeavingWord::Latched => Leaving::Latched,
                LeavingWord::Range => Leaving::Range,
                LeavingWord::Level => Leaving::Level,
            },
            leave_rule: s.leave_rule.unwrap_or(true).then(LeaveRule::default),
            target_sense: TargetSense {
                range_m: s.detects_from_m.unwrap_or(f64::INFINITY),
                needs_line_of_sight: s.needs_line_of_sight,
            },
            turning: match s.turning {
                TurningWord::AboutAWheel => Turning::AboutAWheel,
                TurningWord::OnTheSpotWhereBlocked => Turning::OnTheSpotWhereBlocked,
            },
        };
        leader.check().map_err(told)?;
        let drive = Drive::new(s.wheelbase_m.unwrap_or(WHEELBASE_M), speed_m_s).map_err(told)?;
        Ok(Navigator { leader, drive, goal: self.goal(s)? })
    }

    /// Refuses numbers that no robot has: their squares and quotients would be none at all.
    fn has_measures(
        &self,
        at: Option<Range<usize>>,
        numbers: &[(&str, Option<f64>)],
    ) -> Result<(), InputError> {
        let is_wrong = |given: &Option<f64>| given.is_some_and(|x| !(1e-6..=MOST).contains(&x));
        match numbers.iter().find(|(_, given)| is_wrong(given)) {
            None => Ok(()),
            Some((key, given)) => {
                let cause = format!("{key} = {}", given.unwrap_or_default());
                Err(self.error(at, cause, "give a number from 1e-6 to 1e6"))
            }
        }
    }

    /// The target, or the end of the corridor that the scenario has.
    fn goal(&self, s: &NavigatorSection) -> Result<Option<Goal>, InputError> {
        if let Some(at) = s.target_m {
            let tolerance_m = s.tolerance_m.unwrap_or(0.5);
            if !(at.iter().all(|x| x.is_finite()) && tolerance_m > 0.0) {
                let cause = format!("target_m = {at:?}, tolerance_m = {tolerance_m}");
                return Err(self.error(None, cause, "give a finite place and a tolerance above 0"));
            }
            return Ok(Some(Goal::Target { at, tolerance_m }));
        }
        let line = self.corridor_line(LINE_STEP_M)?;
        Ok(line.map(Goal::EndOf))
    }

    /// How the robots of a swarm behave whose leader drives with `speed_m_s`.
    pub(super) fn robots(
        &self,
        section: &Spanned<RobotsSection>,
        speed_m_s: f64,
    ) -> Result<Robots, InputError> {
        let s = section.get_ref();
        let told = |error: InputError| self.at(section.span(), &error);
        let numbers = [
            ("radius_m", s.radius_m),
            ("wheelbase_m", s.wheelbase_m),
            ("wheel_speed_m_s", s.wheel_speed_m_s),
            ("sensors_m", s.sensors_m),
            ("gain_per_s", s.gain_per_s),
            ("turn_gain_per_s", s.turn_gain_per_s),
        ];
        self.has_measures(Some(section.span()), &numbers)?;
        let wheel_m_s = s.wheel_speed_m_s.unwrap_or(1.2 * speed_m_s);
        let drive = Drive::new(s.wheelbase_m.unwrap_or(WHEELBASE_M), wheel_m_s).map_err(told)?;
        let mut follower = Follower::new(drive, self.robot_radius_m(s)).map_err(told)?;
        let lag_limit_m = s.lag_limit_m.unwrap_or(LAG_LIMIT_M);
        if lag_limit_m.is_nan() || lag_limit_m <= 0.0 {
            let cause = format!("lag_limit_m = {lag_limit_m}");
            return Err(self.error(Some(section.span()), cause, "give meters above 0, or inf"));
        }
        follower.gain_per_s = s.gain_per_s.unwrap_or(follower.gain_per_s);
        follower.turn_gain_per_s = s.turn_gain_per_s.unwrap_or(follower.turn_gain_per_s);
        follower.ring.range_m = s.sensors_m.unwrap_or(follower.ring.range_m);
        Ok(Robots { follower, lag_limit_m })
    }

    /// Radius of a robot's body.
    pub(super) fn robot_radius_m(&self, s: &RobotsSection) -> f64 {
        s.radius_m.unwrap_or(0.25)
    }
}
