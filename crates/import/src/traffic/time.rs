//! Times of recordings: seconds and their fractions since 1970, and dates with times of day.

use chrono::{DateTime, NaiveDate};

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

/// A time as a file writes it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum WrittenTime {
    /// A number since the start of 1970, in a unit that its size tells.
    Unix(f64),
    /// A date and a time of day, in s since the start of 1970.
    Calendar {
        /// The time, as UTC.
        utc_s: f64,
        /// Whether the text has an offset from UTC.
        has_zone: bool,
    },
}

/// A unit of numbers since the start of 1970.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum UnixUnit {
    Seconds,
    Milliseconds,
    Microseconds,
    Nanoseconds,
}

impl UnixUnit {
    /// Returns the unit in which a number of this size is a time of the present: 1e9 s are in the year 2001.
    pub(super) fn of_size(value: f64) -> Self {
        match value.abs() {
            size if size < 1e11 => Self::Seconds,
            size if size < 1e14 => Self::Milliseconds,
            size if size < 1e17 => Self::Microseconds,
            _ => Self::Nanoseconds,
        }
    }

    /// Returns the number of units in a second.
    pub(super) fn per_s(self) -> f64 {
        match self {
            Self::Seconds => 1.0,
            Self::Milliseconds => 1e3,
            Self::Microseconds => 1e6,
            Self::Nanoseconds => 1e9,
        }
    }

    /// Returns its name in the plural.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Seconds => "seconds",
            Self::Milliseconds => "milliseconds",
            Self::Microseconds => "microseconds",
            Self::Nanoseconds => "nanoseconds",
        }
    }
}

/// Reads a number, or a date and a time of day as ISO 8601 and its relatives write them: `2018-08-01T09:00:00Z`,
/// `2018-08-01 09:00:00.5+02:00`, `2018/08/01 09:00`.
pub(super) fn parse_time(text: &str) -> Option<WrittenTime> {
    if let Some(time) = parse_compact(text) {
        return Some(time);
    }
    if let Ok(value) = text.parse::<f64>() {
        return value.is_finite().then_some(WrittenTime::Unix(value));
    }
    if !text.is_ascii() || text.len() < 10 {
        return None;
    }
    let (date, rest) = text.split_at(10);
    let day = parse_date(date)?;
    let rest = rest.strip_prefix(['T', 't', ' ']).unwrap_or(rest).trim();
    let (clock, offset_s) = split_zone(rest)?;
    let time_s = day as f64 * DAY_S + parse_clock(clock)?;
    Some(WrittenTime::Calendar {
        utc_s: time_s - offset_s.unwrap_or(0.0),
        has_zone: offset_s.is_some(),
    })
}

/// Reads the basic form of ISO 8601, `20180801T090000Z`, also without letters: as a count of milliseconds those digits
/// would be six centuries from now.
fn parse_compact(text: &str) -> Option<WrittenTime> {
    let (date, rest) = text.split_at_checked(8)?;
    let clock = rest.strip_prefix(['T', 't', ' ']).unwrap_or(rest);
    let (clock, zone) = clock.split_at_checked(6)?;
    let are_digits = [date, clock].iter().all(|part| part.bytes().all(|b| b.is_ascii_digit()));
    if !are_digits || zone.starts_with(|c: char| c.is_ascii_digit()) {
        return None;
    }
    let date = format!("{}-{}-{}", &date[..4], &date[4..6], &date[6..]);
    let clock = format!("{}:{}:{}", &clock[..2], &clock[2..4], &clock[4..]);
    parse_time(&format!("{date}T{clock}{zone}"))
}

/// Reads a date and a time of day with the day first, `DD-MM-YYYY HH:MM:SS`, of a source that is known to write so.
pub(super) fn parse_day_first(text: &str) -> Option<WrittenTime> {
    let (date, clock) = text.split_at_checked(10)?;
    let (day, month_year) = date.split_once('-')?;
    let (month, year) = month_year.split_once('-')?;
    parse_time(&format!("{year}-{month}-{day}{clock}"))
}

/// Returns the days since 1970-01-01 of `YYYY-MM-DD`, with `-` or `/`.
fn parse_date(text: &str) -> Option<i64> {
    let bytes = text.as_bytes();
    if !matches!((bytes[4], bytes[7]), (b'-', b'-') | (b'/', b'/')) {
        return None;
    }
    days_since_1970(digits(&text[..4])?, digits(&text[5..7])?, digits(&text[8..])?)
}

/// Returns the days from 1970-01-01 to a date of the Gregorian calendar; `None` where there is no such date.
pub(super) fn days_since_1970(year: u32, month: u32, day: u32) -> Option<i64> {
    let date = NaiveDate::from_ymd_opt(i32::try_from(year).ok()?, month, day)?;
    Some(date.signed_duration_since(NaiveDate::default()).num_days())
}

