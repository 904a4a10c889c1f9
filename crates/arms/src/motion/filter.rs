//! Reference postures, smoothed to joint values that keep to the rates of each joint.
//!
//! A driver of an arm accepts no step of speed or acceleration. The rules of the chain and its planner give a
//! *reference*: a posture for each cycle, each within the speeds of the joints from the one before, which may stop
//! or turn back at once. The joints follow it as the mean over a window of N cycles, of which the mean over M cycles
//! is taken again:
//!
//! ```text
//! u_k = (r_k + ... + r_{k-N+1}) / N          q_k = (u_k + ... + u_{k-M+1}) / M
//! ```
//!
//! Differences of means are means of differences, so with time step dt
//!
//! ```text
//! |q_k - q_{k-1}| / dt                       <= V               if all |r_k - r_{k-1}| <= V dt
//! |second difference of q| / dt^2            <= A               if all |(r_k - r_{k-1}) - (r_{k-N} - r_{k-N-1})| <= A
//! N dt^2
//! |third difference of q| / dt^3             <= 2 A / (M dt)    always
//! ```
//!
//! A reference that rests satisfies the second condition as long as V <= A N dt, so it may always stop. At constant
//! speed from rest to rest the result is the profile of seven segments of constant jerk, sampled. All joints share the
//! windows, so each posture is a weighted mean of recent references: inside the joints' ranges, at the reference once
//! that has rested for N + M - 2 cycles, and near the reference's path before.
//!
//! Source: Biagiotti and Melchiorri, "FIR filters for online trajectory planning with time- and frequency-domain
//! specifications", Control Engineering Practice 20, 2012.

use super::rates::JointRates;
use sidestep_kernel::InputError;
use std::collections::VecDeque;

/// Longest window in which speeds are smoothed, s: an arm follows its reference half of it later. Where a joint takes
/// longer to reach its highest speed, its reference is slower than that.
const MAX_SPEED_WINDOW_S: f64 = 0.5;
/// Longest window in which accelerations are smoothed, s; with a joint that needs more, its acceleration is lower.
const MAX_ACCELERATION_WINDOW_S: f64 = 0.25;
/// Fraction of its rates that a joint uses: the rest is for rounding of differences, which is divided by the cube of
/// the cycle.
const RATE_FRACTION: f64 = 1.0 - 1e-6;
/// Tolerance of a number of cycles: a window of exactly a number of cycles must not become one longer by rounding.
const CYCLE_TOLERANCE: f64 = 1e-6;
/// Largest number of cycles of both windows together: the longest ones at 5 kHz, more than controllers of arms run at.
/// Each cycle costs as many postures.
const MAX_WINDOW_CYCLES: usize = 4096;
const MICROSECONDS_PER_S: f64 = 1e6;

/// The smoothing of an arm's joints in cycles of fixed length.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionFilter {
    dt_s: f64,
    rates: Vec<JointRates>,
    /// The rates that references keep to, of which the jerk follows from the windows.
    used: Vec<JointRates>,
    /// N, in cycles.
    speed_window: usize,
    /// Weights of the last N + M - 1 references, the newest first; their sum is 1.
    weights: Vec<f64>,
}

/// The recent motion of an arm's joints; empty while they rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionState {
    /// The last references, the newest first.
    references: VecDeque<Vec<f64>>,
    /// Speed of each joint in the last cycle, rad/s or m/s.
    speeds: Vec<f64>,
    /// Acceleration of each joint between the last two cycles, rad/s2 or m/s2.
    accelerations: Vec<f64>,
}

/// What a cycle does to an arm's joints.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionStep {
    /// Their values at its end, rad or m.
    pub joints: Vec<f64>,
    /// The magnitudes of the rates of each.
    pub rates: Vec<JointRates>,
}

impl MotionFilter {
    /// Returns the smoothing for joints with these rates, in cycles of `dt_s`.
    ///
    /// # Errors
    /// When the windows are longer than 4,096 cycles.
    pub fn new(rates: Vec<JointRates>, dt_s: f64) -> Result<Self, InputError> {
        let longest =
            |window_s: fn(&JointRates) -> f64| rates.iter().map(window_s).fold(0.0, f64::max);
        let speed_s = longest(|rates| rates.speed / rates.acceleration).min(MAX_SPEED_WINDOW_S);
        // From one acceleration to the opposite one.
        let acceleration_s = longest(|rates| 2.0 * rates.acceleration / rates.jerk);
        let acceleration_s = acceleration_s.min(MAX_ACCELERATION_WINDOW_S);
        check_windows(speed_s, acceleration_s, dt_s)?;
        let speed_window = cycles(speed_s, dt_s);
        let acceleration_window = cycles(acceleration_s, dt_s);
        let used = rates.iter().map(|rates| {
            let rates = rates.scaled(RATE_FRACTION);
            let jerk_limited = 0.5 * rates.jerk * acceleration_window as f64 * dt_s;
            let acceleration = rates.acceleration.min(jerk_limited);
            let speed = rates.speed.min(acceleration * speed_window as f64 * dt_s);
            JointRates { speed, acceleration, ..rates }
        });
        Ok(Self {
            dt_s,
            used: used.collect(),
            speed_window,
            weights: weights(speed_window, acceleration_window),
            rates,
        })
    }

