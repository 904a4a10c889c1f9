//! The values of the arguments of commands.

use std::fmt;
use std::ops::RangeInclusive;

use super::speed::Airspeed;
use crate::local_plane::{LatLon, wrap_deg};
use crate::table::Token;
use sidestep_kernel::InputError;

/// The arguments of one command, read from the left.
pub(super) struct Arguments<'a> {
    /// The name of the file in errors.
    pub(super) place: &'a dyn fmt::Display,
    /// Name of the command, where errors about a missing argument point.
    pub(super) command: Token<'a>,
    words: std::vec::IntoIter<Token<'a>>,
}

impl<'a> Arguments<'a> {
    pub(super) fn new(
        place: &'a dyn fmt::Display,
        command: Token<'a>,
        words: Vec<Token<'a>>,
    ) -> Self {
        Self { place, command, words: words.into_iter() }
    }

    /// Takes the next argument; `None` where it is left out, is `*`, or the line ends.
    pub(super) fn next(&mut self) -> Option<Token<'a>> {
        self.words.next().filter(|word| !word.text.is_empty() && word.text != "*")
    }

    /// Takes the next argument, called `what` in errors.
    pub(super) fn required(&mut self, what: &str) -> Result<Token<'a>, InputError> {
        self.next().ok_or_else(|| {
            let cause = format!("{} lacks {what}", self.command.text);
            self.command.error(self.place, cause, &format!("add {what}"))
        })
    }

    /// Takes the next argument, also one that is left out; `None` where the line ends.
    pub(super) fn take(&mut self) -> Option<Token<'a>> {
        self.words.next()
    }

    pub(super) fn remaining(&self) -> usize {
        self.words.len()
    }

    /// Returns whether an argument follows that is not left out.
    pub(super) fn has_further(&self) -> bool {
        self.words.as_slice().iter().any(|word| !word.text.is_empty() && word.text != "*")
    }

    /// Takes all arguments, where a command has used their text.
    pub(super) fn skip_all(&mut self) {
        self.words = Vec::new().into_iter();
    }

    /// Returns an error that points at a word.
    pub(super) fn error(&self, word: Token, cause: String, remedy: &str) -> InputError {
        word.error(self.place, cause, remedy)
    }

    /// Returns the next argument without taking it.
    pub(super) fn peek(&self) -> Option<&'a str> {
        self.words.as_slice().first().map(|word| word.text)
    }

    /// Takes the next argument as `parse` reads it, where it is not left out.
    pub(super) fn optional<T>(
        &mut self,
        parse: impl Fn(&dyn fmt::Display, Token) -> Result<T, InputError>,
    ) -> Result<Option<T>, InputError> {
        self.next().map(|word| parse(self.place, word)).transpose()
    }

    pub(super) fn lat_lon(&mut self) -> Result<LatLon, InputError> {
        let latitude = self.required("a latitude")?;
        let lat_deg = degrees(self.place, latitude, LATITUDE)?;
        let longitude = self.required("a longitude after the latitude")?;
        Ok(LatLon { lat_deg, lon_deg: degrees(self.place, longitude, LONGITUDE)? })
    }
}

/// The letters and the range of a coordinate.
#[derive(Clone, Copy)]
struct CoordinateAxis {
    positive: char,
    negative: char,
    max_deg: f64,
}

const LATITUDE: CoordinateAxis = CoordinateAxis { positive: 'N', negative: 'S', max_deg: 90.0 };
const LONGITUDE: CoordinateAxis = CoordinateAxis { positive: 'E', negative: 'W', max_deg: 360.0 };

/// The range of altitudes, in ft; true airspeeds are finite at all of them.
const ALTITUDES_FT: RangeInclusive<f64> = -10_000.0..=300_000.0;

/// The range of vertical speeds, in ft/min: faster than any rocket, and slower than any instrument shows.
const VERTICAL_SPEEDS_FPM: RangeInclusive<f64> = 0.001..=1_000_000.0;

/// The range of the protected zone's radius, in nautical miles.
pub(super) const ZONE_RADII_NM: RangeInclusive<f64> = 0.000_1..=500.0;

/// The range of half the height of the protected zone, in ft: levels nearer than a meter are one for any
/// altimeter.
pub(super) const ZONE_HALF_HEIGHTS_FT: RangeInclusive<f64> = 3.3..=1_000_000.0;

const MAX_SPEED_KT: f64 = 10_000.0;
const MAX_MACH: f64 = 20.0;

