//! Options of flights without a server, which `sidestep node` and `sidestep fleet` share.

use chrono::DateTime;
use clap::Args;
use sidestep_session::fleet::{
    FenceSettings, FlightClock, FlightNetwork, GuardSettings, ModelPlantSettings, PlantChoice,
};
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Limits of the guard beside a node, and the model that it leads.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Guard and model of a flight without a server")]
pub(crate) struct GuardArgs {
    /// Polygon that the vehicle must not leave, as "X,Y X,Y X,Y ..." in meters east and north; on the
    /// earth "LAT,LON ..." in degrees
    #[arg(long, value_name = "CORNERS", value_parser = parse_polygon)]
    fence_polygon: Option<Polygon>,

    /// Circle that it must not leave: its center, and its radius in meters
    #[arg(long, value_name = "X,Y,RADIUS", allow_hyphen_values = true, value_parser = parse_circle)]
    fence_circle: Option<Circle>,

    /// Lowest and highest altitude in meters
    #[arg(long, value_name = "LOW,HIGH", allow_hyphen_values = true, value_parser = parse_point)]
    fence_altitude: Option<[f64; 2]>,

    /// Distance in meters from where it is to be beyond which it is handed over to its autopilot
    /// [default: the error of position for which the shield allows; a model: any]
    #[arg(long, value_name = "M", value_parser = parse_positive)]
    max_deviation: Option<f64>,

    /// Age in seconds of its measurements beyond which it is handed over
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = parse_positive)]
    max_age: f64,

    /// Dead man's switch: seconds without a sign of life of the node's program after which it is
    /// handed over
    #[arg(long, value_name = "S", default_value_t = 5.0, value_parser = parse_positive)]
    program_timeout: f64,

    /// Seconds before the start from which on it flies straight toward its first pose
    /// [default: it waits there]
    #[arg(long, value_name = "S", default_value_t = 0.0, hide_default_value = true, value_parser = parse_not_negative)]
    run_up: f64,

    /// Seconds by which the model of a vehicle lags behind
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = parse_not_negative)]
    model_lag: f64,

    /// Largest error in meters of each coordinate that the model measures
    #[arg(long, value_name = "M", default_value_t = 0.0, value_parser = parse_not_negative)]
    model_noise: f64,
}

/// Corners of a polygon.
#[derive(Debug, Clone)]
pub(crate) struct Polygon(Vec<[f64; 2]>);

/// A circle by its center and its radius.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Circle([f64; 2], f64);

impl GuardArgs {
    pub(crate) fn settings(&self) -> GuardSettings {
        GuardSettings {
            fence: FenceSettings {
                circle: self.fence_circle.map(|Circle(center, radius_m)| (center, radius_m)),
                polygon: self.fence_polygon.as_ref().map(|all| all.0.clone()).unwrap_or_default(),
                altitude_m: self.fence_altitude,
            },
            max_deviation_m: self.max_deviation,
            max_age_s: self.max_age,
            patience_s: self.program_timeout,
            run_up_s: self.run_up,
        }
    }

    /// Returns the aircraft that a node leads.
    pub(crate) fn plant(&self) -> PlantChoice {
        PlantChoice::Model(ModelPlantSettings { lag_s: self.model_lag, noise_m: self.model_noise })
    }
}

/// Time and network of one node in a flight without a server.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Flight without a server")]
pub(crate) struct FlightArgs {
    /// Fly without a server: cycle 0 begins at this time, in UTC as 2026-12-01T04:45:00Z, or so many
    /// seconds from now on
    #[arg(long, value_name = "TIME", value_parser = parse_start)]
    start: Option<f64>,

    /// Endpoint of another node; repeatable. One link between two nodes is enough, so that it does to
    /// give those with lower numbers
    #[arg(long, value_name = "ENDPOINT", requires = "start")]
    peers: Vec<String>,

    /// Look for others by multicast, too
    #[arg(long, requires = "start")]
    scout: bool,

    /// Seconds of the scenario per second of real time; that of all others
    #[arg(long, value_name = "X", default_value_t = 1.0, requires = "start", value_parser = super::fleet::parse_speed)]
    speed: f64,

    /// Keep what the airplane has reported last in this file: a node that is started in its place goes on
    /// from there, and need not ask the others
    #[arg(long, value_name = "FILE", requires = "start")]
    journal: Option<PathBuf>,

    /// Seconds by which the clocks of two nodes may differ: reports of others count as missing
    #[arg(long, value_name = "S", default_value_t = 0.1, requires = "start", value_parser = parse_positive)]
    clock_tolerance: f64,
}

impl FlightArgs {
    /// Returns the time of the flight, if it is one without a server.
    pub(crate) fn clock(&self) -> Option<FlightClock> {
        let start_s = Some(self.start?);
        Some(FlightClock { start_s, speed: self.speed, tolerance_s: self.clock_tolerance })
    }

