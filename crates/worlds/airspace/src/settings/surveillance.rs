//! How airplanes receive each other's reports.

use sidestep_kernel::distr::Bernoulli;

/// How airplanes receive each other's reports. Times are in steps of `dtau`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurveillanceSettings {
    /// Steps between two reports of an airplane.
    pub interval_steps: u64,
    /// Steps after which a report can be used.
    pub latency_steps: u64,
    /// Age in steps above which a track is dropped.
    pub coast_steps: u64,
    /// The chance that an observer receives a report.
    pub reception: Bernoulli,
    /// Distance in meters beyond which none is received.
    pub range_m: f64,
    /// Standard deviation of the error of each observer's sensor in each coordinate of a position, in meters.
    pub position_noise_m: f64,
    /// Standard deviation of the error of each observer's sensor in each coordinate of a velocity, in meters per second.
    pub velocity_noise_m_s: f64,
    /// Bound on the error of a sensor's positions for which the shield allows, in meters.
    pub position_bound_m: f64,
    /// Largest difference of the winds of two rules of the scenario, in meters per second: 0 where the wind never changes.
    pub max_wind_change_m_s: f64,
    /// Largest speed of any air relative to the common one, by all rules of the scenario, in meters per second.
    pub max_drift_m_s: f64,
    /// Largest rate at which a method of any rule commands an airplane without limits to climb or descend, in meters per
    /// second; none where no method commands levels.
    pub commanded_climb_m_s: Option<f64>,
}

impl SurveillanceSettings {
    /// Returns the number of past states that have to be kept of each airplane, with so many steps in a cycle: the report
    /// of a track that is dropped in a cycle was recent enough in the cycle before.
    pub(crate) fn kept_states(&self, steps_per_cycle: usize) -> usize {
        self.coast_steps as usize + steps_per_cycle
    }
}
