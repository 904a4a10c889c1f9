//! Other aircraft, told and heard, as receivers of ADS-B report them.

use super::coordinates::{
    AltitudeTarget, GeoFrame, GeoPose, VehicleAltitude, heading_rad, place_of_units,
};
use super::counts::MavlinkCounts;
use crate::plant::aircraft::TrafficReport;
use ::mavlink::dialects::common::{
    ADSB_VEHICLE_DATA, AdsbAltitudeType, AdsbEmitterType, AdsbFlags,
};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// The first of the addresses that ICAO has set aside for aircraft that have none of their own, and their number.
const FIRST_TEMPORARY: u32 = 0x00F0_0000;
const TEMPORARY: u32 = 0x8000;

/// All addresses have 24 bits.
const MAX_ADDRESS: u32 = 0x00FF_FFFF;

/// Time between two reports of one aircraft to the vehicle: autopilots keep them for seconds.
const TELL_INTERVAL: Duration = Duration::from_millis(400);

/// Time in which a report of an aircraft that was told counts as its echo: autopilots pass on what they know.
const ECHO_TIME: Duration = Duration::from_secs(60);

/// Reports older than this are dropped, in seconds.
const MAX_AGE_S: u8 = 5;

/// Largest number of aircraft that are kept.
const MAX_AIRCRAFT: usize = 512;

/// Returns the address of an airplane that has none of ICAO, by its number in the scenario; none above 32767.
pub fn address_of_airplane(number: u32) -> Option<u32> {
    (number < TEMPORARY).then_some(FIRST_TEMPORARY + number)
}

/// The traffic around a vehicle.
#[derive(Debug, Default)]
pub(super) struct Traffic {
    told_at: BTreeMap<u32, Instant>,
    heard: BTreeMap<u32, TrafficReport>,
}

/// The scenario's coordinates, and what sea level is above the vehicle's home, in meters; none if it is not known.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrafficFrame {
    pub geo: GeoFrame,
    pub home_m: Option<f64>,
}

impl Traffic {
    /// Returns the message of a report, unless the vehicle was told of the same aircraft just before.
    pub(super) fn tell(
        &mut self,
        report: &TrafficReport,
        frame: TrafficFrame,
    ) -> Option<ADSB_VEHICLE_DATA> {
        let now = Instant::now();
        let told_at = self.told_at.get(&report.address);
        if told_at.is_some_and(|at| now.duration_since(*at) < TELL_INTERVAL) {
            return None;
        }
        let message = message_of(report, frame)?;
        self.told_at.retain(|_, at| now.duration_since(*at) < ECHO_TIME);
        self.told_at.insert(report.address, now);
        Some(message)
    }

    /// Takes note of a message.
    pub(super) fn on_message(
        &mut self,
        message: &ADSB_VEHICLE_DATA,
        frame: TrafficFrame,
        counts: &mut MavlinkCounts,
    ) {
        if self.told_at.contains_key(&message.ICAO_address) {
            counts.traffic_echoes += 1;
            return;
        }
        let has_room =
            self.heard.len() < MAX_AIRCRAFT || self.heard.contains_key(&message.ICAO_address);
        let report = report_of(message, frame).filter(|_| has_room);
        match report {
            Some(report) => {
                self.heard.insert(report.address, report);
            }
            None => counts.dropped_traffic += 1,
        }
    }

    /// Takes out what was heard, the newest report of each aircraft.
    pub(super) fn take(&mut self) -> Vec<TrafficReport> {
        std::mem::take(&mut self.heard).into_values().collect()
    }
}

fn message_of(report: &TrafficReport, frame: TrafficFrame) -> Option<ADSB_VEHICLE_DATA> {
    let pose = frame.geo.to_earth(report.pose);
    let place = pose.units();
    let sea_m = match frame.geo.altitude_target(report.altitude_m) {
        AltitudeTarget::Sea(sea_m) => sea_m,
        AltitudeTarget::Home(home_m) => home_m + frame.home_m?,
    };
    let is_told = report.address <= MAX_ADDRESS && sea_m.is_finite();
    let flags = AdsbFlags::ADSB_FLAGS_VALID_COORDS
        | AdsbFlags::ADSB_FLAGS_VALID_ALTITUDE
        | AdsbFlags::ADSB_FLAGS_VALID_HEADING
        | AdsbFlags::ADSB_FLAGS_VALID_VELOCITY
        | AdsbFlags::ADSB_FLAGS_VALID_CALLSIGN;
    is_told.then(|| ADSB_VEHICLE_DATA {
        ICAO_address: report.address,
        lat: place[0],
        lon: place[1],
        // In millimeters.
        altitude: (sea_m * 1000.0).round() as i32,
        // In hundredths of a degree; a whole turn is none.
        heading: (pose.compass_rad().to_degrees() * 100.0).round() as u16 % 36_000,
        // In centimeters per second.
        hor_velocity: (report.ground_speed_m_s * 100.0).round() as u16,
        ver_velocity: 0,
        flags,
        squawk: 0,
        altitude_type: AdsbAltitudeType::ADSB_ALTITUDE_TYPE_GEOMETRIC,
        callsign: format!("SS{:06X}", report.address).as_str().into(),
        emitter_type: AdsbEmitterType::ADSB_EMITTER_TYPE_UAV,
        tslc: 0,
    })
}

