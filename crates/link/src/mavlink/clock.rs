//! The vehicle's clock on this machine's, so that the age of a measurement is known however late it arrives.
//!
//! A measurement that took the least time so far gives the difference of the two clocks; by it, all others are older
//! than their arrival by what they took longer. What the fastest took is not seen by this: it is half of a round trip at
//! least, which [`VehicleClock::set_round_trip`] adds.

use std::time::{Duration, Instant};

/// By how much one clock may be faster than the other: 200 parts of a million, four times what quartzes have.
const DRIFT: f64 = 2e-4;

/// A step of the vehicle's clock from which on it is no lateness, in seconds.
const JUMP_S: f64 = 1.0;

/// Difference between two measurements by both clocks within which they belong to one new time, in seconds.
const AGREEMENT_S: f64 = 0.5;

/// The clock of a vehicle.
#[derive(Debug, Clone)]
pub(super) struct VehicleClock {
    start: Instant,
    /// The time of this machine less that of the vehicle, in seconds, by the fastest measurement.
    offset_s: f64,
    /// The newest measurement by the vehicle's clock, and its arrival; none before the first.
    newest: Option<Reading>,
    /// A measurement of another time, before a second one confirms it.
    doubtful: Option<Reading>,
    /// Since when all measurements are late, by this machine's clock in seconds; none if they are not.
    late_since_s: Option<f64>,
    round_trip: Option<RoundTrip>,
}

/// A question and its answer, in seconds by this machine's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
struct RoundTrip {
    asked_s: f64,
    duration_s: f64,
}

/// A time of the vehicle, and when it arrived, in seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    boot_s: f64,
    arrival_s: f64,
}

/// What a measurement is by its time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ClockUpdate {
    /// Newer than all before.
    Newer,
    /// Not newer than one before.
    Old,
    /// Of another time, which a second measurement has to confirm.
    Doubtful,
    /// The first that is believed since the vehicle has booted.
    Rebooted,
    /// The first that is believed since the vehicle's clock jumped ahead.
    Jumped,
}

impl VehicleClock {
    /// Returns a clock that knows nothing yet.
    pub(super) fn new(start: Instant) -> Self {
        Self {
            start,
            offset_s: 0.0,
            newest: None,
            doubtful: None,
            late_since_s: None,
            round_trip: None,
        }
    }

    /// Takes note of a measurement, by its time since the vehicle has booted. (That begins anew after 49 days, which
    /// counts as a boot.)
    pub(super) fn update(&mut self, boot_ms: u32, now: Instant) -> ClockUpdate {
        let arrival_s = now.duration_since(self.start).as_secs_f64();
        let reading = Reading { boot_s: f64::from(boot_ms) / 1000.0, arrival_s };
        let offset_s = arrival_s - reading.boot_s;
        let Some(newest) = self.newest else {
            self.begin(reading);
            return ClockUpdate::Newer;
        };
        let has_gone_back = reading.boot_s < newest.boot_s - JUMP_S;
        let has_jumped = offset_s < self.offset_s - JUMP_S;
        if has_gone_back || has_jumped {
            let is_confirmed = self.doubtful.is_some_and(|first| first.is_followed_by(reading));
            self.doubtful = Some(reading);
            if !is_confirmed {
                return ClockUpdate::Doubtful;
            }
            self.begin(reading);
            return if has_gone_back { ClockUpdate::Rebooted } else { ClockUpdate::Jumped };
        }
        self.doubtful = None;
        if reading.boot_s <= newest.boot_s {
            return ClockUpdate::Old;
        }
        if self.has_begun_anew(offset_s - self.offset_s, arrival_s) {
            self.begin(reading);
            return ClockUpdate::Rebooted;
        }
        let drift_s = DRIFT * (arrival_s - newest.arrival_s);
        self.offset_s = offset_s.min(self.offset_s + drift_s);
        self.newest = Some(reading);
        ClockUpdate::Newer
    }

    /// Returns whether measurements are later than a question and its answer took since they are late. Then they are not
    /// late, but by another clock: one that has booted so early that it goes beyond what it was before.
    fn has_begun_anew(&mut self, lateness_s: f64, arrival_s: f64) -> bool {
        if lateness_s <= JUMP_S {
            self.late_since_s = None;
            return false;
        }
        let late_since_s = *self.late_since_s.get_or_insert(arrival_s);
        self.round_trip.is_some_and(|round_trip| {
            round_trip.asked_s >= late_since_s && lateness_s > round_trip.duration_s + JUMP_S
        })
    }

    fn begin(&mut self, reading: Reading) {
        self.offset_s = reading.arrival_s - reading.boot_s;
        self.newest = Some(reading);
        self.doubtful = None;
        self.late_since_s = None;
    }

    /// Takes note of the time that a question and its answer took.
    pub(super) fn set_round_trip(&mut self, asked: Instant, duration: Duration) {
        let asked_s = asked.saturating_duration_since(self.start).as_secs_f64();
        self.round_trip = Some(RoundTrip { asked_s, duration_s: duration.as_secs_f64() });
    }