/// Separators of degrees, minutes and seconds.
const DEGREE_SIGNS: [char; 3] = ['\'', '"', '°'];

/// Returns whether a word is meant as a latitude and not as a name, because names have other letters.
pub(super) fn is_latitude(word: &str) -> bool {
    let is_sign = |c: char| c.is_ascii_digit() || DEGREE_SIGNS.contains(&c) || "+-.".contains(c);
    // The exponent's letter stands between digits, that of the hemisphere at an end.
    let trimmed = word.trim_matches(['N', 'S', 'n', 's']);
    trimmed.contains(|c: char| c.is_ascii_digit())
        && trimmed.chars().all(|c| is_sign(c) || "eE".contains(c))
        && !trimmed.starts_with(['e', 'E'])
}

/// Reads degrees with a fraction, or `degrees'minutes'seconds`; a sign or a letter of the
/// hemisphere in front or at the end.
fn degrees(place: &dyn fmt::Display, word: Token, axis: CoordinateAxis) -> Result<f64, InputError> {
    let value = signed_degrees(word.text, axis).filter(|deg| deg.abs() <= axis.max_deg);
    let value = value.ok_or_else(|| {
        let CoordinateAxis { positive, negative, max_deg } = axis;
        let cause = format!("`{}` are no degrees {positive} or {negative}", word.text);
        let remedy = format!("write up to {max_deg}, as 12.5, -12.5, {negative}12.5 or 12'30'00");
        word.error(place, cause, &remedy)
    })?;
    // Longitudes are also counted from 0 to 360.
    Ok(if value.abs() > 180.0 { wrap_deg(value) } else { value })
}

fn signed_degrees(text: &str, axis: CoordinateAxis) -> Option<f64> {
    let mut hemisphere = 1.0;
    let mut rest = text;
    if let Some(number) = strip_letter(text, axis.positive) {
        rest = number;
    } else if let Some(number) = strip_letter(text, axis.negative) {
        rest = number;
        hemisphere = -1.0;
    }
    let mut sign = 1.0;
    if let Some(number) = rest.strip_prefix('-') {
        rest = number;
        sign = -1.0;
    } else if let Some(number) = rest.strip_prefix('+') {
        rest = number;
    }
    Some(hemisphere * sign * unsigned_degrees(rest)?)
}

/// Removes a letter of a hemisphere, capital or small, at the start or the end.
fn strip_letter(text: &str, letter: char) -> Option<&str> {
    let both = [letter, letter.to_ascii_lowercase()];
    text.strip_prefix(both).or_else(|| text.strip_suffix(both))
}

fn unsigned_degrees(text: &str) -> Option<f64> {
    let text = text.strip_suffix(DEGREE_SIGNS).unwrap_or(text);
    let mut value = 0.0;
    for (i, part) in text.split(DEGREE_SIGNS).enumerate() {
        let unit = *[1.0, 60.0, 3600.0].get(i)?;
        let number = part.parse::<f64>().ok().filter(|number| *number >= 0.0)?;
        // Not `<= 60`, because 60 minutes are a degree. Infinity is not a number of degrees.
        if !number.is_finite() || (i > 0 && number >= 60.0) {
            return None;
        }
        value += number / unit;
    }
    Some(value)
}

/// Reads a heading or a wind direction in degrees from true north, in [0, 360).
pub(super) fn heading_deg(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    let text = word.text.strip_suffix(['T', 't']).unwrap_or(word.text);
    let value = Token { text, ..word }.number(place).map_err(|_| {
        let cause = format!("`{}` is no true heading", word.text);
        word.error(place, cause, "write degrees from true north such as 326.8 or 326.8T")
    })?;
    let wrapped = value.rem_euclid(360.0);
    // rem_euclid may round up to the modulus itself, which is outside the range.
    Ok(if wrapped >= 360.0 { 0.0 } else { wrapped })
}

/// Reads an altitude in ft: a number, or a flight level such as `FL200`.
pub(super) fn altitude_ft(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    let level = word.text.get(..2).filter(|start| start.eq_ignore_ascii_case("FL"));
    let (text, unit_ft) = level.map_or((word.text, 1.0), |_| (&word.text[2..], 100.0));
    let value = Token { text, ..word }.number(place).map_err(|_| {
        let cause = format!("`{}` is no altitude", word.text);
        word.error(place, cause, "write feet such as 20000, or a flight level such as FL200")
    })?;
    if !ALTITUDES_FT.contains(&(value * unit_ft)) {
        let cause = format!("`{}` is out of the air", word.text);
        return Err(word.error(place, cause, "write an altitude from -10000 to 300000 ft"));
    }
    Ok(value * unit_ft)
}

