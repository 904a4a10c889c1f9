//! The guard with an aircraft that does what a test says.

use super::*;
use crate::flight::time::FlightTime;
use proptest::prelude::*;
use sidestep::worlds::airspace::flight::Pose2;
use sidestep::worlds::airspace::replica::{ReferenceCycle, ReferencePoint};
use sidestep_session::fleet::FenceSettings;
use std::sync::Mutex;

/// The commands that an aircraft has received.
#[derive(Debug, Clone, Default)]
struct CommandLog {
    setpoints: Vec<Setpoint>,
    holds: Vec<String>,
    traffic: usize,
}

/// An aircraft that is where a test says.
struct FakeAircraft {
    told: Arc<Mutex<CommandLog>>,
    state: Arc<Mutex<Option<AircraftState>>>,
    refusals: usize,
}

impl AircraftPlant for FakeAircraft {
    fn wait(&mut self, _: Duration) -> Option<AircraftState> {
        *self.state.lock().expect("a test")
    }

    fn lead(&mut self, setpoint: &Setpoint) -> Result<(), String> {
        self.told.lock().expect("a test").setpoints.push(*setpoint);
        Ok(())
    }

    fn hold(&mut self, reason: &str) -> Result<(), String> {
        self.told.lock().expect("a test").holds.push(reason.into());
        if self.refusals > 0 {
            self.refusals -= 1;
            return Err("not now".into());
        }
        Ok(())
    }

    fn show_traffic(&mut self, traffic: &[TrafficReport]) -> Result<(), String> {
        self.told.lock().expect("a test").traffic += traffic.len();
        Ok(())
    }

    fn take_traffic(&mut self) -> Vec<TrafficReport> {
        Vec::new()
    }

    fn counts(&self) -> Vec<(String, u64)> {
        vec![("lost".into(), 3)]
    }
}

/// A guard in a test, which flies east at 10 m/s from the start on.
struct GuardTest {
    guard: Guard,
    board: Arc<FlightBoard>,
    told: Arc<Mutex<CommandLog>>,
    state: Arc<Mutex<Option<AircraftState>>>,
}

fn limits(fence: &FenceSettings) -> GuardLimits {
    GuardLimits {
        max_deviation_m: 5.0,
        max_age_s: 1.0,
        patience_s: 60.0,
        run_up_s: 0.0,
        fence: Fence::new(fence, Surface::Plane).expect("a fence"),
        surface: Surface::Plane,
    }
}

/// Returns a guard at a time of the scenario; a cycle is an hour, so that time does not matter.
fn guard(at_s: f64, limits: GuardLimits) -> GuardTest {
    let clock = WallClock::system();
    let board = Arc::new(FlightBoard::default());
    board.set_time(FlightTime { start_s: clock.now_s() - at_s, speed: 1.0, dt_s: 3600.0 });
    let point = |at_s: f64| ReferencePoint {
        at_s,
        // It stands still: a machine may take any time between two steps of a test.
        pose: Pose2 { at: [0.0, 0.0], heading_rad: 0.0 },
        altitude_m: 50.0,
        ground_speed_m_s: 10.0,
        turn_rate_rad_s: 0.0,
    };
    let points = vec![point(0.0), point(3600.0)];
    board.put_reference(vec![ReferenceCycle { cycle: 0, points, is_last: true }]);
    let told = Arc::new(Mutex::new(CommandLog::default()));
    let state = Arc::new(Mutex::new(Some(state_at([1.0, 0.0]))));
    let plant = FakeAircraft { told: Arc::clone(&told), state: Arc::clone(&state), refusals: 0 };
    let guard = Guard::new(Box::new(plant), Arc::clone(&board), clock, limits);
    GuardTest { guard, board, told, state }
}

fn state_at(at: [f64; 2]) -> AircraftState {
    AircraftState {
        pose: Pose2 { at, heading_rad: 0.0 },
        altitude_m: 50.0,
        ground_speed_m_s: 10.0,
        age_s: 0.1,
        authority: Authority::Node,
    }
}