    /// Returns the age of the newest measurement in seconds.
    pub(super) fn age_s(&self, now: Instant) -> f64 {
        let Some(newest) = self.newest else { return f64::INFINITY };
        let now_s = now.duration_since(self.start).as_secs_f64();
        let round_trip_s = self.round_trip.map_or(0.0, |round_trip| round_trip.duration_s);
        now_s - newest.boot_s - self.offset_s + 0.5 * round_trip_s
    }
}

impl Reading {
    /// Returns whether another one belongs to the same time.
    fn is_followed_by(self, next: Self) -> bool {
        let boot_s = next.boot_s - self.boot_s;
        let arrival_s = next.arrival_s - self.arrival_s;
        boot_s > 0.0 && (boot_s - arrival_s).abs() < AGREEMENT_S
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Times {
        start: Instant,
        clock: VehicleClock,
    }

    impl Times {
        fn new() -> Self {
            let start = Instant::now();
            Self { start, clock: VehicleClock::new(start) }
        }

        fn at(&self, arrival_s: f64) -> Instant {
            self.start + Duration::from_secs_f64(arrival_s)
        }

        fn update(&mut self, boot_ms: u32, arrival_s: f64) -> ClockUpdate {
            self.clock.update(boot_ms, self.at(arrival_s))
        }

        fn age_s(&self, now_s: f64) -> f64 {
            self.clock.age_s(self.at(now_s))
        }
    }

    #[test]
    fn a_measurement_that_took_longer_than_others_is_older() {
        let mut times = Times::new();
        times.update(1000, 10.0);
        assert!((times.age_s(10.2) - 0.2).abs() < 1e-3);
        assert_eq!(times.update(2000, 11.6), ClockUpdate::Newer);
        assert!((times.age_s(11.6) - 0.6).abs() < 1e-3, "{}", times.age_s(11.6));
        // One that was faster than the first makes all others older.
        assert_eq!(times.update(3000, 11.9), ClockUpdate::Newer);
        assert!((times.age_s(12.0) - 0.1).abs() < 1e-3);
        times.clock.set_round_trip(times.at(12.0), Duration::from_millis(400));
        assert!((times.age_s(12.0) - 0.3).abs() < 1e-3);
    }

    #[test]
    fn a_time_that_stands_still_makes_the_measurement_old() {
        let mut times = Times::new();
        times.update(1000, 10.0);
        for k in 1..30 {
            assert_eq!(times.update(1000, 10.0 + 0.1 * f64::from(k)), ClockUpdate::Old);
        }
        assert!((times.age_s(13.0) - 3.0).abs() < 1e-3);
    }

    #[test]
    fn a_boot_is_believed_when_a_second_measurement_confirms_it() {
        let mut times = Times::new();
        times.update(60_000, 10.0);
        assert_eq!(times.update(500, 15.0), ClockUpdate::Doubtful);
        assert!(times.age_s(15.0) > 4.9);
        assert_eq!(times.update(600, 15.1), ClockUpdate::Rebooted);
        assert!(times.age_s(15.1) < 0.01);
        assert_eq!(times.update(700, 15.2), ClockUpdate::Newer);
    }

    #[test]
    fn a_stray_datagram_of_long_ago_is_no_boot() {
        let mut times = Times::new();
        times.update(60_000, 10.0);
        assert_eq!(times.update(50_000, 10.05), ClockUpdate::Doubtful);
        assert_eq!(times.update(60_100, 10.1), ClockUpdate::Newer);
        assert_eq!(times.update(50_100, 10.15), ClockUpdate::Doubtful);
        assert_eq!(times.update(60_050, 10.2), ClockUpdate::Old);
    }

    #[test]
    fn a_boot_soon_after_another_is_told_from_lateness_by_a_round_trip() {
        let mut times = Times::new();
        times.update(1000, 10.0);
        // Whether five seconds are a boot or a delay, the first question since then tells.
        times.clock.set_round_trip(times.at(10.0), Duration::from_millis(100));
        assert_eq!(times.update(2000, 16.0), ClockUpdate::Newer);
        assert!(times.age_s(16.0) > 4.9);
        times.clock.set_round_trip(times.at(16.1), Duration::from_millis(4900));
        assert_eq!(times.update(6000, 20.0), ClockUpdate::Newer);
        times.clock.set_round_trip(times.at(21.0), Duration::from_millis(100));
        assert_eq!(times.update(8000, 22.0), ClockUpdate::Rebooted);
        assert!(times.age_s(22.0) < 0.1);
    }

    #[test]
    fn a_clock_that_jumps_ahead_is_followed_after_a_second_measurement() {
        let mut times = Times::new();
        times.update(1000, 10.0);
        assert_eq!(times.update(900_000, 10.1), ClockUpdate::Doubtful);
        assert_eq!(times.update(900_100, 10.2), ClockUpdate::Jumped);
        assert!(times.age_s(10.2) < 0.01);
    }
}