fn report_of(message: &ADSB_VEHICLE_DATA, frame: TrafficFrame) -> Option<TrafficReport> {
    let needed = AdsbFlags::ADSB_FLAGS_VALID_COORDS
        | AdsbFlags::ADSB_FLAGS_VALID_ALTITUDE
        | AdsbFlags::ADSB_FLAGS_VALID_HEADING
        | AdsbFlags::ADSB_FLAGS_VALID_VELOCITY;
    if !message.flags.contains(needed) || message.tslc > MAX_AGE_S {
        return None;
    }
    let at = place_of_units([message.lat, message.lon])?;
    let heading_rad = heading_rad((f64::from(message.heading) / 100.0).to_radians());
    let sea_m = f64::from(message.altitude) / 1000.0;
    // Above a home that is not known there is no altitude.
    let home_m = sea_m - frame.home_m?;
    Some(TrafficReport {
        address: message.ICAO_address & MAX_ADDRESS,
        pose: frame.geo.to_scenario(GeoPose { at, heading_rad }),
        altitude_m: frame.geo.altitude_m(VehicleAltitude { sea_m, home_m }),
        ground_speed_m_s: f64::from(message.hor_velocity) / 100.0,
    })
}

#[cfg(test)]
mod tests {
    use super::super::coordinates::Origin;
    use super::*;
    use sidestep::worlds::airspace::flight::{Pose2, Surface};

    fn frame() -> TrafficFrame {
        let origin = Origin { latitude_deg: 47.4, longitude_deg: 8.5, altitude_m: None };
        let geo = GeoFrame::new(Surface::Plane, Some(origin)).expect("an origin");
        TrafficFrame { geo, home_m: Some(488.0) }
    }

    fn report(address: u32) -> TrafficReport {
        TrafficReport {
            address,
            // On the meridian of the origin, where the plane's east is that of the earth.
            pose: Pose2 { at: [0.0, 500.0], heading_rad: 0.0 },
            altitude_m: 120.0,
            ground_speed_m_s: 12.34,
        }
    }

    #[test]
    fn a_report_has_the_units_of_adsb_and_comes_back() {
        let message = Traffic::default().tell(&report(0x00F0_0003), frame()).expect("told");
        assert_eq!(
            (message.altitude, message.heading, message.hor_velocity),
            (608_000, 9000, 1234)
        );
        assert_eq!(message.callsign.to_str().expect("text"), "SSF00003");
        let mut other = Traffic::default();
        let mut counts = MavlinkCounts::default();
        other.on_message(&message, frame(), &mut counts);
        let back = other.take();
        assert_eq!(back.len(), 1);
        assert!((back[0].pose.at[1] - 500.0).abs() < 0.02 && back[0].altitude_m == 120.0);
        assert!(other.take().is_empty());
    }

    #[test]
    fn what_was_told_is_no_news_when_it_comes_back_and_is_not_told_too_often() {
        let mut traffic = Traffic::default();
        let mut counts = MavlinkCounts::default();
        let message = traffic.tell(&report(7), frame()).expect("told");
        assert!(traffic.tell(&report(7), frame()).is_none());
        traffic.on_message(&message, frame(), &mut counts);
        assert!(traffic.take().is_empty());
        assert_eq!(counts.traffic_echoes, 1);
    }

    #[test]
    fn incomplete_and_old_reports_are_dropped_and_counted() {
        let whole = Traffic::default().tell(&report(7), frame()).expect("told");
        let mut traffic = Traffic::default();
        let mut counts = MavlinkCounts::default();
        let blind = AdsbFlags::ADSB_FLAGS_VALID_COORDS;
        for wrong in [
            ADSB_VEHICLE_DATA { flags: blind, ..whole.clone() },
            ADSB_VEHICLE_DATA { tslc: 9, ..whole.clone() },
            ADSB_VEHICLE_DATA { lat: i32::MAX, ..whole.clone() },
        ] {
            traffic.on_message(&wrong, frame(), &mut counts);
        }
        assert!(traffic.take().is_empty());
        assert_eq!(counts.dropped_traffic, 3);
    }

    #[test]
    fn airplanes_have_temporary_addresses_by_their_number() {
        assert_eq!(address_of_airplane(9), Some(0x00F0_0009));
        assert_eq!(address_of_airplane(TEMPORARY), None);
    }
}