/// Returns a clock without its offset from UTC, and the offset in s; `None` for an offset that is none.
fn split_zone(text: &str) -> Option<(&str, Option<f64>)> {
    let universal = ["Z", "z", "UTC", "GMT"].iter().find_map(|zone| text.strip_suffix(zone));
    if let Some(clock) = universal {
        return Some((clock.trim_end(), Some(0.0)));
    }
    let Some(at) = text.rfind(['+', '-']) else {
        return Some((text, None));
    };
    let sign = if text.as_bytes()[at] == b'-' { -1.0 } else { 1.0 };
    let offset = &text[at + 1..];
    let (hours, minutes) = match offset.len() {
        2 => (offset, "00"),
        4 => offset.split_at(2),
        5 if offset.as_bytes()[2] == b':' => (&offset[..2], &offset[3..]),
        _ => return None,
    };
    let offset_s = f64::from(digits(hours)?) * 3600.0 + f64::from(digits(minutes)?) * 60.0;
    Some((text[..at].trim_end(), Some(sign * offset_s)))
}

/// Returns the seconds since midnight of `HH:MM`, `HH:MM:SS` or `HH:MM:SS.fff`; 0 for an empty text.
fn parse_clock(text: &str) -> Option<f64> {
    if text.is_empty() {
        return Some(0.0);
    }
    let mut parts = text.split(':');
    let hours = digits(parts.next()?)?;
    let minutes = digits(parts.next()?)?;
    let seconds: f64 = match parts.next() {
        None => 0.0,
        Some(text) if text.starts_with(|c: char| c.is_ascii_digit()) => {
            text.replace(',', ".").parse().ok()?
        }
        Some(_) => return None,
    };
    let is_clock = hours <= 24 && minutes < 60 && (0.0..61.0).contains(&seconds);
    (is_clock && parts.next().is_none())
        .then(|| f64::from(hours) * 3600.0 + f64::from(minutes) * 60.0 + seconds)
}

/// Returns a number of one to four digits.
fn digits(text: &str) -> Option<u32> {
    let is_number = (1..=4).contains(&text.len()) && text.bytes().all(|b| b.is_ascii_digit());
    is_number.then(|| text.parse().ok()).flatten()
}

/// Returns a time in s since 1970 as ISO 8601 in UTC: `2018-08-01T09:00:00Z`, with tenths of a second where it has any.
pub fn format_utc(time_s: f64) -> String {
    let tenths = (time_s * 10.0).round();
    // Beyond that the cast would saturate.
    let is_time = tenths.abs() < 1e17;
    let time = DateTime::from_timestamp((tenths as i64).div_euclid(10), 0).filter(|_| is_time);
    let Some(time) = time else {
        return format!("{time_s:e} s since 1970");
    };
    let fraction = match (tenths as i64).rem_euclid(10) {
        0 => String::new(),
        tenth => format!(".{tenth}"),
    };
    format!("{}{fraction}Z", time.format("%Y-%m-%dT%H:%M:%S"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn utc_s(text: &str) -> Option<f64> {
        match parse_time(text)? {
            WrittenTime::Calendar { utc_s, .. } => Some(utc_s),
            WrittenTime::Unix(_) => None,
        }
    }

    #[test]
    fn one_instant_has_many_spellings() {
        for text in [
            "2018-08-01T09:00:00Z",
            "2018-08-01 09:00:00+00:00",
            "2018-08-01 11:00:00+0200",
            "2018-08-01T04:30:00.000-04:30",
            "2018-08-01T09:00:00,0Z",
            "2018/08/01 09:00",
            "2018-08-01 09:00:00 UTC",
            "2018-08-01 09:00:00 GMT",
            "20180801T090000Z",
            "20180801T110000.0+0200",
            "20180801090000",
        ] {
            assert_eq!(utc_s(text), Some(1_533_114_000.0), "{text}");
        }
        assert_eq!(parse_time("1533114000.5"), Some(WrittenTime::Unix(1_533_114_000.5)));
        let without = parse_time("2018-08-01 09:00:00");
        assert!(matches!(without, Some(WrittenTime::Calendar { has_zone: false, .. })));
    }

    #[test]
    fn what_is_no_time_is_none() {
        for text in [
            "",
            "x",
            "nan",
            "inf",
            "2018-13-01T00:00:00Z",
            "2018-02-29T00:00:00Z",
            "2018-08-01T25:00:00Z",
            "2018-08-01T09:61:00Z",
            "2018-08-01T09:00:99Z",
            "2018-08-01Tx",
            "2018-08-01T09:00:-1",
            "2018-08-01T09:00:00+1:0",
            "2018-08-0\u{e9}T09",
            "09:00:00",
            "20180801T0900",
        ] {
            assert_eq!(parse_time(text), None, "{text}");
        }
    }

    #[test]
    fn the_unit_of_a_number_is_that_in_which_it_is_a_time_of_the_present() {
        for unit in [
            UnixUnit::Seconds,
            UnixUnit::Milliseconds,
            UnixUnit::Microseconds,
            UnixUnit::Nanoseconds,
        ] {
            assert_eq!(UnixUnit::of_size(1_533_114_000.0 * unit.per_s()), unit);
        }
    }

    proptest::proptest! {
        #[test]
        fn a_time_that_is_written_is_read_back(tenths in -600_000_000_000_i64..600_000_000_000) {
            let time_s = tenths as f64 / 10.0;
            proptest::prop_assert_eq!(utc_s(&format_utc(time_s)), Some(time_s));
        }

        #[test]
        fn any_text_is_a_time_or_none(text in "\\PC{0,30}") {
            let _ = parse_time(&text);
        }
    }
}
