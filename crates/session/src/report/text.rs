//! Numbers as text.

use sidestep_kernel::text::group_thousands;

/// Returns a number with groups of digits that stay on one line.
pub(super) fn format_count(number: u64) -> String {
    group_thousands(number).replace(' ', "\u{a0}")
}

/// Returns a duration in a form for people: `0.83 s`, `4 min 12 s`, `2 h 05 min`.
pub fn format_duration(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{seconds:.2} s"),
        60..3600 => format!("{} min {:02} s", whole / 60, whole % 60),
        _ => format!("{} h {:02} min", whole / 3600, whole % 3600 / 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_are_said_in_fitting_units() {
        assert_eq!(format_duration(0.834), "0.83 s");
        assert_eq!(format_duration(252.4), "4 min 12 s");
        assert_eq!(format_duration(7500.0), "2 h 05 min");
    }
}
