//! What orders ask of an airplane against what it can fly.

use crate::flight::Performance;

/// A mistake: what is wrong, and what would be right.
pub(crate) type Mistake = (String, String);

/// Returns words for the type of an airplane in errors.
pub(crate) fn of_type(performance: &Performance) -> String {
    match &performance.type_name {
        Some(name) => format!(" of type {name}"),
        None => String::new(),
    }
}

/// Returns the mistake of an order to a speed, if there is one.
pub(crate) fn speed_order_mistake(performance: &Performance, v_m_s: f64) -> Option<Mistake> {
    if performance.allows_speed(v_m_s) {
        return None;
    }
    let cause = format!("an airplane{} that is ordered to {v_m_s} m/s", of_type(performance));
    Some((cause, format!("give a speed_m_s {}", speed_range(performance))))
}

/// A change of level that is ordered.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelChange {
    /// Altitude in meters of the level that it leaves by its orders.
    pub(crate) from_m: f64,
    pub(crate) to_m: f64,
    /// The rate that is ordered, in meters per second, if one is.
    pub(crate) climb_m_s: Option<f64>,
}

/// Returns the mistake of an order to a level, if there is one.
pub(crate) fn level_order_mistake(
    performance: &Performance,
    change: LevelChange,
) -> Option<Mistake> {
    let LevelChange { from_m, to_m, climb_m_s } = change;
    let of_type = of_type(performance);
    if !performance.allows_altitude(to_m) {
        let cause = format!("an airplane{of_type} that is ordered to an altitude of {to_m} m");
        return Some((cause, format!("give an altitude_m {}", altitude_range(performance))));
    }
    let is_climb = to_m > from_m;
    let max_m_s = performance.vertical_max_m_s(is_climb);
    let climb_m_s = climb_m_s.filter(|climb_m_s| *climb_m_s > max_m_s)?;
    let verb = if is_climb { "climb" } else { "descend" };
    let cause = format!("an airplane{of_type} that is ordered to {verb} at {climb_m_s} m/s");
    Some((cause, format!("give a climb_m_s up to {max_m_s}, or leave it out")))
}

pub(crate) fn speed_range(performance: &Performance) -> String {
    range_text(performance.v_min_m_s, performance.v_max_m_s, "m/s")
}

pub(crate) fn altitude_range(performance: &Performance) -> String {
    range_text(performance.floor_m, performance.ceiling_m, "m")
}

/// Returns a range in words, one end of which may be infinite.
fn range_text(from: f64, to: f64, unit: &str) -> String {
    if to == f64::INFINITY {
        format!("from {from} {unit} on")
    } else if from == f64::NEG_INFINITY {
        format!("up to {to} {unit}")
    } else {
        format!("from {from} to {to} {unit}")
    }
}
