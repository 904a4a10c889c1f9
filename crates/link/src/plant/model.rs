//! A model of an aircraft, in the process of its node: it follows its setpoints, and lags and errs as it is told to.

use super::aircraft::{AircraftPlant, AircraftState, Authority, Setpoint, TrafficReport};
use sidestep::worlds::airspace::flight::{Pose2, Surface};
use sidestep_session::fleet::ModelPlantSettings;
use std::time::{Duration, Instant};

/// A model of an aircraft.
///
/// Without lag it is where it is to be, at the time of the last setpoint; with a lag `T` it closes `1/T` of what is left in
/// each second, beside the velocity of its setpoint.
#[derive(Debug)]
pub struct ModelPlant {
    surface: Surface,
    settings: ModelPlantSettings,
    /// Seconds of the scenario in a second.
    speed: f64,
    /// Where it is, and the last setpoint.
    flown: Option<(Pose2, Setpoint)>,
    led_at: Instant,
    authority: Authority,
    /// State of the generator of errors.
    draws: u64,
    setpoints: u64,
}

impl ModelPlant {
    /// Returns a model, which is at its first setpoint when that comes; `seed` is that of its errors.
    pub fn new(surface: Surface, settings: ModelPlantSettings, speed: f64, seed: u64) -> Self {
        Self {
            surface,
            settings,
            speed,
            flown: None,
            led_at: Instant::now(),
            authority: Authority::Node,
            draws: seed,
            setpoints: 0,
        }
    }

    /// Returns the next error in meters, within the bound.
    fn error_m(&mut self) -> f64 {
        // SplitMix64: a model needs no better draws, and no results depend on them.
        self.draws = self.draws.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.draws;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        let share = (bits ^ (bits >> 31)) as f64 / u64::MAX as f64;
        self.settings.noise_m * (2.0 * share - 1.0)
    }

    /// Returns where it is at the time of a new setpoint.
    fn followed(&self, setpoint: &Setpoint) -> Pose2 {
        let Some((pose, before)) = &self.flown else { return setpoint.pose };
        let passed_s = self.led_at.elapsed().as_secs_f64() * self.speed;
        if self.settings.lag_s <= 0.0 {
            return setpoint.pose;
        }
        // The setpoint has moved on, and so has the vehicle; of what was left it has closed a part.
        let frame = self.surface.frame_at(setpoint.pose.at);
        let left = [frame.to_local(pose.at), frame.to_local(before.pose.at)];
        let closed = 1.0 - (-passed_s / self.settings.lag_s).exp();
        let target = frame.to_local(setpoint.pose.at);
        let at = [0, 1].map(|k| {
            let offset_m = left[0][k] - left[1][k];
            let moved_m = target[k] - left[1][k];
            // A first-order lag behind a target that moves evenly.
            target[k] + offset_m * (1.0 - closed) - moved_m * self.ramp_share(passed_s, closed)
        });
        Pose2 { at: frame.to_world(at), ..setpoint.pose }
    }

    /// Returns the share of an even motion of the target by which a first-order lag falls behind in it.
    fn ramp_share(&self, passed_s: f64, closed: f64) -> f64 {
        if passed_s > 0.0 { closed * self.settings.lag_s / passed_s } else { 0.0 }
    }
}

impl AircraftPlant for ModelPlant {
    fn wait(&mut self, within: Duration) -> Option<AircraftState> {
        std::thread::sleep(within);
        let (pose, setpoint) = self.flown?;
        let errors_m = [self.error_m(), self.error_m()];
        let frame = self.surface.frame_at(pose.at);
        let local = frame.to_local(pose.at);
        let at = frame.to_world([local[0] + errors_m[0], local[1] + errors_m[1]]);
        Some(AircraftState {
            pose: Pose2 { at, ..pose },
            altitude_m: setpoint.altitude_m,
            ground_speed_m_s: setpoint.ground_speed_m_s,
            age_s: self.led_at.elapsed().as_secs_f64(),
            authority: self.authority,
        })
    }

    fn lead(&mut self, setpoint: &Setpoint) -> Result<(), String> {
        if self.authority == Authority::Node {
            self.flown = Some((self.followed(setpoint), *setpoint));
            self.led_at = Instant::now();
            self.setpoints += 1;
        }
        Ok(())
    }

    fn hold(&mut self, _: &str) -> Result<(), String> {
        // It hovers where it is.
        self.authority = Authority::Vehicle;
        if let Some((_, setpoint)) = &mut self.flown {
            setpoint.ground_speed_m_s = 0.0;
        }
        Ok(())
    }

    fn show_traffic(&mut self, _: &[TrafficReport]) -> Result<(), String> {
        // A model shows it to nobody.
        Ok(())
    }

    fn take_traffic(&mut self) -> Vec<TrafficReport> {
        Vec::new()
    }

    fn counts(&self) -> Vec<(String, u64)> {
        vec![("setpoints".into(), self.setpoints)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn setpoint(x_m: f64) -> Setpoint {
        Setpoint {
            pose: Pose2 { at: [x_m, 0.0], heading_rad: 0.0 },
            ground_speed_m_s: 8.0,
            turn_rate_rad_s: 0.0,
            altitude_m: 30.0,
        }
    }

    #[test]
    fn it_is_where_it_is_to_be_unless_it_lags_or_errs() {
        let mut ideal = ModelPlant::new(Surface::Plane, ModelPlantSettings::default(), 1.0, 1);
        assert_eq!(ideal.wait(Duration::ZERO), None);
        for x_m in [0.0, 5.0] {
            ideal.lead(&setpoint(x_m)).expect("a model");
            assert_eq!(ideal.wait(Duration::ZERO).expect("a state").pose.at, [x_m, 0.0]);
        }
        let settings = ModelPlantSettings { lag_s: 1e6, noise_m: 0.5 };
        let mut slow = ModelPlant::new(Surface::Plane, settings, 1.0, 1);
        for x_m in [0.0, 5.0, 10.0] {
            slow.lead(&setpoint(x_m)).expect("a model");
            let at = slow.wait(Duration::from_millis(2)).expect("a state").pose.at;
            assert!(at[0].abs() <= 0.51 && at[1].abs() <= 0.5, "it has hardly set out: {at:?}");
        }
    }

    #[test]
    fn one_that_was_handed_over_stays_where_it_is() {
        let mut model = ModelPlant::new(Surface::Plane, ModelPlantSettings::default(), 1.0, 1);
        model.lead(&setpoint(3.0)).expect("a model");
        model.hold("a test").expect("a model");
        model.lead(&setpoint(4.0)).expect("a model");
        let state = model.wait(Duration::ZERO).expect("a state");
        assert_eq!((state.pose.at, state.authority), ([3.0, 0.0], Authority::Vehicle));
    }
}
