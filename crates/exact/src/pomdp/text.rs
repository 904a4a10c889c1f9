//! A POMDP as text in Cassandra's POMDP file format, which dictates the keywords and the order of the lines:
//! <https://www.pomdp.org/code/pomdp-file-spec.html>.

use super::Pomdp;
use std::fmt;

impl fmt::Display for Pomdp {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "# {}: one robot, computed exactly from its tables.", self.place)?;
        writeln!(f, "# State c3r4-east: lower-left box in column 3, row 4, heading east; behind")?;
        writeln!(f, "# it side and kind of the contact, if the last action ended in one.\n")?;
        // The preamble, whose lines the format wants before all others; values may be rewards or costs.
        writeln!(f, "discount: {}\nvalues: reward", self.discount)?;
        writeln!(f, "states: {}", self.states.join(" "))?;
        writeln!(f, "actions: {}", self.actions.join(" "))?;
        writeln!(f, "observations: {}", self.observations.join(" "))?;
        writeln!(f, "start: {}\n", self.states[0])?;
        // T: action : from : to probability. Entries that a file does not have are 0, so only the others are written.
        for (state, from) in self.states.iter().enumerate() {
            for (action, name) in self.actions.iter().enumerate() {
                let row = self.transitions.row(state * self.actions.len() + action);
                write_row(f, &format!("T: {name} : {from}"), &self.states, row)?;
            }
        }
        writeln!(f)?;
        // O: action : state after it : observation probability. `*` stands for all: what is observed depends on the
        // state alone.
        for (row, state) in self.readings.rows().zip(&self.states) {
            write_row(f, &format!("O: * : {state}"), &self.observations, row)?;
        }
        // R: action : from : to : observation reward. A later line replaces an earlier one for what both match.
        writeln!(f, "\nR: * : * : * : * 0")?;
        self.goals
            .iter()
            .try_for_each(|&s| writeln!(f, "R: * : * : {} : * 1", self.states[s as usize]))
    }
}

/// Number of digits after the decimal point: no probability changes by more than 1e-12, and more make larger files.
const DIGITS: u32 = 12;
const UNITS: u64 = 10u64.pow(DIGITS);

fn write_row(
    f: &mut fmt::Formatter<'_>,
    of: &str,
    names: &[String],
    row: &[(u32, f64)],
) -> fmt::Result {
    let units = in_units(row.iter().map(|entry| entry.1));
    for (&(to, _), units) in row.iter().zip(units).filter(|(_, units)| *units > 0) {
        let whole = units / UNITS;
        let rest = units % UNITS;
        let digits = format!("{whole}.{rest:0width$}", width = DIGITS as usize);
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        writeln!(f, "{of} : {} {digits}", names[to as usize])?;
    }
    Ok(())
}

/// Returns the probabilities in units of the last printed digit, so that they sum to 1 exactly:
/// rounded down, and the remainder given to those that lost most.
fn in_units(row: impl Iterator<Item = f64> + Clone) -> Vec<u64> {
    let sum: f64 = row.clone().sum();
    let exact: Vec<f64> = row.map(|p| p / sum * UNITS as f64).collect();
    let mut units: Vec<u64> = exact.iter().map(|x| x.floor() as u64).collect();
    let missing = UNITS.saturating_sub(units.iter().sum());
    let mut by_loss: Vec<usize> = (0..units.len()).collect();
    by_loss.sort_by(|&a, &b| exact[b].fract().total_cmp(&exact[a].fract()));
    by_loss.iter().cycle().take(missing as usize).for_each(|&i| units[i] += 1);
    units
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn printed_rows_sum_to_one_exactly(weights in prop::collection::vec(1e-9f64..1.0, 1..40)) {
            let sum: f64 = weights.iter().sum();
            let units = in_units(weights.iter().map(|w| w / sum));
            prop_assert_eq!(units.iter().sum::<u64>(), UNITS);
            for (w, u) in weights.iter().zip(&units) {
                prop_assert!((w / sum - *u as f64 / UNITS as f64).abs() <= 2.0 / UNITS as f64);
            }
        }
    }

    #[test]
    fn thirds_are_rounded_by_largest_remainder() {
        let third = 1.0 / 3.0;
        let units = in_units([third, third, third].into_iter());
        assert_eq!(units, [333_333_333_334, 333_333_333_333, 333_333_333_333]);
        assert_eq!(in_units([1.0].into_iter()), [UNITS]);
    }
}
