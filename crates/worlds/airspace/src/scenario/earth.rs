//! What a geographic scenario needs beside its positions, and what it cannot have.

use super::compile::Compiler;
use crate::flight::{AirplaneStart, Point, Surface};
use crate::world::AirspaceWorld;
use sidestep_import::local_plane::{LatLon, center};
use sidestep_kernel::InputError;
use sidestep_scenario::Spanned;

/// Largest distance in meters that an airplane may fly within a `dt`: so far, the plane in which it flies is true to
/// 0.001 %.
const MAX_DT_FLIGHT_M: f64 = 50_000.0;
/// Largest distance in meters that airplanes may look ahead: beyond it no plane is like the earth.
const MAX_LOOK_AHEAD_M: f64 = 2e6;
/// Largest part of a separation that the shield may keep for the roundness of the earth.
const MAX_CURVATURE_FRACTION: f64 = 0.05;

impl Compiler<'_> {
    /// Returns latitude and longitude of the origin: as given, or in a geographic scenario the center of where
    /// airplanes start.
    pub(super) fn origin_deg(
        &self,
        surface: Surface,
        airplanes: &[AirplaneStart],
    ) -> Result<Option<Point>, InputError> {
        if let Some(given) = &self.file.airspace.origin_deg {
            let origin_deg = given.get_ref().get();
            if origin_deg[0].abs() > 90.0 {
                let cause = format!("a latitude of {} degrees", origin_deg[0]);
                let remedy = "give [latitude, longitude], the latitude from -90 to 90";
                return Err(self.source.error(given.span(), cause, remedy));
            }
            return Ok(Some(origin_deg));
        }
        if surface == Surface::Plane {
            return Ok(None);
        }
        let starts = airplanes.iter().map(|airplane| LatLon {
            lat_deg: airplane.start.at[1].to_degrees(),
            lon_deg: airplane.start.at[0].to_degrees(),
        });
        Ok(center(starts).map(|LatLon { lat_deg, lon_deg }| [lat_deg, lon_deg]))
    }

    /// Refuses settings of a geographic scenario in which planes are too unlike the earth.
    pub(super) fn check_earth(&self, world: &AirspaceWorld) -> Result<(), InputError> {
        if world.surface == Surface::Plane {
            return Ok(());
        }
        if world.all_rules().any(|rules| rules.shield && rules.flight_environment().has_wind()) {
            let span = self.file.airspace.wind_m_s.as_ref().map(Spanned::span);
            let cause = "a wind on the earth under the shield: east is another direction for each airplane, and a \
                         wind would drive stored orbits apart or together";
            let remedy = "set airspace.shield = \"off\", or leave out the wind";
            return Err(self.source.error(span, cause, remedy));
        }
        let top_m_s = world.airplanes.iter().map(|a| a.model.v_m_s).fold(0.0, f64::max);
        let flight_m = top_m_s * world.timing.dt_s;
        if flight_m > MAX_DT_FLIGHT_M {
            let span = self.file.airspace.dt_s.as_ref().map(Spanned::span);
            let cause = format!("{flight_m:.0} m of flight between two decisions, on the earth");
            let remedy =
                format!("give a dt_s in which no airplane flies more than {MAX_DT_FLIGHT_M} m");
            return Err(self.source.error(span, cause, remedy));
        }
        let ahead_m =
            top_m_s * world.reactive_settings().look_ahead_s.max(world.timing.horizon_s());
        if ahead_m > MAX_LOOK_AHEAD_M {
            let span = self.file.airspace.horizon_s.as_ref().map(Spanned::span);
            let cause = format!("airplanes that look {ahead_m:.0} m ahead, on the earth");
            let remedy = format!(
                "give a look-ahead time in which none flies more than {MAX_LOOK_AHEAD_M} m"
            );
            return Err(self.source.error(span, cause, remedy));
        }
        let max_gap_m = world.airplanes.iter().map(|a| a.model.separation_m).fold(0.0, f64::max);
        if world.shield && 2.0 * world.curvature_m > MAX_CURVATURE_FRACTION * max_gap_m {
            let cause = format!(
                "orbits so wide that the roundness of the earth takes {:.0} m of the separation of {max_gap_m:.0} m",
                2.0 * world.curvature_m
            );
            let remedy = "give a larger omega_max_deg_s or a shorter dt_s, or set shield = \"off\"";
            return Err(self.source.error(None, cause, remedy));
        }
        Ok(())
    }
}