    /// Returns the highest rates of each joint.
    pub fn rates(&self) -> &[JointRates] {
        &self.rates
    }

    /// Returns the highest speed at which a reference moves each joint, in rad/s or m/s; lower than its limit where the
    /// joint would take longer than half a second to reach that.
    pub fn reference_speeds(&self) -> impl Iterator<Item = f64> + '_ {
        self.used.iter().map(|rates| rates.speed)
    }

    /// Returns the ranges of each joint in which the next reference has to be, within `limits`; each contains the last
    /// reference, which is `joints` where they rest.
    pub fn reference_ranges(
        &self,
        state: &MotionState,
        joints: &[f64],
        limits: &[[f64; 2]],
    ) -> Vec<[f64; 2]> {
        let mut ranges = Vec::with_capacity(joints.len());
        for (i, (used, [lower, upper])) in self.used.iter().zip(limits).enumerate() {
            let last = state.reference(joints)[i];
            let leaving = state.step(self.speed_window - 1, i);
            let turn = used.acceleration * self.speed_window as f64 * self.dt_s * self.dt_s;
            let step = used.speed * self.dt_s;
            // By rounding, 0 may be outside of what the window leaves.
            let back = (leaving - turn).clamp(-step, 0.0);
            let ahead = (leaving + turn).clamp(0.0, step);
            ranges
                .push([(last + back).max(*lower).min(last), (last + ahead).min(*upper).max(last)]);
        }
        ranges
    }

    /// Returns the postures of the coming cycles if the reference goes to `reference` in this one and then rests; the
    /// last is `reference` itself.
    pub fn stop_postures(
        &self,
        state: &MotionState,
        joints: &[f64],
        reference: &[f64],
    ) -> Vec<Vec<f64>> {
        let count = self.weights.len();
        let mut coming = state.clone();
        coming.push(joints, reference.to_vec(), self.history_len());
        let first = self.smoothed(&coming);
        let mut postures = vec![Vec::with_capacity(joints.len()); count];
        for (i, to) in reference.iter().enumerate() {
            let oldest_first = coming.references.iter().rev();
            let left: Vec<f64> = oldest_first.map(|past| past[i] - to).collect();
            for (posture, away) in postures.iter_mut().zip(self.decay(&left)) {
                posture.push(to + away);
            }
        }
        // As the cycle itself computes it, and exactly at the reference: running sums differ by rounding.
        postures[0] = first;
        if count > 1 {
            postures[count - 1] = reference.to_vec();
        }
        postures
    }

    /// Returns how far a joint is from where its reference will rest, in the coming cycles, from how far its recent
    /// references were, the oldest first. By running sums both means take a few steps a cycle, whatever their windows.
    fn decay(&self, left: &[f64]) -> Vec<f64> {
        let windows = [self.speed_window, self.weights.len() + 1 - self.speed_window];
        let mut values = left.to_vec();
        values.resize(left.len() + self.weights.len() - 1, 0.0);
        for window in windows {
            let mut sums = Vec::with_capacity(values.len() + 1);
            sums.push(0.0);
            for value in &values {
                sums.push(sums[sums.len() - 1] + value);
            }
            let mean = |end: usize| (sums[end] - sums[end - window]) / window as f64;
            // Earlier means lack values; none of them is asked for.
            values = (window..sums.len()).map(mean).collect();
        }
        let from = values.len() - self.weights.len();
        values.split_off(from)
    }

    /// Advances the joints by a cycle in which the reference goes to `reference`.
    pub fn advance(
        &self,
        state: &mut MotionState,
        joints: &[f64],
        reference: &[f64],
    ) -> MotionStep {
        if state.is_at_rest() && reference == joints {
            let still = JointRates { speed: 0.0, acceleration: 0.0, jerk: 0.0 };
            return MotionStep { joints: joints.to_vec(), rates: vec![still; joints.len()] };
        }
        state.push(joints, reference.to_vec(), self.history_len());
        let next = self.smoothed(state);
        let mut rates = Vec::with_capacity(joints.len());
        for (i, (before, now)) in joints.iter().zip(&next).enumerate() {
            let speed = (now - before) / self.dt_s;
            let acceleration = (speed - state.speeds[i]) / self.dt_s;
            let jerk = (acceleration - state.accelerations[i]) / self.dt_s;
            rates.push(JointRates {
                speed: speed.abs(),
                acceleration: acceleration.abs(),
                jerk: jerk.abs(),
            });
            state.speeds[i] = speed;
            state.accelerations[i] = acceleration;
        }
        state.clear_if_still(&next);
        MotionStep { joints: next, rates }
    }

    /// References that conditions or means look back to: N + 1 for the step that leaves the first window.
    fn history_len(&self) -> usize {
        self.weights.len().max(self.speed_window + 1)
    }

    /// Returns the weighted mean of the references. It is taken from the newest, so that it is that one exactly once
    /// all are equal.
    fn smoothed(&self, state: &MotionState) -> Vec<f64> {
        let newest = &state.references[0];
        let mut posture = newest.clone();
        for (weight, reference) in self.weights.iter().zip(&state.references).skip(1) {
            for ((value, old), new) in posture.iter_mut().zip(reference).zip(newest) {
                *value += weight * (old - new);
            }
        }
        posture
    }
}

