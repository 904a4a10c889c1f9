//! The section of surveillance, and what cannot be flown by it.

use super::compile::Compiler;
use crate::flight::CLIMB_M_S;
use crate::flight::{Point, TimeDiscretization};
use crate::method::MethodKind;
use crate::settings::SurveillanceSettings;
use crate::world::AirspaceWorld;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::InputError;
use sidestep_kernel::distr::Bernoulli;
use sidestep_kernel::geometry::{norm, sub};
use sidestep_kernel::{Cycle, EntitySlot};
use sidestep_scenario::{AboveZero, Closed, LeftOpen, Number};

/// Seconds after which a track is dropped, unless the scenario gives a number.
const DEFAULT_COAST_S: f64 = 10.0;
/// Most seconds for which a track may coast.
const MAX_COAST_S: i64 = 3600;
/// Reports that a track may miss in a row before it is dropped, unless the scenario says otherwise.
const DEFAULT_MISSED_REPORTS: f64 = 3.0;
/// Largest number of past states that are kept of each airplane: the memory of a run grows with it.
const MAX_KEPT_STATES: usize = 10_000;
/// Fraction of a step by which a time may miss a whole number of steps because decimal fractions are rounded.
const ROUNDING: f64 = 1e-9;

/// How airplanes see those that do not tell them where they are: by reports that each of them receives or misses.
///
/// Airplanes of method pc and all agents tell the others of their group their states, and the shield is a link of its own:
/// surveillance changes what these know of non-cooperative airplanes alone.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct SurveillanceSection {
    /// Time between two reports of an airplane, a multiple of dtau_s, which is the default.
    report_interval_s: Option<Number<LeftOpen<0, 3600>>>,
    /// Time from the measurement of a report to its use, rounded up to steps of dtau_s; trackers move the airplane on by it.
    latency_s: Option<Number<Closed<0, 3600>>>,
    /// Chance that an airplane receives a report of another one.
    reception_probability: Option<Number<LeftOpen<0, 1>>>,
    /// Distance beyond which none is received.
    range_m: Option<Number<AboveZero>>,
    /// Age of its last report above which a track is dropped.
    coast_s: Option<Number<LeftOpen<0, MAX_COAST_S>>>,
    /// Standard deviation of the error of each observer's sensor in each coordinate of a position, beside the error of the
    /// report.
    position_noise_m: Option<Number<Closed<0, 1_000_000>>>,
    /// The same for each coordinate of the velocity over the ground.
    velocity_noise_m_s: Option<Number<Closed<0, 1000>>>,
}

impl SurveillanceSection {
    /// Returns whether the time is given for which tracks coast.
    pub(super) fn has_coast(&self) -> bool {
        self.coast_s.is_some()
    }

    /// Returns whether sensors err in positions.
    pub(super) fn has_position_noise(&self) -> bool {
        self.position_noise_m.is_some_and(|noise_m| noise_m.get() > 0.0)
    }
}