/// Reads a speed: knots, or a Mach number as `.8`, `M0.8`, `M.8` or `M80`.
pub(super) fn speed(place: &dyn fmt::Display, word: Token) -> Result<Airspeed, InputError> {
    parse_speed(word.text).ok_or_else(|| {
        let cause = format!("`{}` is no speed", word.text);
        word.error(place, cause, "write knots such as 250, or a Mach number such as M0.8")
    })
}

fn parse_speed(text: &str) -> Option<Airspeed> {
    if let Some(mach) = text.strip_prefix(['M', 'm']) {
        // Without a point the digits are decimals.
        let digits = if mach.contains('.') { mach.to_owned() } else { format!(".{mach}") };
        let mach: f64 = digits.parse().ok()?;
        return (0.0..=MAX_MACH).contains(&mach).then_some(Airspeed::Mach(mach));
    }
    let value: f64 = text.parse().ok()?;
    if !(0.0..=MAX_SPEED_KT).contains(&value) {
        return None;
    }
    // No aircraft flies at less than a knot, so a number below 1 is meant as a Mach number.
    let is_mach = 0.1 < value && value < 1.0;
    Some(if is_mach { Airspeed::Mach(value) } else { Airspeed::CasKt(value) })
}

/// Reads a number that must be greater than 0.
pub(super) fn positive(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    let value = word.number(place)?;
    if value > 0.0 {
        return Ok(value);
    }
    Err(word.error(place, format!("{value} is not larger than 0"), "write a number such as 5"))
}

/// Reads a vertical speed in ft/min, up or down, or 0 for none.
pub(super) fn vertical_speed_fpm(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    let value = word.number(place)?;
    if value == 0.0 || VERTICAL_SPEEDS_FPM.contains(&value.abs()) {
        return Ok(value);
    }
    let low = VERTICAL_SPEEDS_FPM.start();
    let high = VERTICAL_SPEEDS_FPM.end();
    let cause = format!("a vertical speed of {value:?} ft/min");
    Err(word.error(place, cause, &format!("write {low} to {high} ft/min, up or down, or 0")))
}

pub(super) fn zone_size(
    place: &dyn fmt::Display,
    word: Token,
    range: &RangeInclusive<f64>,
    unit: &str,
) -> Result<f64, InputError> {
    let value = word.number(place)?;
    if range.contains(&value) {
        return Ok(value);
    }
    let cause = format!("a zone of {value:?} {unit}");
    Err(word.error(place, cause, &format!("write {} to {} {unit}", range.start(), range.end())))
}

/// Reads a time in s: `90`, `1:30` or `0:01:30`.
pub(super) fn duration_s(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    parse_duration_s(word.text).ok_or_else(|| {
        let cause = format!("`{}` is no time", word.text);
        word.error(place, cause, "write seconds such as 90, or 00:01:30")
    })
}

fn parse_duration_s(text: &str) -> Option<f64> {
    let mut value_s = 0.0;
    for (k, part) in text.split(':').rev().enumerate() {
        let unit_s = *[1.0, 60.0, 3600.0].get(k)?;
        let number = if k > 0 && part.is_empty() { 0.0 } else { part.parse::<f64>().ok()? };
        value_s += number * unit_s;
    }
    (0.0..=MAX_DURATION_S).contains(&value_s).then_some(value_s)
}

/// The longest time that a command may give, in s: six weeks.
const MAX_DURATION_S: f64 = 1000.0 * 3600.0;

/// Reads any number.
pub(super) fn number(place: &dyn fmt::Display, word: Token) -> Result<f64, InputError> {
    word.number(place)
}

