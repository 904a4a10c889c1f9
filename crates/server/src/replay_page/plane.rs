//! Columns of numbers over time as few bytes: rounded or counted, predicted, and sorted by significance for the deflate
//! that follows.
//!
//! A *plane* has a number of channels, for instance the coordinates of all bodies, and a value of each at some times:
//! ```text
//! u8 mode      0 raw: f32 of each channel and time, channel by channel
//!              1 scaled: i8 exponent e, then whole numbers n; the values are n * 2^e
//!              2 listed: u32 count, f32 of each value, then whole numbers: indices in that list
//! whole numbers:
//!   u8 order   1: differences from the value before; 2: from the line through the two values before
//!   u8 width   bytes of a difference
//!   u8 shared  1: u32 for each channel follows, 0 or 1 + the number of an earlier channel with the same values
//!   u32        for each channel of its own: the first value, as the zigzag of its difference from the channel before
//!   u8         for each byte of a difference from the lowest on, each channel of its own, and each later time
//! ```
//! A zigzag of a whole number n is 2n, or -2n - 1 below 0. Differences wrap at 32 bits.

use std::collections::BTreeMap;

/// Maximum number of different values that are listed instead of scaled: more would not be fewer bytes.
const MAX_LISTED: usize = 1024;
/// Maximum size of a whole number in bits, so that its differences fit 32 bits.
const MAX_WHOLE_BITS: i32 = 29;

/// Returns the plane of some channels; `values` are those of all channels at each time, and `finest` is the exponent of
/// the finest step that matters.
pub(super) fn encode(values: &[&[f32]], finest: i8) -> Vec<u8> {
    let is_finite = values.iter().all(|row| row.iter().all(|value| value.is_finite()));
    if !is_finite {
        return raw_plane(values);
    }
    let exact = exact_exponent(values);
    if exact >= finest.into()
        && let Some(plane) = scaled_plane(values, exact)
    {
        return plane;
    }
    if let Some(plane) = listed_plane(values) {
        return plane;
    }
    let exponent = coarsest_needed(values).max(finest.into());
    scaled_plane(values, exponent).unwrap_or_else(|| raw_plane(values))
}

/// Returns the exponent of the finest step with which all values are whole numbers of the largest size or below; `f32`
/// is coarser there.
fn coarsest_needed(values: &[&[f32]]) -> i32 {
    let largest =
        values.iter().copied().flatten().fold(0.0_f32, |most, value| most.max(value.abs()));
    let biased = (largest.to_bits() >> 23 & 0xff) as i32;
    biased - 126 - MAX_WHOLE_BITS
}

fn channels(values: &[&[f32]]) -> usize {
    values.first().map_or(0, |row| row.len())
}

fn raw_plane(values: &[&[f32]]) -> Vec<u8> {
    let mut out = vec![0];
    for channel in 0..channels(values) {
        values.iter().for_each(|row| out.extend(row[channel].to_le_bytes()));
    }
    out
}

/// Returns the exponent of the largest step of which all values are multiples; at most 0, which is enough for whole
/// numbers.
fn exact_exponent(values: &[&[f32]]) -> i32 {
    let mut exponent = 0;
    for value in values.iter().copied().flatten().filter(|value| **value != 0.0) {
        let bits = value.to_bits();
        let biased = (bits >> 23 & 0xff) as i32;
        let mantissa = bits & 0x7f_ffff | if biased > 0 { 1 << 23 } else { 0 };
        exponent = exponent.min(biased.max(1) - 150 + mantissa.trailing_zeros() as i32);
    }
    exponent
}

/// Returns a plane of multiples of 2^exponent; none if a value is too large for it.
fn scaled_plane(values: &[&[f32]], exponent: i32) -> Option<Vec<u8>> {
    // Below this, the step itself would be no normal number; such values are listed or raw.
    if exponent < -100 {
        return None;
    }
    let step = power_of_two(exponent);
    let max_whole = power_of_two(MAX_WHOLE_BITS);
    let mut rows = Vec::with_capacity(values.len());
    for row in values {
        let whole: Vec<f32> = row.iter().map(|value| (value / step).round()).collect();
        if whole.iter().any(|n| n.abs() > max_whole) {
            return None;
        }
        rows.push(whole.into_iter().map(|n| n as i32).collect());
    }
    let mut out = vec![1, exponent as i8 as u8];
    push_whole_numbers(&mut out, &rows);
    Some(out)
}

fn power_of_two(exponent: i32) -> f32 {
    f32::from_bits(((exponent + 127) as u32) << 23)
}

