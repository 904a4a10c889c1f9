//! A test of how well a part of the events predicts the rest.

use serde::Serialize;

use super::counts::{CountTable, smooth};
use sidestep_kernel::math::ln;
use sidestep_statistics::chi_square_p_value;

/// Cells expected to hold fewer counts than this are pooled before a chi-square test, because the statistic follows
/// the chi-square distribution only where expected counts are not small; 5 is the customary bound (Cochran 1954).
const MIN_EXPECTED_COUNT: f64 = 5.0;

/// The agreement of held-out events with the table learned from the others.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct HoldoutTest {
    /// Name of the table of counts.
    pub table: String,
    /// Number of events used for learning.
    pub trained_on: f64,
    /// Number of events held out, which the learned table is to predict.
    pub held_out: f64,
    /// Chi-square statistic of the hypothesis that both parts follow one law.
    pub chi_square: f64,
    /// Its degrees of freedom, after cells that expect fewer than 5 counts are pooled.
    pub degrees_of_freedom: usize,
    /// Probability of a statistic at least this large under that hypothesis, if events are
    /// independent. Readings of one image are not independent: there a small value says nothing
    /// more. Where an event is spread over outcomes (phase averaging) the value is too high.
    pub p_value: f64,
    /// Mean of `-ln P(outcome)` over the events held out, in nat, with the smoothed learned
    /// probabilities; `None` when nothing was held out or a probability was 0.
    pub log_loss: Option<f64>,
    /// The same with the best possible probabilities, those of the held-out part itself.
    pub log_loss_floor: Option<f64>,
}

/// Splits events into those for learning and every `every`-th, which is held out.
pub fn split<T>(events: &[T], every: usize) -> (Vec<&T>, Vec<&T>) {
    let mut train = Vec::new();
    let mut held = Vec::new();
    for (index, event) in events.iter().enumerate() {
        if index % every == every - 1 {
            held.push(event);
        } else {
            train.push(event);
        }
    }
    (train, held)
}

/// Compares two tables of the same shape; `alpha` smooths the learned one for the log-loss.
pub fn holdout_test(trained: &CountTable, held: &CountTable, alpha: f64) -> HoldoutTest {
    let n_rows = trained.rows().len();
    let tests: Vec<(f64, usize)> =
        (0..n_rows).map(|row| homogeneity(trained.row(row), held.row(row))).collect();
    let chi_square = tests.iter().map(|test| test.0).sum();
    let degrees_of_freedom = tests.iter().map(|test| test.1).sum();
    HoldoutTest {
        table: trained.name().to_owned(),
        trained_on: (0..n_rows).map(|row| trained.total(row)).sum(),
        held_out: (0..n_rows).map(|row| held.total(row)).sum(),
        chi_square,
        degrees_of_freedom,
        p_value: chi_square_p_value(chi_square, degrees_of_freedom),
        log_loss: log_loss(trained, held, alpha),
        log_loss_floor: log_loss(held, held, 0.0),
    }
}

/// Returns chi-square statistic and degrees of freedom of Pearson's test of homogeneity: "two samples, one law".
fn homogeneity(a: &[f64], b: &[f64]) -> (f64, usize) {
    let n_a: f64 = a.iter().sum();
    let n_b: f64 = b.iter().sum();
    if n_a <= 0.0 || n_b <= 0.0 {
        return (0.0, 0);
    }
    // A cell's expected count is least in the smaller sample, so that one decides what is pooled.
    let share_of_smaller = n_a.min(n_b) / (n_a + n_b);
    let cells = pool_rare(a, b, MIN_EXPECTED_COUNT / share_of_smaller);
    let statistic = cells.iter().map(|&(in_a, in_b)| {
        let share = (in_a + in_b) / (n_a + n_b);
        relative_deviation(in_a, n_a * share) + relative_deviation(in_b, n_b * share)
    });
    (statistic.sum(), cells.len() - 1)
}