/// Reads `ON` or `OFF`.
pub(super) fn on_off(place: &dyn fmt::Display, word: Token) -> Result<bool, InputError> {
    match word.text.to_ascii_uppercase().as_str() {
        "ON" | "TRUE" | "YES" | "1" => Ok(true),
        "OFF" | "FALSE" | "NO" | "0" => Ok(false),
        _ => {
            let cause = format!("`{}` is neither ON nor OFF", word.text);
            Err(word.error(place, cause, "write ON or OFF"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn word(text: &str) -> Token<'_> {
        Token { text, line: 3, column: 7 }
    }

    #[test]
    fn degrees_have_many_forms() {
        for (text, expected) in [
            ("0.", 0.0),
            ("52", 52.0),
            ("-3.06e-17", -3.06e-17),
            (".5", 0.5),
            ("52'12'36", 52.21),
            ("52°12'36\"", 52.21),
            ("-0'30", -0.5),
            ("N52'30", 52.5),
            ("52.5n", 52.5),
            ("S33.5", -33.5),
            ("33'30'00S", -33.5),
        ] {
            let value = degrees(&"f", word(text), LATITUDE).unwrap();
            assert!((value - expected).abs() < 1e-12, "{text}: {value}");
            assert!(is_latitude(text), "{text}");
        }
        for (text, expected) in
            [("004'48'36", 4.81), ("W004", -4.0), ("4e", 4.0), ("1e1", 10.0), ("359.5", -0.5)]
        {
            let value = degrees(&"f", word(text), LONGITUDE).unwrap();
            assert!((value - expected).abs() < 1e-12, "{text}: {value}");
        }
    }

    #[test]
    fn what_is_no_degrees_is_an_error_with_its_place() {
        for text in ["91", "12'60", "1'2'3'4", "--5", "N", "5W", "inf", "1e999", "'", "12'-3"] {
            let error = degrees(&"f.scn", word(text), LATITUDE).unwrap_err();
            assert_eq!(error.line_and_column(), Some((3, 7)), "{text}");
        }
    }

    #[test]
    fn names_of_places_are_no_latitudes() {
        for name in ["EHAM", "SPL46", "R1814", "EHAM/RW18L", "NENEM", "SES", "E5", "4X062", "N"] {
            assert!(!is_latitude(name), "{name}");
        }
    }

    #[test]
    fn headings_are_true_and_within_a_turn() {
        for (text, expected) in
            [("326.8T", 326.8), ("030", 30.0), ("360", 0.0), ("-90.0", 270.0), ("-1e-20", 0.0)]
        {
            assert_eq!(heading_deg(&"f", word(text)), Ok(expected), "{text}");
        }
        assert!(heading_deg(&"f", word("326M")).unwrap_err().remedy().contains("true north"));
    }

    #[test]
    fn altitudes_are_feet_or_flight_levels() {
        for (text, expected) in
            [("FL200", 20_000.0), ("Fl100", 10_000.0), ("0.", 0.0), ("7169.0", 7169.0)]
        {
            assert_eq!(altitude_ft(&"f", word(text)), Ok(expected), "{text}");
        }
        for text in ["FL", "F200", "high", "é€", "FL9999", "-1e5", "1e300"] {
            assert!(altitude_ft(&"f", word(text)).is_err(), "{text}");
        }
    }

    #[test]
    fn vertical_speeds_and_zones_are_those_of_aircraft() {
        for fpm in ["0", "-1500", "0.5", "1e6"] {
            assert!(vertical_speed_fpm(&"f", word(fpm)).is_ok(), "{fpm}");
        }
        for fpm in ["1e300", "-1e7", "1e-300", "up"] {
            assert!(vertical_speed_fpm(&"f", word(fpm)).is_err(), "{fpm}");
        }
        for (text, range, is_right) in [
            ("5", ZONE_RADII_NM, true),
            ("600", ZONE_RADII_NM, false),
            ("-5", ZONE_RADII_NM, false),
            ("0", ZONE_RADII_NM, false),
            ("1000", ZONE_HALF_HEIGHTS_FT, true),
            ("1", ZONE_HALF_HEIGHTS_FT, false),
            ("1e300", ZONE_HALF_HEIGHTS_FT, false),
        ] {
            let found = zone_size(&"f.scn", word(text), &range, "u");
            assert_eq!(found.is_ok(), is_right, "{text}");
        }
    }

    #[test]
    fn speeds_below_one_or_with_an_m_are_mach_numbers() {
        for text in ["M0.8", "M.8", "m80", "M8", ".8", "0.80"] {
            assert_eq!(speed(&"f", word(text)), Ok(Airspeed::Mach(0.8)), "{text}");
        }
        assert_eq!(speed(&"f", word("M1.2")), Ok(Airspeed::Mach(1.2)));
        for (text, knots) in [("250", 250.0), ("0", 0.0), ("1", 1.0), ("0.05", 0.05)] {
            assert_eq!(speed(&"f", word(text)), Ok(Airspeed::CasKt(knots)), "{text}");
        }
        for text in ["M", "fast", "-250", "inf", "M-1", "1e5", "M99.9", "M1e3"] {
            assert!(speed(&"f", word(text)).is_err(), "{text}");
        }
    }
}
