//! The scenarios that airplanes can fly without a server.

use crate::method::MethodKind;
use crate::scenario::CompiledAirspace;
use crate::settings::{Deployment, Grouping};
use crate::world::AirspaceWorld;

/// Why a scenario cannot be flown without a server: the cause, and the remedy.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FlightLimit {
    /// What is in the way.
    pub cause: String,
    /// What would be right.
    pub remedy: String,
}

/// The shares of a cycle in which airplanes report and talk; the rest is for handing over their controls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeShares {
    /// For reports.
    pub reports: f64,
    /// For both conversations together.
    pub conversations: f64,
}

impl TimeShares {
    /// A fifth for reports, of which each is repeated four times within it; a tenth is left at the end.
    pub const DEFAULT: Self = Self { reports: 0.2, conversations: 0.7 };
}

/// Checks that the airplanes of a scenario can fly without a server.
///
/// # Errors
/// With the first reason why they cannot.
pub fn check_flight(scenario: &CompiledAirspace) -> Result<(), FlightLimit> {
    let world = &scenario.world;
    check_decisions(world)?;
    check_airplanes(world)?;
    check_air(world)?;
    check_network(world)?;
    if let Some(&(a, b)) = scenario.too_close.first() {
        let cause = format!(
            "airplanes {} and {} are too close at the start: the shield promises nothing for them",
            world.display_name(a),
            world.display_name(b)
        );
        return limit(cause, "start them farther apart, or in other directions");
    }
    Ok(())
}

fn limit(cause: impl Into<String>, remedy: impl Into<String>) -> Result<(), FlightLimit> {
    Err(FlightLimit { cause: cause.into(), remedy: remedy.into() })
}

/// Checks how airplanes decide.
fn check_decisions(world: &AirspaceWorld) -> Result<(), FlightLimit> {
    if world.deployment == Deployment::Direct {
        let cause = "one process decides for all airplanes (deployment = \"direct\")";
        let remedy = "add --set airspace.deployment=replica-team, or another one of team, compact-team, pim \
                      and hierarchical-pim";
        return limit(cause, remedy);
    }
    if world.groups != Grouping::Heard {
        let cause = "groups are announced, and without a server nobody announces them";
        return limit(cause, "add --set airspace.groups=heard");
    }
    if !world.shield {
        let cause =
            "the shield is off, and nothing else keeps airplanes apart whose reports are lost";
        return limit(cause, "add --set airspace.shield=on");
    }
    if matches!(world.method, MethodKind::External) {
        let cause = "a caller orders the maneuvers (method = \"external\"), and there is none";
        return limit(cause, "add --set airspace.method=pc, or another method");
    }
    if world.has_commands() {
        let cause = "the method may command levels or speeds, which others would have to be told";
        let remedy = "leave out level_changes_m and speed_changes_m_s; of method mvp take resolution = \"heading\"";
        return limit(cause, remedy);
    }
    if !world.later_rules.is_empty() {
        return limit(
            "rules change during the flight (airspace.changes)",
            "leave airspace.changes out",
        );
    }
    Ok(())
}

/// Checks that all airplanes are there from the start, and keep their levels and speeds.
fn check_airplanes(world: &AirspaceWorld) -> Result<(), FlightLimit> {
    for (i, airplane) in world.airplanes.iter().enumerate() {
        let name = world.display_name(i as u32);
        if airplane.track.is_some() || airplane.is_non_cooperative {
            let cause =
                format!("airplane {name} follows a track, or is non-cooperative: it has no node");
            return limit(cause, "leave it out");
        }
        if world.appearance_cycle(i) > 0 {
            let cause =
                format!("airplane {name} appears later, and all have to be there at the start");
            return limit(cause, "leave out appears_s, or start a flight of its own for it");
        }
        if !airplane.orders.is_empty() || airplane.leaves_s.is_finite() {
            let cause =
                format!("airplane {name} has orders, of which others would have to be told");
            return limit(cause, "leave out its orders");
        }
    }
    Ok(())
}

/// Checks that an airplane's reference is known beforehand.
fn check_air(world: &AirspaceWorld) -> Result<(), FlightLimit> {
    if world.wind_field.is_some() || world.gusts.is_some() {
        let cause = "the wind differs from place to place, or has gusts";
        let remedy = "give one wind for all (airspace.wind_m_s); what the vehicles meet beyond it is an error \
                      of position, for which the shield allows by the key nic";
        return limit(cause, remedy);
    }
    let has_noise = (0..world.airplanes.len()).any(|i| world.position_noise_m(i) > 0.0);
    if has_noise || world.disturbance.heading_rad > 0.0 {
        let cause = "errors of position or heading are simulated, and real ones come on top";
        let remedy = "leave out position_noise_m, heading_noise_deg and nac_p; nic says for which errors the shield \
                      allows";
        return limit(cause, remedy);
    }
    if world.surveillance.is_some() {
        let cause =
            "airplanes see each other by simulated surveillance, and here they report themselves";
        return limit(cause, "leave out [airspace.surveillance]");
    }
    Ok(())
}

/// Checks that a report reaches all, and that a cycle has room for it and for the conversations.
fn check_network(world: &AirspaceWorld) -> Result<(), FlightLimit> {
    let Some(network) = &world.network else {
        let cause = "the network loses nothing, so that plans hold only if all fly them";
        return limit(cause, "add a section [airspace.network]");
    };
    if network.range_m.is_finite() || network.budget.is_some() {
        let cause = "the radio has a range or a budget, and each report has to reach all";
        return limit(cause, "leave out range_m and budget_bytes_s of [airspace.network]");
    }
    let dt_s = world.timing.dt_s;
    let max_s = TimeShares::DEFAULT.conversations * dt_s / 2.0;
    // Rounding: a scenario may give just that.
    if network.deadline_s > max_s * (1.0 + 1e-9) {
        let cause = format!(
            "a conversation takes up to {} s, and of a cycle of {dt_s} s two of them have {} s",
            network.deadline_s,
            2.0 * max_s
        );
        return limit(cause, format!("add --set airspace.network.deadline_s={max_s}"));
    }
    Ok(())
}
