//! How accurate the positions and velocities are that airplanes report, and how far they may be off: one by one, by the
//! categories of ADS-B.
//!
//! NACp, the navigation accuracy category for position, states a bound on the estimated position uncertainty: a radius
//! within which a reported position is with a probability of 95 %. NIC, the navigation integrity category, states a
//! containment radius, beyond which it is not believed to be. Both are those of RTCA DO-260B (EUROCAE ED-102A), NIC
//! without its supplements. 14 CFR 91.227 asks for NACp 8 and NIC 7 at least.
//!
//! NACv, the navigation accuracy category for velocity, states a bound on the horizontal velocity error in the same way, from
//! 1 to 4.
//!
//! Here errors are normal, with the standard deviation in each coordinate by which 95 % of positions are within the
//! radius of NACp, or velocities within that of NACv; and the shield allows for errors up to the radius of NIC. Larger ones are reported.

use super::compile::Compiler;
use crate::flight_plan::AirplaneSection;
use crate::settings::{SurveillanceCategory, VelocityCategory};
use sidestep_scenario::Spanned;

/// A nautical mile in meters.
const NM_M: f64 = 1852.0;
/// The estimated position uncertainty of each NACp from 1 on, in meters.
const UNCERTAINTIES_M: [f64; 11] = [
    10.0 * NM_M,
    4.0 * NM_M,
    2.0 * NM_M,
    NM_M,
    0.5 * NM_M,
    0.3 * NM_M,
    0.1 * NM_M,
    0.05 * NM_M,
    30.0,
    10.0,
    3.0,
];
/// The radius of containment of each NIC from 1 on, in meters.
const CONTAINMENT_M: [f64; 11] = [
    20.0 * NM_M,
    8.0 * NM_M,
    4.0 * NM_M,
    2.0 * NM_M,
    NM_M,
    0.6 * NM_M,
    0.2 * NM_M,
    0.1 * NM_M,
    75.0,
    25.0,
    7.5,
];
/// The bound on the horizontal velocity error of each NACv from 1 on, in meters per second.
const VELOCITY_ERRORS_M_S: [f64; 4] = [10.0, 3.0, 1.0, 0.3];
/// Standard deviations of a coordinate in the radius within which 95 % of positions are, of two normal coordinates: the
/// root of -2 ln 0.05.
const DEVIATIONS_OF_95_PERCENT: f64 = 2.447_746_830_680_816;

/// The errors of reported positions, by airplane.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PositionErrors {
    /// Standard deviation of each coordinate, in meters.
    pub(super) noise_m: Vec<f64>,
    /// Bound for which the shield allows, in meters.
    pub(super) bound_m: Vec<f64>,
}

/// The errors of the reported positions of one airplane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PositionError {
    pub(super) noise_m: f64,
    pub(super) bound_m: f64,
}

impl Compiler<'_> {
    /// Returns the errors of all airplanes, of which the last ones are those of the file.
    pub(super) fn position_errors(&self, airplanes: usize) -> PositionErrors {
        let sections = &self.file.airplanes.0;
        let generated = airplanes.saturating_sub(sections.len());
        let common = std::iter::repeat_n(None, generated);
        let mut errors = PositionErrors::default();
        for own in common.chain(sections.iter().map(Some)) {
            let PositionError { noise_m, bound_m } = self.position_error(own);
            errors.noise_m.push(noise_m);
            errors.bound_m.push(bound_m);
        }
        errors
    }

    /// Returns the errors of an airplane of the file, or of the generated ones: by its own categories, then those of all,
    /// and then the scenario's standard deviation.
    pub(super) fn position_error(&self, own: Option<&Spanned<AirplaneSection>>) -> PositionError {
        let own = own.map(Spanned::get_ref);
        let common = self.file.airplane.as_ref();
        let nac_p = own.and_then(|own| own.nac_p).or(common.and_then(|common| common.nac_p));
        let nic = own.and_then(|own| own.nic).or(common.and_then(|common| common.nic));
        let radius_m = |radii_m: &[f64; 11], category: SurveillanceCategory| {
            let place = category.get() as usize - 1;
            radii_m[place]
        };
        let noise_m = match nac_p {
            Some(nac_p) => radius_m(&UNCERTAINTIES_M, nac_p) / DEVIATIONS_OF_95_PERCENT,
            None => self.position_noise_m(),
        };
        let bound_m = match nic {
            Some(nic) => radius_m(&CONTAINMENT_M, nic),
            None => self.error_sigmas() * noise_m,
        };
        PositionError { noise_m, bound_m }
    }

    /// Returns the standard deviations of the coordinates of the velocities that airplanes report, of which the last are
    /// those of the file: by their own categories, or by that of all.
    pub(super) fn velocity_noises_m_s(&self, airplanes: usize) -> Vec<f64> {
        let sections = &self.file.airplanes.0;
        let generated = airplanes.saturating_sub(sections.len());
        let common = self.file.airplane.as_ref().and_then(|common| common.nac_v);
        let own = sections.iter().map(|section| section.get_ref().nac_v.or(common));
        let categories = std::iter::repeat_n(common, generated).chain(own);
        let noise_m_s = |category: VelocityCategory| {
            let place = category.get() as usize - 1;
            VELOCITY_ERRORS_M_S[place] / DEVIATIONS_OF_95_PERCENT
        };
        categories.map(|category| category.map_or(0.0, noise_m_s)).collect()
    }
}