    pub(crate) fn journal(&self) -> Option<PathBuf> {
        self.journal.clone()
    }

    /// Returns the network of a node that is reached at some endpoints.
    pub(crate) fn network(&self, listen: &[String]) -> FlightNetwork {
        FlightNetwork {
            listen: listen.to_vec(),
            peers: self.peers.clone(),
            is_scouting: self.scout,
        }
    }
}

/// Parses a time as seconds since 1970: by RFC 3339, or as seconds from now on.
fn parse_start(text: &str) -> Result<f64, String> {
    if let Ok(seconds) = text.parse::<f64>() {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let is_soon = (-1e7..=1e7).contains(&seconds);
        return is_soon.then_some(now_s + seconds).ok_or_else(start_notation);
    }
    let time = DateTime::parse_from_rfc3339(text).map_err(|_| start_notation())?;
    Ok(time.timestamp() as f64 + f64::from(time.timestamp_subsec_nanos()) * 1e-9)
}

fn start_notation() -> String {
    "give a time in UTC as 2026-12-01T04:45:00Z, or a number of seconds from now on".into()
}

fn parse_point(text: &str) -> Result<[f64; 2], String> {
    let pair =
        text.split_once(',').and_then(|(x, y)| x.trim().parse().ok().zip(y.trim().parse().ok()));
    let finite = pair.filter(|(x, y): &(f64, f64)| x.is_finite() && y.is_finite());
    finite
        .map(|(x, y)| [x, y])
        .ok_or_else(|| "give two numbers with a comma between, as 0,120".into())
}

fn parse_polygon(text: &str) -> Result<Polygon, String> {
    let corners: Result<Vec<[f64; 2]>, String> = text.split_whitespace().map(parse_point).collect();
    let corners = corners?;
    if corners.len() < 3 {
        return Err("give at least three corners, as \"0,0 100,0 100,100\"".into());
    }
    Ok(Polygon(corners))
}

fn parse_circle(text: &str) -> Result<Circle, String> {
    let notation = || "give center and radius, as 0,0,250".to_string();
    let (center, radius_m) = text.rsplit_once(',').ok_or_else(notation)?;
    let center = parse_point(center).map_err(|_| notation())?;
    let radius_m =
        radius_m.trim().parse().ok().filter(|it_m: &f64| *it_m > 0.0 && it_m.is_finite());
    Ok(Circle(center, radius_m.ok_or_else(notation)?))
}

pub(crate) fn parse_positive(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.001..=86_400.0).contains(x));
    number.ok_or_else(|| "give a number from 0.001 to 86400".into())
}

fn parse_not_negative(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|x| (0.0..=1000.0).contains(x));
    number.ok_or_else(|| "give a number from 0 to 1000".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_as_rfc_3339_has_them() {
        // Counted by `date -u -d TIME +%s`.
        for (text, seconds) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2000-02-29T12:34:56Z", 951_827_696.0),
            ("2026-12-01T04:45:00.25Z", 1_796_100_300.25),
            ("2100-03-01t00:00:00z", 4_107_542_400.0),
            ("2026-12-01 04:45:00Z", 1_796_100_300.0),
            ("2026-12-01T04:45:00+01:00", 1_796_096_700.0),
        ] {
            assert_eq!(parse_start(text), Ok(seconds), "{text}");
        }
        for text in [
            "2026-13-01T00:00:00Z",
            "2026-02-29T00:00:00Z",
            "2026-12-01T24:00:00Z",
            "2026-12-01T04:45:00",
            "2026-12-01T04:45:00.Z",
            "26-12-01T04:45:00Z",
            "soon",
            "inf",
            "",
        ] {
            assert!(parse_start(text).is_err(), "{text}");
        }
    }

    #[test]
    fn seconds_count_from_now() {
        let now_s = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs_f64();
        let start_s = parse_start("30").expect("seconds");
        assert!((30.0..90.0).contains(&(start_s - now_s)), "{start_s}");
    }

    #[test]
    fn fences_are_read_and_nonsense_is_refused() {
        assert_eq!(parse_polygon("0,0 100,0  100,-50.5").expect("a polygon").0[2], [100.0, -50.5]);
        let circle = parse_circle("-3,4,250").expect("a circle");
        assert_eq!((circle.0, circle.1), ([-3.0, 4.0], 250.0));
        assert!(parse_polygon("0,0 1,1").is_err() && parse_polygon("0,0 1,1 x,y").is_err());
        assert!(parse_circle("1,2").is_err() && parse_circle("1,2,0").is_err());
        assert!(parse_point("inf,1").is_err() && parse_point("1").is_err());
    }
}
