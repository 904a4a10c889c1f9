//! Positions and labels of tick marks.

use libm::{floor, log10, pow};

/// The tick marks of one axis.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Ticks {
    /// Marks with a label.
    pub(crate) major: Vec<(f64, String)>,
    /// Shorter marks without one.
    pub(crate) minor: Vec<f64>,
}

impl Ticks {
    /// Returns labeled marks at exactly these values.
    pub(crate) fn from_values(places: &[f64]) -> Self {
        let mut exact = (0..6).filter(|&digits| places.iter().all(|v| is_exact(*v, digits)));
        let digits = exact.next().unwrap_or(6);
        Self { major: places.iter().map(|&v| (v, label(v, digits))).collect(), minor: vec![] }
    }

    /// Returns marks at the multiples of a 1-2-5 step from `low` to `high`, `most` at most. The slack of
    /// 1e-9 keeps a mark at an end that rounding has moved out of the range.
    pub(crate) fn linear(low: f64, high: f64, most: usize) -> Self {
        let step = nice_step(high - low, most);
        let digits = decimals(step);
        let first = -floor(1e-9 - low / step);
        let count = (floor(high / step + 1e-9) - first).clamp(0.0, 100.0) as u32;
        let values = (0..=count).map(|k| (first + f64::from(k)) * step);
        let major = values.map(|v| (v, label(v, digits))).collect();
        Self { major, minor: vec![] }
    }

    /// Returns marks at the powers of ten, and unlabeled ones at their multiples; if there is room
    /// for more labels, also labeled ones at 2 and 5 times the powers of ten.
    pub(crate) fn log(low: f64, high: f64, most: usize) -> Self {
        let span = DecadeRange { low, high };
        for multiples in [&[1u8, 2, 5][..], &[1, 3], &[1]] {
            let marks = span.multiples(multiples, 1);
            if (2..=most.max(2)).contains(&marks.len()) {
                let minor = span.multiples(&[1, 2, 3, 4, 5, 6, 7, 8, 9], 1);
                return Self { major: log_labels(&marks), minor };
            }
        }
        if log10(high / low) < 1.0 {
            return Self::linear(low, high, most);
        }
        let stride = (span.multiples(&[1], 1).len() / most.max(2) + 1) as i32;
        let minor = if stride > 1 { span.multiples(&[1], 1) } else { vec![] };
        Self { major: log_labels(&span.multiples(&[1], stride)), minor }
    }

    /// Returns the width of the widest label, measured by `width_px`.
    pub(crate) fn max_label_px(&self, width_px: impl Fn(&str) -> f64) -> f64 {
        self.major.iter().map(|(_, label)| width_px(label)).fold(0.0, f64::max)
    }

    /// Returns marks at the middles of rows, each with the name of its row; the first row is the highest.
    pub(crate) fn rows(names: &[String]) -> Self {
        let count = names.len() as f64;
        let middle = |k: usize| count - 0.5 - k as f64;
        // In rising order, as those of other axes.
        let major = names.iter().enumerate().rev().map(|(k, name)| (middle(k), name.clone()));
        Self { major: major.collect(), minor: vec![] }
    }
}

/// Spacing of labels: a label that would touch the one before it is not written.
pub(crate) struct LabelSpacing {
    free_from: f64,
}

impl LabelSpacing {
    pub(crate) fn new() -> Self {
        Self { free_from: f64::NEG_INFINITY }
    }

    /// Returns whether a label `length_px` long around `center_px` has room; if so, that room is taken.
    /// Labels come in rising order.
    pub(crate) fn try_place(&mut self, center_px: f64, length_px: f64) -> bool {
        let fits = center_px - length_px / 2.0 >= self.free_from;
        if fits {
            self.free_from = center_px + length_px / 2.0;
        }
        fits
    }
}

/// A range of positive numbers on a logarithmic axis.
struct DecadeRange {
    low: f64,
    high: f64,
}