#[cfg(test)]
mod tests {
    use crate::shield::guarantee_tests::lost_and_named;
    use crate::{AirspaceRun, airspace_run};
    use sidestep_kernel::Simulation;
    use sidestep_scenario::Source;

    fn run(airspace: &str, model: &str, airplanes: &str) -> AirspaceRun {
        let text = format!(
            "format = 1\nworld = \"airspace\"\nseed = 3\n[airspace]\n{airspace}\n[airplane]\n{model}\n{airplanes}"
        );
        airspace_run(&Source::new("s", text, ""), 1).expect("a scenario")
    }

    const CONFLICT: &str = "[airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

    #[test]
    fn positions_are_seen_as_accurately_as_the_category_of_each_airplane_says() {
        let flight = |more: &str| {
            format!(
                "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9e6, 0]]\n{more}\n"
            )
        };
        let airplanes = flight("nac_p = 8") + &flight("nac_p = 10\nnic = 10") + &flight("");
        let run = run("position_noise_m = 4.0\nerror_sigmas = 3.0", "nic = 9", &airplanes);
        let world = run.world();
        let errors = [0, 1, 2].map(|i| (world.position_noise_m(i), world.position_bound_m(i)));
        assert!(
            (errors[0].0 - 37.83).abs() < 0.01 && (errors[1].0 - 4.085).abs() < 0.001,
            "{errors:?}"
        );
        assert_eq!(errors[2].0, 4.0);
        assert_eq!(errors.map(|(_, bound_m)| bound_m), [75.0, 25.0, 75.0]);
        // 95 % of the positions that all see are within the radius of the category.
        for (slot, radius_m) in [(0, 92.6), (1, 10.0)] {
            let pose = world.airplanes[slot as usize].start;
            let within = (0..4000).filter(|&now| {
                let seen = crate::perceive::observed_pose(world, slot, now, pose);
                crate::flight::distance_m(seen.at, pose.at) < radius_m
            });
            let share = within.count() as f64 / 4000.0;
            assert!((share - 0.95).abs() < 0.015, "{slot}: {share}");
        }
    }

    #[test]
    fn within_the_radius_of_containment_nobody_loses_separation() {
        for model in ["nac_p = 9\nnic = 8", "nac_p = 8\nnic = 7", "nac_p = 9"] {
            for method in ["none", "mvp", "pc"] {
                let mut run =
                    run(&format!("method = \"{method}\"\nmax_rounds = 20"), model, CONFLICT);
                run.advance(400);
                let (lost, named) = lost_and_named(&run);
                assert!(
                    lost.is_empty() && named.is_empty(),
                    "{model} {method}: {lost:?} {named:?}"
                );
                assert_eq!(run.metrics().arrived, 6, "{model} {method}");
            }
        }
    }

    #[test]
    fn an_airplane_that_is_farther_off_than_its_radius_of_containment_is_named() {
        let mut run = run("method = \"none\"", "nac_p = 7\nnic = 9", CONFLICT);
        run.advance(100);
        assert_eq!(run.metrics().beyond_bound.len(), 6);
        let (lost, named) = lost_and_named(&run);
        assert!(lost.is_subset(&named), "{lost:?} {named:?}");
    }

    #[test]
    fn an_intruder_that_is_farther_off_than_its_radius_of_containment_is_named() {
        let airplanes = "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9000, 0]]\n\
                         [[airplanes]]\nat_m = [9000, 200]\nheading_deg = 180\nway_points_m = [[0, 200]]\n\
                         non_cooperative = true\nnac_p = 7\nnic = 9\n";
        let mut run = run("method = \"mvp\"", "", airplanes);
        run.advance(60);
        let beyond: Vec<_> = run.metrics().beyond_bound.iter().map(|one| one.airplane).collect();
        assert_eq!(beyond, [1]);
        let (lost, named) = lost_and_named(&run);
        assert!(lost.is_subset(&named), "{lost:?} {named:?}");
    }

    #[test]
    fn velocities_are_reported_as_accurately_as_the_category_of_each_airplane_says() {
        let flight = |more: &str| {
            format!(
                "[[airplanes]]\nat_m = [0, 0]\nheading_deg = 0\nway_points_m = [[9e6, 0]]\n{more}\n"
            )
        };
        let airplanes =
            flight("nac_v = 1") + &flight("nac_v = 3") + &flight("nac_v = 4") + &flight("");
        let run = run("surveillance = {}", "nac_v = 2", &airplanes);
        let world = run.world();
        // 95 % of two normal coordinates are within the bound of the category.
        for (slot, bound_m_s) in [(0, 10.0), (1, 1.0), (2, 0.3), (3, 3.0)] {
            let noise_m_s: f64 = world.velocity_noise_m_s(slot);
            let deviations = bound_m_s / noise_m_s;
            let share = 1.0 - sidestep_kernel::math::exp(-0.5 * deviations * deviations);
            assert!((share - 0.95).abs() < 1e-12, "{slot}: {share}");
        }
        let unknown = self::run("", "", &flight(""));
        assert_eq!(unknown.world().velocity_noise_m_s(0), 0.0);
    }
}