impl MotionState {
    /// Returns whether nothing moves, nor is about to.
    pub fn is_at_rest(&self) -> bool {
        self.references.is_empty()
    }

    /// Returns the last reference, which is `joints` where they rest.
    pub fn reference<'a>(&'a self, joints: &'a [f64]) -> &'a [f64] {
        self.references.front().map_or(joints, Vec::as_slice)
    }

    /// Returns the oldest reference that the joints still follow, which is `joints` where they rest.
    pub fn oldest_reference<'a>(&'a self, joints: &'a [f64]) -> &'a [f64] {
        self.references.back().map_or(joints, Vec::as_slice)
    }

    /// Returns all of it as rows of one value for each joint: speeds, accelerations, and references, the newest first;
    /// none where it is at rest.
    pub fn to_rows(&self) -> Vec<Vec<f64>> {
        if self.is_at_rest() {
            return Vec::new();
        }
        let rates = [self.speeds.clone(), self.accelerations.clone()];
        rates.into_iter().chain(self.references.iter().cloned()).collect()
    }

    /// Returns the state of [`MotionState::to_rows`]; none if the rows are not those of `joints` joints.
    pub fn from_rows(rows: &[Vec<f64>], joints: usize) -> Option<Self> {
        if rows.is_empty() {
            return Some(Self::default());
        }
        let [speeds, accelerations, references @ ..] = rows else { return None };
        if references.is_empty() || rows.iter().any(|row| row.len() != joints) {
            return None;
        }
        Some(Self {
            references: references.iter().cloned().collect(),
            speeds: speeds.clone(),
            accelerations: accelerations.clone(),
        })
    }

    /// Returns by how much joint `i` of the reference moved in a cycle, that of index 0 being the last one.
    fn step(&self, index: usize, i: usize) -> f64 {
        match (self.references.get(index), self.references.get(index + 1)) {
            (Some(new), Some(old)) => new[i] - old[i],
            _ => 0.0,
        }
    }

    /// Adds a reference, and forgets those beyond `len`. Joints at rest have been at `joints` in all cycles before.
    fn push(&mut self, joints: &[f64], reference: Vec<f64>, len: usize) {
        if self.is_at_rest() {
            self.references = std::iter::repeat_n(joints.to_vec(), len).collect();
            self.speeds = vec![0.0; joints.len()];
            self.accelerations = vec![0.0; joints.len()];
        }
        self.references.push_front(reference);
        self.references.truncate(len);
    }

    /// Forgets everything once the joints rest where all references are.
    fn clear_if_still(&mut self, joints: &[f64]) {
        let mut rates = self.speeds.iter().chain(&self.accelerations);
        let mut references = self.references.iter();
        if rates.all(|rate| *rate == 0.0) && references.all(|reference| reference == joints) {
            *self = Self::default();
        }
    }
}

/// Returns an error if windows of these durations have more cycles of `dt_s` together than are smoothed.
fn check_windows(speed_s: f64, acceleration_s: f64, dt_s: f64) -> Result<(), InputError> {
    let smoothed_s = speed_s + acceleration_s;
    let most_cycles = MAX_WINDOW_CYCLES as f64;
    if smoothed_s / dt_s <= most_cycles {
        return Ok(());
    }
    // Rounded up, so that the number is valid as it stands.
    let least_dt_s = (smoothed_s / most_cycles * MICROSECONDS_PER_S).ceil() / MICROSECONDS_PER_S;
    let cause = format!(
        "the joints are smoothed over {smoothed_s:.3} s, more than {MAX_WINDOW_CYCLES} cycles of {dt_s:e} s"
    );
    let remedy = format!(
        "give chain.dt_s = {least_dt_s} or more, or joints a higher max_acceleration or max_jerk"
    );
    Err(InputError::new("the motion of the joints", cause, remedy))
}

/// Returns the least number of cycles that are at least so long.
fn cycles(window_s: f64, dt_s: f64) -> usize {
    ((window_s / dt_s - CYCLE_TOLERANCE).ceil() as usize).max(1)
}

/// Returns the weights of a mean over `first` cycles of which a mean over `second` cycles is taken: a trapezoid.
fn weights(first: usize, second: usize) -> Vec<f64> {
    let len = first + second - 1;
    let all = (first * second) as f64;
    let count = |i: usize| (i + 1).min(len - i).min(first).min(second);
    (0..len).map(|i| count(i) as f64 / all).collect()
}