impl GuardTest {
    fn step_with(&mut self, state: Option<AircraftState>) -> GuardReport {
        *self.state.lock().expect("a test") = state;
        self.guard.step();
        self.board.guard()
    }

    fn told(&self) -> CommandLog {
        self.told.lock().expect("a test").clone()
    }
}

#[test]
fn an_aircraft_within_its_limits_is_led_and_nothing_else() {
    let mut test = guard(10.0, limits(&FenceSettings::default()));
    for _ in 0..5 {
        let report = test.step_with(Some(state_at([3.0, 4.0])));
        assert_eq!((report.held, report.is_at_reference), (None, true));
        assert_eq!((report.deviation_m, report.max_deviation_m), (Some(5.0), 5.0));
    }
    assert_eq!((test.told().setpoints.len(), test.told().holds.len()), (5, 0));
}

#[test]
fn whatever_is_beyond_a_limit_hands_the_aircraft_over_once_and_for_good() {
    let circle = FenceSettings { circle: Some(([0.0, 0.0], 100.0)), ..FenceSettings::default() };
    let good = state_at([0.0, 0.0]);
    for (what, state) in [
        ("2.0 s old", Some(AircraftState { age_s: 2.0, ..good })),
        ("from where it is to be", Some(state_at([6.0, 0.0]))),
        ("from where it is to be", Some(AircraftState { altitude_m: 60.0, ..good })),
        ("from where it is to be", Some(state_at([f64::NAN, 0.0]))),
        ("leave the fence", Some(AircraftState { ground_speed_m_s: 120.0, ..good })),
    ] {
        let mut test = guard(10.0, limits(&circle));
        assert_eq!(test.step_with(Some(good)).held, None);
        let report = test.step_with(state);
        assert!(report.held.as_ref().is_some_and(|held| held.contains(what)), "{what}: {report:?}");
        // It is well again, and stays handed over.
        let report = test.step_with(Some(good));
        assert!(report.held.is_some(), "{what}");
        let told = test.told();
        assert_eq!((told.setpoints.len(), told.holds.len()), (2, 1), "{what}");
        assert_eq!(test.board.take_events().len(), 1, "{what}");
        drop(test.guard);
        assert_eq!(test.told.lock().expect("a test").holds.len(), 1, "{what}: not again");
    }
}

#[test]
fn an_aircraft_that_measures_nothing_has_a_little_time_after_its_first_setpoint() {
    let patient = GuardLimits { max_age_s: 600.0, ..limits(&FenceSettings::default()) };
    let mut test = guard(10.0, patient);
    assert_eq!(test.step_with(None).held, None);
    let mut test = guard(10.0, GuardLimits { max_age_s: 0.0, ..limits(&FenceSettings::default()) });
    std::thread::sleep(Duration::from_millis(2));
    test.step_with(None);
    std::thread::sleep(Duration::from_millis(2));
    let report = test.step_with(None);
    assert!(report.held.is_some_and(|held| held.contains("measures nothing")));
}

#[test]
fn a_program_without_a_sign_of_life_or_a_reference_loses_its_aircraft() {
    let dead = GuardLimits { patience_s: 0.0, ..limits(&FenceSettings::default()) };
    let mut test = guard(10.0, dead);
    std::thread::sleep(Duration::from_millis(2));
    let report = test.step_with(Some(state_at([0.0, 0.0])));
    assert!(report.held.is_some_and(|held| held.contains("sign of life")));
    let mut test = guard(10.0, limits(&FenceSettings::default()));
    test.board.put_reference(Vec::new());
    let report = test.step_with(Some(state_at([0.0, 0.0])));
    assert!(report.held.is_some_and(|held| held.contains("nothing says")));
}

#[test]
fn an_aircraft_that_somebody_else_flies_is_told_nothing() {
    let mut test = guard(10.0, limits(&FenceSettings::default()));
    test.step_with(Some(state_at([0.0, 0.0])));
    let taken = AircraftState { authority: Authority::Vehicle, ..state_at([0.0, 0.0]) };
    let report = test.step_with(Some(taken));
    assert!(report.held.is_some_and(|held| held.contains("somebody else")));
    test.step_with(Some(taken));
    drop(test.guard);
    let told = test.told.lock().expect("a test").clone();
    // The setpoint of the step in which it turned out is the last one.
    assert_eq!((told.setpoints.len(), told.holds.len()), (2, 0));
}