/// Returns a plane of indices in a list of all values; none if there are too many.
fn listed_plane(values: &[&[f32]]) -> Option<Vec<u8>> {
    let mut index_of: BTreeMap<u32, i32> = BTreeMap::new();
    let mut listed = Vec::new();
    let mut rows = Vec::with_capacity(values.len());
    for row in values {
        let mut indices = Vec::with_capacity(row.len());
        for value in *row {
            let index = *index_of.entry(value.to_bits()).or_insert_with(|| {
                listed.push(*value);
                listed.len() as i32 - 1
            });
            indices.push(index);
        }
        if listed.len() > MAX_LISTED {
            return None;
        }
        rows.push(indices);
    }
    let mut out = vec![2];
    out.extend((listed.len() as u32).to_le_bytes());
    listed.iter().for_each(|value| out.extend(value.to_le_bytes()));
    push_whole_numbers(&mut out, &rows);
    Some(out)
}

fn push_whole_numbers(out: &mut Vec<u8>, rows: &[Vec<i32>]) {
    let count = rows.first().map_or(0, Vec::len);
    let series: Vec<Vec<i32>> =
        (0..count).map(|channel| rows.iter().map(|row| row[channel]).collect()).collect();
    let shared = shared_channels(&series);
    let own: Vec<&[i32]> =
        series.iter().zip(&shared).filter(|(_, of)| **of == 0).map(|(all, _)| &all[..]).collect();
    let (order, differences) = best_differences(&own);
    let widest = differences.iter().flatten().copied().max().unwrap_or(0);
    let width = (4 - widest.leading_zeros() as usize / 8).max(1);
    let is_shared = own.len() < count;
    out.extend([order, width as u8, u8::from(is_shared)]);
    if is_shared {
        shared.iter().for_each(|of| out.extend(of.to_le_bytes()));
    }
    let mut before = 0_i32;
    for all in &own {
        let first = all.first().copied().unwrap_or(0);
        out.extend(zigzag(first.wrapping_sub(before)).to_le_bytes());
        before = first;
    }
    for byte in 0..width {
        for channel in &differences {
            out.extend(channel.iter().map(|difference| (difference >> (8 * byte)) as u8));
        }
    }
}

/// Returns, for each channel, 0 or 1 + the number of the first channel with the same values.
fn shared_channels(series: &[Vec<i32>]) -> Vec<u32> {
    let mut first_with: BTreeMap<&[i32], u32> = BTreeMap::new();
    let mut shared = Vec::with_capacity(series.len());
    for (number, all) in (1_u32..).zip(series) {
        let of = *first_with.entry(all).or_insert(number);
        shared.push(if of == number { 0 } else { of });
    }
    shared
}

/// Returns the better of the two orders of differences, and the differences from the second time on.
fn best_differences(own: &[&[i32]]) -> (u8, Vec<Vec<u32>>) {
    let first_order: Vec<Vec<u32>> = own.iter().map(|all| differences(all, false)).collect();
    let second_order: Vec<Vec<u32>> = own.iter().map(|all| differences(all, true)).collect();
    let bits = |all: &[Vec<u32>]| -> u64 {
        all.iter().flatten().map(|n| u64::from(32 - n.leading_zeros())).sum()
    };
    if bits(&second_order) < bits(&first_order) { (2, second_order) } else { (1, first_order) }
}

fn differences(all: &[i32], is_second: bool) -> Vec<u32> {
    let mut out = Vec::with_capacity(all.len());
    for time in 1..all.len() {
        let slope =
            if is_second && time > 1 { all[time - 1].wrapping_sub(all[time - 2]) } else { 0 };
        out.push(zigzag(all[time].wrapping_sub(all[time - 1]).wrapping_sub(slope)));
    }
    out
}

