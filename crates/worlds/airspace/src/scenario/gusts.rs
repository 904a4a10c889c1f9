//! The section of gusts, and what cannot be flown in them.

use super::compile::Compiler;
use crate::flight::{AirplaneStart, Gusts, MAX_CORRELATION_CYCLES, Surface, TimeDiscretization};
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::InputError;
use sidestep_scenario::{Closed, LeftOpen, Number};

/// The airplanes that are in one gust.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum GustScope {
    /// All are in the same.
    #[default]
    All,
    /// Each is in one of its own.
    Each,
}

/// A wind that no airplane knows.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct GustsSection {
    /// Standard deviation in each direction.
    noise_m_s: Number<Closed<0, 1000>>,
    /// Time in which a gust changes into another one.
    correlation_s: Number<LeftOpen<0, 1_000_000>>,
    /// Who is in the same gust.
    #[serde(default)]
    of: GustScope,
}

impl Compiler<'_> {
    /// Returns the gusts, if the scenario has some.
    ///
    /// # Errors
    /// When the shield or the agents could not bear them.
    pub(super) fn gusts(
        &self,
        timing: &TimeDiscretization,
        airplanes: &[AirplaneStart],
    ) -> Result<Option<Gusts>, InputError> {
        let Some(given) = &self.file.airspace.gusts else { return Ok(None) };
        let section = given.get_ref();
        let error = |cause: &str, remedy: &str| Err(self.source.error(given.span(), cause, remedy));
        let max_correlation_s = MAX_CORRELATION_CYCLES * timing.dt_s;
        if section.correlation_s.get() > max_correlation_s {
            let cause = format!(
                "gusts of {} s, with a dt_s of {}",
                section.correlation_s.get(),
                timing.dt_s
            );
            let remedy =
                format!("give a correlation_s up to {max_correlation_s}, or a longer dt_s");
            return error(&cause, &remedy);
        }
        if self.file.airspace.network.is_some() {
            let cause = "gusts over an unreliable network, where airplanes that are not heard are believed on orbits that \
                         drift with the known wind";
            return error(cause, "leave out gusts or [airspace.network]");
        }
        let is_shielded = self.file.airspace.shield.0;
        if is_shielded && section.of == GustScope::Each {
            let cause = "gusts of each airplane\u{27}s own under the shield: they drive stored orbits together, and airplanes of \
                         constant speed cannot hold their places on these";
            return error(cause, "give of = \"all\", or set airspace.shield = \"off\"");
        }
        if is_shielded && self.surface()? == Surface::Earth {
            let cause =
                "gusts on the earth under the shield: east is another direction for each airplane";
            return error(cause, "leave out gusts, or set airspace.shield = \"off\"");
        }
        if is_shielded && airplanes.iter().any(|airplane| airplane.track.is_some()) {
            let cause = "gusts under the shield, beside a track: gusts move all airplanes but those on tracks";
            return error(cause, "leave out gusts or tracks, or set airspace.shield = \"off\"");
        }
        let is_shared = section.of == GustScope::All;
        let noise_m_s = section.noise_m_s.get();
        Ok(Some(Gusts::new(noise_m_s, section.correlation_s.get(), timing.dt_s, is_shared)))
    }
}

#[cfg(test)]
mod tests {
    use crate::shield::guarantee_tests::lost_and_named;
    use crate::{AirspaceRun, airspace_run};
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    fn run(airspace: &str, airplanes: &str) -> Result<AirspaceRun, String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 2\n[airspace]\nmax_rounds = 20\n{airspace}\n{airplanes}"
        );
        airspace_run(&Source::new("gusts", text, ""), 1).map_err(|error| error.to_string())
    }

    const CONFLICT: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";
    const ALL: &str = "gusts = { noise_m_s = 6.0, correlation_s = 40.0 }";
    const EACH: &str = "gusts = { noise_m_s = 6.0, correlation_s = 40.0, of = \"each\" }";

    #[test]
    fn in_a_gust_that_all_share_nobody_loses_separation_under_the_shield() {
        for more in
            ["method = \"none\"", "method = \"mvp\"", "method = \"pc\"", "heading_noise_deg = 0.5"]
        {
            let mut run = run(&format!("{more}\n{ALL}"), CONFLICT).expect("right");
            let mut calm = self::run(more, CONFLICT).expect("right");
            run.advance(300);
            calm.advance(300);
            let (lost, named) = lost_and_named(&run);
            assert!(lost.is_empty() && named.is_empty(), "{more}: {lost:?} {named:?}");
            assert_eq!(run.metrics().arrived, 6, "{more}");
            assert_ne!(run.digest(), calm.digest());
        }
    }

    #[test]
    fn a_gust_moves_an_airplane_by_its_velocity_times_the_time() {
        let alone = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n";
        for gusts in [ALL, EACH] {
            let airspace = format!("method = \"none\"\nshield = \"off\"\n{gusts}");
            let mut run = run(&airspace, alone).expect("right");
            let [east_m_s, north_m_s] = run.world().flown_air(0, 0, ([0.0; 2], 0.0)).wind_m_s;
            run.advance(1);
            let [x, y] = run.state().airplanes[0].pose().at;
            assert!(
                (x - 5.0 * (35.0 + east_m_s)).abs() < 1e-9 && (y - 5.0 * north_m_s).abs() < 1e-9
            );
        }
    }

    #[test]
    fn every_deployment_flies_through_gusts_by_the_same_bits() {
        let digest = |deployment: &str| {
            let airspace = format!("deployment = \"{deployment}\"\n{ALL}");
            let mut run = run(&airspace, CONFLICT).expect("right");
            run.advance(20);
            run.digest()
        };
        for deployment in ["team", "compact-team", "replica-team", "pim", "hierarchical-pim"] {
            assert_eq!(digest(deployment), digest("direct"), "{deployment}");
        }
    }

    #[test]
    fn gusts_under_which_the_shield_could_promise_nothing_are_refused() {
        let track = "[[airplanes]]\ntrack = [[0, 0, 0, 0], [100, 3000, 0, 0]]\n";
        let earth =
            "[[airplanes]]\nat_deg = [50, 14]\nheading_deg = 0\nway_points_deg = [[50, 15]]\n";
        let network = format!("deployment = \"team\"\n{ALL}");
        let lossy = format!("{CONFLICT}[airspace.network]\n");
        let slow = "gusts = { noise_m_s = 1.0, correlation_s = 900.0 }";
        for (airspace, airplanes, cause) in [
            (EACH, CONFLICT, "drive stored orbits together"),
            (ALL, track, "beside a track"),
            (ALL, earth, "on the earth"),
            (network.as_str(), lossy.as_str(), "unreliable network"),
            (slow, CONFLICT, "gusts of 900 s"),
        ] {
            let error = run(airspace, airplanes).map(|_| ()).expect_err(cause);
            assert!(error.contains(cause) && error.contains("help: "), "{error}");
        }
        let off = format!("shield = \"off\"\n{EACH}");
        for airplanes in [CONFLICT, track, earth] {
            assert!(run(&off, airplanes).is_ok());
        }
    }
}