#[test]
fn an_aircraft_that_refuses_is_asked_again() {
    let impatient = GuardLimits { max_age_s: 0.0, ..limits(&FenceSettings::default()) };
    let mut test = guard(10.0, impatient);
    let plant =
        FakeAircraft { told: Arc::clone(&test.told), state: Arc::clone(&test.state), refusals: 1 };
    test.guard.plant = Box::new(plant);
    test.step_with(Some(state_at([0.0, 0.0])));
    assert!(test.guard.hold_again.is_some());
    test.guard.hold_again = Some((Instant::now(), "again".into()));
    test.step_with(None);
    assert_eq!(test.told().holds, ["its measurements are 0.1 s old", "again"]);
    assert!(test.guard.hold_again.is_none());
}

#[test]
fn before_the_start_it_only_says_whether_its_aircraft_is_there() {
    let mut test = guard(-1e6, limits(&FenceSettings::default()));
    assert!(!test.step_with(None).is_at_reference);
    let far = test.step_with(Some(state_at([500.0, 0.0])));
    assert_eq!((far.held, far.is_at_reference, far.max_deviation_m), (None, false, 0.0));
    let ground = AircraftState { authority: Authority::Ground, ..state_at([0.0, 0.0]) };
    assert!(!test.step_with(Some(ground)).is_at_reference);
    assert!(test.step_with(Some(state_at([0.0, 0.0]))).is_at_reference);
    drop(test.guard);
    let holds = test.told.lock().expect("a test").holds.clone();
    assert_eq!(holds, ["its node ends"]);
}

#[test]
fn an_aircraft_that_has_arrived_holds_by_itself_and_is_not_judged_anymore() {
    let mut test = guard(3601.0, limits(&FenceSettings::default()));
    let report = test.step_with(Some(state_at([0.0, 0.0])));
    assert_eq!((report.held, test.told().holds.len()), (None, 1));
    assert_eq!(test.step_with(None).held, None);
    assert!(test.board.take_events()[0].contains("arrived"));
    assert_eq!(test.board.guard().counts, [("lost".to_string(), 3)]);
}

proptest! {
    /// Whatever is measured, an aircraft that stays led is within all limits.
    #[test]
    fn one_that_is_not_handed_over_is_within_all_limits(
        x in -20.0f64..20.0, y in -20.0f64..20.0, altitude_m in 30.0f64..70.0, age_s in 0.0f64..2.0,
        speed_m_s in 0.0f64..40.0, heading_rad in -3.2f64..3.2, silent_s in 0.0f64..120.0, radius_m in 5.0f64..40.0,
    ) {
        let fence = FenceSettings {
            circle: Some(([0.0, 0.0], radius_m)), altitude_m: Some([45.0, 55.0]), ..FenceSettings::default()
        };
        let limits = limits(&fence);
        let pose = Pose2 { at: [x, y], heading_rad };
        let state = AircraftState { pose, altitude_m, age_s, ground_speed_m_s: speed_m_s, authority: Authority::Node };
        let setpoint = Setpoint {
            pose: Pose2 { at: [0.0, 0.0], heading_rad: 0.0 },
            ground_speed_m_s: 10.0, turn_rate_rad_s: 0.0, altitude_m: 50.0,
        };
        let view = GuardView { state: Some(state), setpoint: Some(setpoint), silent_s };
        let deviation_m = x.hypot(y).hypot(altitude_m - 50.0);
        let ahead_m = (x + speed_m_s * heading_rad.cos()).hypot(y + speed_m_s * heading_rad.sin());
        let is_within = age_s <= 1.0 && silent_s <= 60.0 && deviation_m <= 5.0 && x.hypot(y) <= radius_m
            && ahead_m <= radius_m && (45.0..=55.0).contains(&altitude_m);
        prop_assert_eq!(limits.check(&view).is_none(), is_within);
    }
}