impl Compiler<'_> {
    /// Returns how airplanes receive each other's reports, if the scenario says so.
    ///
    /// # Errors
    /// When times do not fit each other, or nobody could agree on what is seen.
    pub(super) fn surveillance(
        &self,
        timing: &TimeDiscretization,
    ) -> Result<Option<SurveillanceSettings>, InputError> {
        let Some(given) = &self.file.airspace.surveillance else { return Ok(None) };
        let section = given.get_ref();
        let error = |cause: &str, remedy: &str| Err(self.source.error(given.span(), cause, remedy));
        if self.file.airspace.network.is_some() {
            let cause = "surveillance by each airplane, over an unreliable network: those that do not hear each other \
                         have to see the same";
            return error(cause, "leave out [airspace.surveillance] or [airspace.network]");
        }
        let dtau_s = timing.dtau_s;
        let interval_s = section.report_interval_s.map_or(dtau_s, f64::from);
        let interval = interval_s / dtau_s;
        if (interval - interval.round()).abs() > ROUNDING * interval || interval < 0.5 {
            let step =
                if self.file.airspace.look_every_s.is_some() { "look_every_s" } else { "dtau_s" };
            let cause =
                format!("report_interval_s = {interval_s} is no multiple of {step} = {dtau_s}");
            let remedy = format!("give {dtau_s} or a multiple of it, or a smaller {step}");
            return error(&cause, &remedy);
        }
        let latency_s = section.latency_s.map_or(0.0, f64::from);
        let latency_steps = (latency_s / dtau_s - ROUNDING).ceil().max(0.0);
        // The oldest report of a track that misses none.
        let usual_s = latency_steps * dtau_s + interval_s;
        let missed_s = latency_steps * dtau_s + DEFAULT_MISSED_REPORTS * interval_s;
        let coast_s = section.coast_s.map_or(DEFAULT_COAST_S.max(missed_s), f64::from);
        let coast_steps = (coast_s / dtau_s + ROUNDING).floor();
        if coast_s < usual_s - ROUNDING {
            let remedy = if usual_s > MAX_COAST_S as f64 {
                "give a shorter latency_s or report_interval_s".to_owned()
            } else {
                format!("give a coast_s of {usual_s} or more")
            };
            let cause = format!(
                "coast_s = {coast_s}, and reports are up to {usual_s} s old: of latency_s in steps of {dtau_s} s, and \
                 report_interval_s"
            );
            return error(&cause, &remedy);
        }
        let position_noise_m = section.position_noise_m.map_or(0.0, f64::from);
        let settings = SurveillanceSettings {
            interval_steps: interval.round() as u64,
            latency_steps: latency_steps as u64,
            coast_steps: coast_steps as u64,
            reception: Bernoulli::new(section.reception_probability.map_or(1.0, f64::from)),
            range_m: section.range_m.map_or(f64::INFINITY, f64::from),
            position_noise_m,
            velocity_noise_m_s: section.velocity_noise_m_s.map_or(0.0, f64::from),
            position_bound_m: self.error_sigmas() * position_noise_m,
            max_wind_change_m_s: 0.0,
            max_drift_m_s: 0.0,
            commanded_climb_m_s: None,
        };
        let kept = settings.kept_states(timing.points_per_dt());
        if kept > MAX_KEPT_STATES {
            let cause = format!(
                "a coast_s of {coast_s} s, in steps of {dtau_s} s: {kept} states of each airplane"
            );
            // A decision looks a cycle farther back than tracks are kept.
            let max_coast_s = (MAX_KEPT_STATES - timing.points_per_dt()) as f64 * dtau_s;
            let remedy = if usual_s > max_coast_s {
                "give a shorter latency_s or report_interval_s, or a larger dtau_s".to_owned()
            } else {
                format!("give a coast_s of up to {max_coast_s}, or a larger dtau_s")
            };
            return error(&cause, &remedy);
        }
        Ok(Some(settings))
    }

    /// Completes the settings of surveillance by the rules that hold later, and refuses gusts in which the shield could not
    /// bound where a non-cooperative airplane is.
    pub(super) fn complete_surveillance(
        &self,
        world: &mut AirspaceWorld,
        later: &mut [(Cycle, AirspaceWorld)],
    ) -> Result<(), InputError> {
        let Some(given) = &self.file.airspace.surveillance else { return Ok(()) };
        let rules = || std::iter::once(&*world).chain(later.iter().map(|(_, world)| world));
        let has_non_cooperative = |world: &AirspaceWorld| {
            (0..world.airplanes.len())
                .any(|i| world.is_non_cooperative(i as EntitySlot, Cycle::MAX - 1))
        };
        if world.gusts.is_some() && rules().any(|rules| rules.shield && has_non_cooperative(rules))
        {
            let cause = "gusts under the shield, beside non-cooperative airplanes that are seen late: nobody knows how far a gust \
                         has carried them since";
            let remedy = "leave out gusts, [airspace.surveillance] or the non-cooperative airplanes, or set \
                          airspace.shield = \"off\"";
            return Err(self.source.error(given.span(), cause, remedy));
        }
        let winds_m_s: Vec<Point> = rules().map(|rules| rules.wind_m_s).collect();
        let mut max_change_m_s: f64 = 0.0;
        for (k, &wind_m_s) in winds_m_s.iter().enumerate() {
            for &other_m_s in &winds_m_s[..k] {
                max_change_m_s = max_change_m_s.max(norm(sub(wind_m_s, other_m_s)));
            }
        }
        // A report may be of a time when other rules held.
        let max_drift_m_s = rules().map(AirspaceWorld::max_drift_m_s).fold(0.0, f64::max);
        let commanded_climb_m_s = rules().filter_map(commanded_climb_m_s).reduce(f64::max);
        let all = std::iter::once(world).chain(later.iter_mut().map(|(_, world)| world));
        for settings in all.filter_map(|world| world.surveillance.as_mut()) {
            settings.max_wind_change_m_s = max_change_m_s;
            settings.max_drift_m_s = max_drift_m_s;
            settings.commanded_climb_m_s = commanded_climb_m_s;
        }
        Ok(())
    }
}

/// Returns the largest rate at which the method commands an airplane without limits to climb or descend; `None` if it
/// commands no levels.
fn commanded_climb_m_s(world: &AirspaceWorld) -> Option<f64> {
    world.command_kinds().levels.then_some(match &world.method {
        // Its rates are what the program likes.
        MethodKind::Own(_) => f64::INFINITY,
        _ => CLIMB_M_S,
    })
}