/// Returns a cell's part of Pearson's statistic.
fn relative_deviation(observed: f64, expected: f64) -> f64 {
    (observed - expected) * (observed - expected) / expected
}

/// Returns the cells of two samples, the rarest joined until each holds `least` counts.
fn pool_rare(a: &[f64], b: &[f64], least: f64) -> Vec<(f64, f64)> {
    let mut cells: Vec<(f64, f64)> = a.iter().copied().zip(b.iter().copied()).collect();
    cells.sort_by(|x, y| (x.0 + x.1).total_cmp(&(y.0 + y.1)));
    let mut pooled: Vec<(f64, f64)> = Vec::new();
    let mut open = (0.0, 0.0);
    for cell in cells {
        open = (open.0 + cell.0, open.1 + cell.1);
        if open.0 + open.1 >= least {
            pooled.push(open);
            open = (0.0, 0.0);
        }
    }
    // What is left over holds too few counts for a cell of its own, so it joins the last one.
    match pooled.last_mut() {
        Some(last) => *last = (last.0 + open.0, last.1 + open.1),
        None => pooled.push(open),
    }
    pooled
}

fn log_loss(trained: &CountTable, held: &CountTable, alpha: f64) -> Option<f64> {
    let mut loss = 0.0;
    let mut events = 0.0;
    for row in 0..held.rows().len() {
        let probabilities = smooth(trained.row(row), alpha);
        for (count, p) in held.row(row).iter().zip(probabilities) {
            // 0 * ln 0 is 0: an outcome that did not occur costs nothing.
            if *count > 0.0 {
                loss -= count * ln(p);
                events += count;
            }
        }
    }
    (events > 0.0 && loss.is_finite()).then(|| loss / events)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(cells: &[f64]) -> CountTable {
        let columns: Vec<String> = (0..cells.len()).map(|i| i.to_string()).collect();
        let mut counts = CountTable::new("t", &["row".to_string()], &columns);
        for (column, count) in cells.iter().enumerate() {
            counts.add(0, column, *count);
        }
        counts
    }

    #[test]
    fn every_kth_event_is_held_out() {
        let (train, held) = split(&[0, 1, 2, 3, 4, 5, 6], 3);
        assert_eq!(train, [&0, &1, &3, &4, &6]);
        assert_eq!(held, [&2, &5]);
    }

    #[test]
    fn the_test_is_pearsons_for_a_two_by_two_table() {
        // 30/20 against 20/30: chi-square 4, one degree of freedom, p = 0.0455.
        let fit = holdout_test(&table(&[30.0, 20.0]), &table(&[20.0, 30.0]), 0.0);
        assert!((fit.chi_square - 4.0).abs() < 1e-12);
        assert_eq!(fit.degrees_of_freedom, 1);
        assert!((fit.p_value - 0.045_500).abs() < 1e-6);
        assert!((fit.log_loss_floor.unwrap() - 0.673_012).abs() < 1e-6);
        assert!(fit.log_loss.unwrap() > fit.log_loss_floor.unwrap());
    }

    #[test]
    fn rare_cells_are_pooled_and_an_empty_part_tests_nothing() {
        let fit_rare = holdout_test(&table(&[96.0, 3.0, 1.0]), &table(&[95.0, 2.0, 3.0]), 0.5);
        assert_eq!(fit_rare.degrees_of_freedom, 0);
        assert_eq!(fit_rare.p_value, 1.0);
        let empty = holdout_test(&table(&[5.0, 5.0]), &table(&[0.0, 0.0]), 0.5);
        assert_eq!((empty.degrees_of_freedom, empty.log_loss), (0, None));
    }

    #[test]
    fn an_outcome_held_impossible_has_no_finite_loss_unless_smoothed() {
        let (trained, held) = (table(&[10.0, 0.0]), table(&[9.0, 1.0]));
        assert_eq!(holdout_test(&trained, &held, 0.0).log_loss, None);
        assert!(holdout_test(&trained, &held, 0.5).log_loss.unwrap() > 0.3);
    }
}