impl DecadeRange {
    /// Returns `digits` times every `stride`-th power of ten within the range.
    fn multiples(&self, digits: &[u8], stride: i32) -> Vec<f64> {
        let first = floor(log10(self.low)) as i32;
        let last = floor(log10(self.high)) as i32;
        // The slack keeps a mark at an end that rounding has moved out of the range.
        let inside = self.low * (1.0 - 1e-9)..=self.high * (1.0 + 1e-9);
        (first..=last)
            .filter(|exponent| exponent.rem_euclid(stride) == 0)
            .flat_map(|exponent| digits.iter().map(move |&d| f64::from(d) * power(exponent)))
            .filter(|v| inside.contains(v))
            .collect()
    }
}

/// Returns ten to the power of `exponent`, exact if a double can be.
fn power(exponent: i32) -> f64 {
    if exponent < 0 {
        1.0 / pow(10.0, f64::from(-exponent))
    } else {
        pow(10.0, f64::from(exponent))
    }
}

/// Returns the smallest of 1, 2, 5 times a power of ten that cuts `span` into at most `most` parts.
pub(crate) fn nice_step(span: f64, most: usize) -> f64 {
    let raw = span / most.max(1) as f64;
    let exponent = floor(log10(raw)) as i32;
    let steps = [1.0, 2.0, 5.0].map(|digit| digit * power(exponent));
    let mut enough = steps.into_iter().filter(|step| *step >= raw * (1.0 - 1e-9));
    enough.next().unwrap_or_else(|| power(exponent + 1))
}

/// Returns the number of decimals that multiples of `step` need.
pub(crate) fn decimals(step: f64) -> usize {
    (-floor(log10(step) + 1e-9)).clamp(0.0, 12.0) as usize
}

fn log_labels(marks: &[f64]) -> Vec<(f64, String)> {
    // One form for all labels of an axis: decimals while the longest has at most five digits.
    let is_plain = marks.iter().all(|v| (0.000_999..=10_001.0).contains(v));
    let mut labels = Vec::with_capacity(marks.len());
    for &v in marks {
        labels.push((v, if is_plain { decimal_label(v) } else { scientific(v, 0) }));
    }
    labels
}

/// Returns a value as a decimal number, down to its first digit.
fn decimal_label(value: f64) -> String {
    let exponent = floor(log10(value) + 1e-9) as i32;
    label(value, decimals(power(exponent)))
}

/// Returns `value` with `digits` decimals, or in powers of ten if that would be long.
pub(crate) fn label(value: f64, digits: usize) -> String {
    if value == 0.0 && digits > 5 {
        return "0".into();
    }
    if value.abs() >= 999_999.5 || digits > 5 {
        return scientific(value, 2);
    }
    let number = format!("{:.digits$}", value.abs());
    let (whole, rest) = number.split_at(number.find('.').unwrap_or(number.len()));
    // Up to four digits are readable without separators.
    let whole = if whole.len() > 4 { group_thousands(whole) } else { whole.into() };
    minus(&format!("{}{whole}{rest}", if value < 0.0 { "-" } else { "" }))
}

/// Returns the digits of a number with its thousands separated by spaces: `1 234 567`.
pub(crate) fn group_thousands(digits: &str) -> String {
    let mut grouped = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            grouped.push(' ');
        }
        grouped.push(digit);
    }
    grouped
}

/// Returns `value` as mantissa (at most `digits` decimals) times a power of ten.
fn scientific(value: f64, digits: usize) -> String {
    let exponent = floor(log10(value.abs()) + 1e-9) as i32;
    let mantissa = format!("{:.digits$}", value / power(exponent));
    let mantissa = if mantissa.contains('.') {
        mantissa.trim_end_matches('0').trim_end_matches('.')
    } else {
        &mantissa
    };
    let power = superscript(exponent);
    match mantissa {
        "1" if exponent == 0 => "1".into(),
        "1" if exponent == 1 => "10".into(),
        "1" => format!("10{power}"),
        "-1" => format!("\u{2212}10{power}"),
        _ => minus(&format!("{mantissa}×10{power}")),
    }
}