fn zigzag(number: i32) -> u32 {
    ((number << 1) ^ (number >> 31)) as u32
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A plane as it is read back: the values of all channels at each time, and its number of bytes.
    pub(in super::super) fn decode(
        bytes: &[u8],
        count: usize,
        times: usize,
    ) -> (Vec<Vec<f32>>, usize) {
        let mut at = 1;
        let mut take = |n: usize| {
            at += n;
            &bytes[at - n..at]
        };
        let word = |bytes: &[u8]| u32::from_le_bytes(bytes.try_into().expect("four bytes"));
        let mut list = Vec::new();
        let mut step = 0.0;
        match bytes[0] {
            0 => {
                let mut out = vec![vec![0.0; count]; times];
                for channel in 0..count {
                    for row in &mut out {
                        row[channel] = f32::from_bits(word(take(4)));
                    }
                }
                return (out, at);
            }
            1 => step = power_of_two((take(1)[0] as i8).into()),
            _ => {
                let listed = word(take(4));
                list.extend((0..listed).map(|_| f32::from_bits(word(take(4)))));
            }
        }
        let order = take(1)[0];
        let width = take(1)[0] as usize;
        let is_shared = take(1)[0] == 1;
        let shared: Vec<u32> =
            (0..count).map(|_| if is_shared { word(take(4)) } else { 0 }).collect();
        let own = shared.iter().filter(|of| **of == 0).count();
        let unzigzag = |n: u32| (n >> 1) as i32 ^ -((n & 1) as i32);
        let mut series = vec![Vec::new(); own];
        let mut before = 0_i32;
        for all in &mut series {
            before = before.wrapping_add(unzigzag(word(take(4))));
            all.push(before);
        }
        let later = times - 1;
        let planes: Vec<&[u8]> = (0..width).map(|_| take(own * later)).collect();
        for (channel, all) in series.iter_mut().enumerate() {
            for time in 0..later {
                let byte = |k: usize| u32::from(planes[k][channel * later + time]) << (8 * k);
                let difference = unzigzag((0..width).map(byte).sum());
                let last = all[time];
                let slope =
                    if order == 2 && time > 0 { last.wrapping_sub(all[time - 1]) } else { 0 };
                all.push(last.wrapping_add(slope).wrapping_add(difference));
            }
        }
        let mut owned = series.into_iter();
        let mut all: Vec<Vec<i32>> = Vec::new();
        for of in shared {
            let one =
                if of == 0 { owned.next().expect("its own") } else { all[of as usize - 1].clone() };
            all.push(one);
        }
        let value = |n: i32| if list.is_empty() { n as f32 * step } else { list[n as usize] };
        let rows =
            (0..times).map(|t| all.iter().map(|series| value(series[t])).collect()).collect();
        (rows, at)
    }

    fn round_trip(rows: &[Vec<f32>], finest: i8) -> (u8, Vec<Vec<f32>>) {
        let values: Vec<&[f32]> = rows.iter().map(|row| &row[..]).collect();
        let bytes = encode(&values, finest);
        let (back, used) = decode(&bytes, rows[0].len(), rows.len());
        assert_eq!(used, bytes.len());
        (bytes[0], back)
    }

    #[test]
    fn places_on_boxes_are_exact() {
        let rows: Vec<Vec<f32>> =
            (0..40).map(|t| vec![0.25 * t as f32, -7.125, 0.25 * t as f32, 0.0]).collect();
        assert_eq!(round_trip(&rows, -12), (1, rows));
    }

    #[test]
    fn places_anywhere_are_exact_to_half_a_step() {
        let rows: Vec<Vec<f32>> =
            (0..2000).map(|t| vec![(t as f32).sqrt() * 31.7, 1e4 / (1.0 + t as f32)]).collect();
        let (mode, back) = round_trip(&rows, -10);
        assert_eq!(mode, 1);
        for (one, other) in rows.iter().flatten().zip(back.iter().flatten()) {
            assert!((one - other).abs() <= 0.0005 + one.abs() * f32::EPSILON, "{one} {other}");
        }
    }

    #[test]
    fn places_far_from_the_origin_stay_whole_numbers_of_a_coarser_step() {
        let rows: Vec<Vec<f32>> =
            (0..2000).map(|t| vec![5.2e6 + 0.5 * t as f32, 0.1 * (t as f32).sqrt()]).collect();
        let (mode, back) = round_trip(&rows, -20);
        assert_eq!(mode, 1);
        for (one, other) in rows.iter().flatten().zip(back.iter().flatten()) {
            assert!((one - other).abs() <= 1.0 / 128.0, "{one} {other}");
        }
    }

    #[test]
    fn few_headings_are_exact_and_what_is_no_number_is_kept_as_it_is() {
        let turns = [0.0, std::f32::consts::FRAC_PI_2, std::f32::consts::PI, -1.570_796_4];
        let rows: Vec<Vec<f32>> =
            (0..30).map(|t| vec![turns[t % 4], turns[3 - t % 4], 0.1]).collect();
        assert_eq!(round_trip(&rows, -16), (2, rows));
        let odd = vec![vec![f32::INFINITY, 1.0], vec![2.0, -3.5]];
        assert_eq!(round_trip(&odd, -16), (0, odd));
        let huge = vec![vec![3e30, 1e-30], vec![1.0, 2.0]];
        assert_eq!(round_trip(&huge, -16), (2, huge));
    }

    #[test]
    fn no_channels_and_one_time_are_planes_too() {
        assert_eq!(round_trip(&[vec![], vec![]], 0), (1, vec![vec![], vec![]]));
        assert_eq!(round_trip(&[vec![4.0, 8.0]], 0), (1, vec![vec![4.0, 8.0]]));
    }
}