#[cfg(test)]
mod tests {
    use crate::flight::CLIMB_M_S;
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    fn compiled(airspace: &str, airplanes: &str) -> Result<CompiledAirspace, String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n{airplanes}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 3\n"
        );
        CompiledAirspace::new(&Source::new("s", text, "")).map_err(|error| error.to_string())
    }

    #[test]
    fn surveillance_that_cannot_be_flown_is_refused_with_a_remedy() {
        let silent = "[[airplanes]]\nat_m = [9000, 0]\nheading_deg = 0\nway_points_m = [[0, 0]]\n\
                      non_cooperative = true\n";
        let gusts = "surveillance = {}\ngusts = { noise_m_s = 1.0, correlation_s = 60.0 }";
        for (airspace, airplanes, cause) in [
            ("surveillance = { report_interval_s = 1.5 }", "", "no multiple of dtau_s = 1"),
            ("surveillance = { report_interval_s = 0.2 }", "", "no multiple of dtau_s = 1"),
            (
                "method = \"mvp\"\nlook_every_s = 2.0\nsurveillance = { report_interval_s = 1.0 }",
                "",
                "no multiple of look_every_s = 2",
            ),
            (
                "surveillance = { latency_s = 4.2, coast_s = 5.5 }",
                "",
                "give a coast_s of 6 or more",
            ),
            (
                "dtau_s = 0.01\nsurveillance = { coast_s = 200.0 }",
                "",
                "give a coast_s of up to 95, or",
            ),
            (
                "dtau_s = 0.01\nsurveillance = { report_interval_s = 3600.0 }",
                "",
                "or a larger dtau_s",
            ),
            (
                "surveillance = { latency_s = 3000.0, report_interval_s = 1000.0, coast_s = 3600.0 }",
                "",
                "give a shorter latency_s",
            ),
            (
                "deployment = \"team\"\nsurveillance = {}",
                "[airspace.network]",
                "have to see the same",
            ),
            ("surveillance = { reception_probability = 0.0 }", "", "reception_probability"),
            (gusts, silent, "how far a gust"),
        ] {
            let error = compiled(airspace, airplanes).map(|_| ()).expect_err(cause);
            assert!(error.contains(cause) && error.contains("help: "), "{airspace}: {error}");
        }
        let longest = "dtau_s = 0.01\nsurveillance = { coast_s = 95.0 }";
        assert!(compiled(longest, "").is_ok(), "the remedy works");
        assert!(compiled(gusts, "").is_ok());
        assert!(compiled(&format!("shield = \"off\"\n{gusts}"), silent).is_ok());
    }

    #[test]
    fn a_track_coasts_over_three_reports_of_a_slow_radar() {
        let coast = |keys: &str| {
            let compiled = compiled(&format!("surveillance = {{ {keys} }}"), "").expect("right");
            compiled.world.surveillance.expect("given").coast_steps
        };
        assert_eq!(coast(""), 10);
        assert_eq!(coast("latency_s = 1.5, report_interval_s = 12.0"), 38);
        assert_eq!(coast("coast_s = 25.9"), 25);
    }

    /// A report may be of a time before the rules changed.
    #[test]
    fn bounds_on_tracks_are_those_of_all_rules() {
        let rules = "method = \"mvp\"\nmvp = { resolution = \"vertical\" }\nsurveillance = {}\n\
                     winds = [{ altitude_m = 0.0, wind_m_s = [0.0, 0.0] }, { altitude_m = 900.0, wind_m_s = [8.0, 0.0] }]\n\
                     changes = [{ at_s = 50.0, method = \"none\" }, { at_s = 60.0, wind_m_s = [4.0, 0.0] }]";
        let compiled = compiled(rules, "").expect("right");
        for world in compiled.world.all_rules() {
            let settings = world.surveillance.expect("given");
            assert_eq!(settings.commanded_climb_m_s, Some(CLIMB_M_S));
            assert_eq!(settings.max_drift_m_s, 4.0);
        }
    }

    #[test]
    fn another_seed_receives_other_reports_under_all_rules() {
        let changes = "changes = [{ at_s = 50.0, wind_m_s = [3.0, 4.0] }]\nsurveillance = {}";
        let compiled = compiled(changes, "").expect("right");
        let other = compiled.reseeded(9).expect("right");
        for world in other.world.all_rules() {
            assert_eq!(world.surveillance.expect("given").max_wind_change_m_s, 5.0);
            assert_eq!(world.streams, other.world.streams);
        }
    }
}