/// Replaces a leading hyphen by the minus sign it stands for; `-0` loses it.
fn minus(number: &str) -> String {
    match number.strip_prefix('-') {
        Some(rest) if rest.chars().all(|c| matches!(c, '0' | '.')) => rest.to_string(),
        Some(rest) => format!("\u{2212}{rest}"),
        None => number.to_string(),
    }
}

fn superscript(exponent: i32) -> String {
    exponent.to_string().chars().map(raised).collect()
}

/// Returns the superscript of a digit or a minus.
fn raised(c: char) -> char {
    match c {
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        '-' => '⁻',
        // The other superscripts are consecutive: ⁰, ⁴ to ⁹.
        digit => char::from_u32(0x2070 + u32::from(digit) - u32::from('0')).unwrap_or(digit),
    }
}

fn is_exact(value: f64, digits: usize) -> bool {
    format!("{value:.digits$}").parse() == Ok(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &Ticks) -> Vec<&str> {
        ticks.major.iter().map(|(_, label)| label.as_str()).collect()
    }

    #[test]
    fn linear_ticks_are_round_and_inside() {
        assert_eq!(labels(&Ticks::linear(0.0, 1.0, 5)), ["0.0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(&Ticks::linear(-3.0, 7.0, 6)), ["−2", "0", "2", "4", "6"]);
        assert_eq!(labels(&Ticks::linear(0.0, 2.0e6, 2)), ["0", "10⁶", "2×10⁶"]);
        assert_eq!(labels(&Ticks::linear(0.0, 3e-7, 3)), ["0", "10⁻⁷", "2×10⁻⁷", "3×10⁻⁷"]);
    }

    #[test]
    fn thousands_are_set_apart_from_five_digits_on() {
        let last = |most: f64| Ticks::linear(0.0, most, 2).major.pop().map(|(_, label)| label);
        assert_eq!(last(4000.0).as_deref(), Some("4000"));
        assert_eq!(last(300_000.0).as_deref(), Some("200 000"));
        assert_eq!(label(-12_345.5, 1), "−12 345.5");
        let digits = ["0", "123", "1234", "123456", "1234567"].map(group_thousands);
        assert_eq!(digits, ["0", "123", "1 234", "123 456", "1 234 567"]);
    }

    #[test]
    fn log_ticks_are_powers_of_ten_or_finer_where_there_is_room() {
        assert_eq!(labels(&Ticks::log(1.0, 1000.0, 5)), ["1", "10", "100", "1000"]);
        assert_eq!(labels(&Ticks::log(0.1, 2.0, 6)), ["0.1", "0.2", "0.5", "1", "2"]);
        assert_eq!(labels(&Ticks::log(1e-8, 1e4, 4)), ["10⁻⁸", "10⁻⁴", "1", "10⁴"]);
        assert_eq!(labels(&Ticks::log(3.1, 3.4, 4)), ["3.1", "3.2", "3.3", "3.4"]);
        assert_eq!(Ticks::log(1.0, 100.0, 3).minor.len(), 19);
    }

    #[test]
    fn given_ticks_show_all_their_digits_and_no_more() {
        assert_eq!(labels(&Ticks::from_values(&[1.0, 2.0, 8.0])), ["1", "2", "8"]);
        assert_eq!(labels(&Ticks::from_values(&[0.25, 0.5])), ["0.25", "0.50"]);
    }

    #[test]
    fn steps_are_one_two_five() {
        assert_eq!(nice_step(10.0, 5), 2.0);
        assert_eq!(nice_step(11.0, 5), 5.0);
        assert_eq!(nice_step(0.3, 3), 0.1);
        assert_eq!(nice_step(99.0, 10), 10.0);
    }
}
