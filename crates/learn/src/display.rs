//! Tables for people: counts, probabilities, intervals, fits.

use std::fmt::{Formatter, Result};

use super::holdout::{HoldoutTest, Split};
use super::{Estimate, LowCountRow};
use sidestep_kernel::text::{LINE_COLS, format_fixed, wrap_text};
use sidestep_statistics::{Moments, holm};

/// The names of a table's rows and columns.
pub(super) struct TableHeading {
    pub(super) row: &'static str,
    pub(super) column: &'static str,
}

/// Writes warnings, in lines that every terminal has room for.
pub(super) fn write_warnings(f: &mut Formatter<'_>, warnings: &[String]) -> Result {
    warnings.iter().try_for_each(|warning| writeln!(f, "{}", warning_line(warning)))
}

fn warning_line(warning: &str) -> String {
    wrap_text(&format!("WARNING: {warning}"), LINE_COLS).join("\n")
}

/// Writes named moments, one per line; those without values are left out.
pub(super) fn write_moments(f: &mut Formatter<'_>, named: &[(String, Option<Moments>)]) -> Result {
    if named.iter().all(|(_, moments)| moments.is_none()) {
        return Ok(());
    }
    let heads = ["n", "mean", "sd", "p01", "p05", "p50", "p95", "p99"];
    write!(f, "\n{:20} {:>5}", "", heads[0])?;
    heads[1..].iter().try_for_each(|head| write!(f, " {head:>6}"))?;
    writeln!(f)?;
    for (name, m) in named {
        let Some(m) = m else { continue };
        write!(f, "{name:20} {:>5}", m.n)?;
        let values = [m.mean, m.sd, m.p01, m.p05, m.p50, m.p95, m.p99];
        values.iter().try_for_each(|value| write!(f, " {:>6}", format_in_six(*value)))?;
        writeln!(f)?;
    }
    Ok(())
}

/// Returns a number in six characters where it has room in them.
fn format_in_six(value: f64) -> String {
    let decimals = match value.abs() {
        a if a < 10.0 => 3,
        a if a < 100.0 => 2,
        a if a < 1000.0 => 1,
        _ => 0,
    };
    format_fixed(value, decimals)
}

/// Writes estimates, one table for each name; cells without counts are left out.
pub(super) fn write_estimates(
    f: &mut Formatter<'_>,
    all: &[Estimate],
    heading: &TableHeading,
) -> Result {
    let mut table = "";
    for estimate in all.iter().filter(|estimate| estimate.count > 0.0) {
        if estimate.table != table {
            table = &estimate.table;
            writeln!(f, "\n{table}")?;
            writeln!(
                f,
                "  {:12} {:13} {:>10} {:>7}  probability  95 % interval",
                heading.row, heading.column, "count", "of"
            )?;
        }
        write_estimate(f, estimate)?;
    }
    Ok(())
}

fn write_estimate(f: &mut Formatter<'_>, e: &Estimate) -> Result {
    // Counts of events that are spread over outcomes are fractional.
    let decimals = if e.count.fract() == 0.0 { 0 } else { 2 };
    let interval = match e.interval {
        Some(interval) => format!("[{:.5}, {:.5}]", interval.low, interval.high),
        None => "none: see the warning".to_string(),
    };
    writeln!(
        f,
        "  {:12} {:13} {:>10.decimals$} {:>7.0}  {:>11.5}  {interval}",
        e.row, e.column, e.count, e.of, e.probability
    )
}

/// Where every row has enough counts, one line says so.
pub(super) fn write_low_count_rows(
    f: &mut Formatter<'_>,
    thin: &[LowCountRow],
    below: u32,
) -> Result {
    if thin.is_empty() {
        return writeln!(f, "\nEvery row has at least {below} counts.");
    }
    writeln!(f, "\nRows with fewer than {below} counts")?;
    for row in thin {
        // Two decimals would print such a count as a whole one.
        let is_whole = (row.count - row.count.round()).abs() < 0.005;
        let decimals = if is_whole { 0 } else { 2 };
        writeln!(f, "  {} {}: {:.decimals$}", row.table, row.row, row.count)?;
    }
    Ok(())
}

/// Writes how well a part of the events predicts the rest.
pub(super) fn write_holdout_tests(f: &mut Formatter<'_>, fits: &[HoldoutTest]) -> Result {
    writeln!(f, "\nHold-out fit (same law in both parts? log-loss in nat per event)")?;
    writeln!(
        f,
        "  {:18} {:>8} {:>8} {:>8} {:>4} {:>7} {:>9} {:>9}",
        "table", "learned", "held out", "chi2", "df", "p", "log-loss", "floor"
    )?;
    for fit in fits {
        write_holdout_test(f, fit)?;
    }
    verdicts(fits).iter().try_for_each(|words| writeln!(f, "{words}"))
}

fn write_holdout_test(f: &mut Formatter<'_>, fit: &HoldoutTest) -> Result {
    let mut chi_square = format!("{:.2}", fit.chi_square);
    let mut p_value = format_p_column(fit.p_value);
    // Without degrees of freedom nothing was tested.
    if fit.degrees_of_freedom == 0 {
        chi_square = "-".to_string();
        p_value = "-".to_string();
    }
    writeln!(
        f,
        "  {:18} {:>8.0} {:>8.0} {:>8} {:>4} {:>7} {:>9} {:>9}",
        name_of(fit),
        fit.trained_on,
        fit.held_out,
        chi_square,
        fit.degrees_of_freedom,
        p_value,
        format_loss(fit.log_loss),
        format_loss(fit.log_loss_floor)
    )
}

/// Returns a test's table, with the way in which the log was cut where that is not every k-th event.
fn name_of(fit: &HoldoutTest) -> String {
    match fit.split {
        Split::Alternate => fit.table.clone(),
        Split::Time | Split::Robot => format!("{} ({})", fit.table, fit.split.name()),
    }
}

fn format_loss(loss: Option<f64>) -> String {
    loss.map_or("-".to_string(), |loss| format!("{loss:.5}"))
}

/// Largest probability, over all tables together, at which a difference is not taken for chance.
const SIGNIFICANCE_LEVEL: f64 = 0.05;

/// Returns the verdicts of the tests: a line for each table with parts that differ, or one for all.
fn verdicts(fits: &[HoldoutTest]) -> Vec<String> {
    let tested: Vec<&HoldoutTest> = fits.iter().filter(|fit| fit.degrees_of_freedom > 0).collect();
    // One of many tables differs by chance alone; Holm's adjustment keeps the level over all of them.
    let adjusted = holm(&tested.iter().map(|fit| Some(fit.p_value)).collect::<Vec<_>>());
    let differs =
        tested.iter().zip(adjusted).filter(|(_, p)| p.is_some_and(|p| p < SIGNIFICANCE_LEVEL));
    let mut words: Vec<String> =
        differs.map(|(fit, _)| warning_line(&difference_words(fit))).collect();
    let untested = fits.len() - tested.len();
    if words.is_empty() && !tested.is_empty() {
        words.push("Both parts of the log agree as far as these counts can show.".into());
    }
    if untested > 0 {
        words.push(format!("Too few counts to test: {untested} of {} tables.", fits.len()));
    }
    words
}

/// Largest number of odd robots that a sentence lists.
const MAX_LISTED_ROBOTS: usize = 12;

/// Returns the sentence on a table whose parts differ.
fn difference_words(fit: &HoldoutTest) -> String {
    let table = &fit.table;
    let p = format_p(fit.p_value);
    match fit.split {
        Split::Alternate => format!(
            "{table}: the parts of the log differ by more than chance (p {p}). What was learned may \
             not hold elsewhere: the robot or its place changed meanwhile, or events depend on \
             each other."
        ),
        Split::Time => format!(
            "{table}: the quarters of the log differ by more than chance (p {p}). The errors change in \
             time, or events depend on each other: one table is the mean of several, and its intervals \
             hold for none of them. Learn from the stretches before and after the change by themselves."
        ),
        Split::Robot => format!(
            "{table}: the {} robots differ by more than chance (p {p}){}. One table is the mean of \
             several, and its intervals hold for none of them: learn robots that are alike by themselves.",
            fit.parts,
            odd_words(&fit.odd_parts)
        ),
    }
}

/// Returns the robots that differ from the others, as a part of a sentence.
fn odd_words(robots: &[String]) -> String {
    match robots.len() {
        0 => String::new(),
        n if n > MAX_LISTED_ROBOTS => format!(", {n} of them far from the others"),
        1 => format!(", robot {} far from the others", robots[0]),
        _ => format!(", robots {} far from the others", robots.join(", ")),
    }
}

/// Probabilities below it are not told apart, and none of them is 0.
const MIN_P: f64 = 0.0001;

fn format_p(p: f64) -> String {
    if p < MIN_P { format!("< {MIN_P}") } else { format!("= {p:.4}") }
}

/// Without the `=` of a sentence, for which a column has no room.
fn format_p_column(p: f64) -> String {
    if p < MIN_P { format!("<{MIN_P}") } else { format!("{p:.4}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fit(p_value: f64, degrees_of_freedom: usize) -> HoldoutTest {
        HoldoutTest {
            table: "moves".into(),
            split: Split::Alternate,
            parts: 2,
            odd_parts: Vec::new(),
            trained_on: 100.0,
            held_out: 100.0,
            chi_square: 1.0,
            degrees_of_freedom,
            p_value,
            log_loss: None,
            log_loss_floor: None,
        }
    }

    #[test]
    fn a_small_p_is_a_verdict_and_chance_over_many_tables_is_not() {
        let told = |fits: &[HoldoutTest]| verdicts(fits).join("\n");
        assert!(told(&[fit(0.0067, 4)]).contains("moves: the parts of the log differ"));
        let mut many = vec![fit(0.9, 4); 9];
        many.push(fit(0.0067, 4));
        assert!(told(&many).starts_with("Both parts of the log agree"), "{}", told(&many));
        assert_eq!(told(&[fit(1.0, 0)]), "Too few counts to test: 1 of 1 tables.");
        let lines = told(&[HoldoutTest { table: "a_table_of_turns".into(), ..fit(0.00001, 4) }]);
        assert!(lines.lines().all(|line| line.chars().count() <= 80), "{lines}");
    }

    #[test]
    fn robots_that_differ_and_errors_that_change_are_told_apart() {
        let odd_parts = ["3", "7"].map(String::from).to_vec();
        let robots = HoldoutTest { split: Split::Robot, parts: 9, odd_parts, ..fit(1e-9, 8) };
        let told =
            verdicts(&[robots, HoldoutTest { split: Split::Time, ..fit(1e-9, 3) }]).join("\n");
        let words = told.replace('\n', " ");
        assert!(
            words.contains("the 9 robots differ") && words.contains("robots 3, 7 far"),
            "{told}"
        );
        assert!(words.contains("quarters of the log differ"), "{told}");
        let name = name_of(&HoldoutTest { split: Split::Robot, ..fit(0.5, 1) });
        assert_eq!(name, "moves (robot)");
    }

    #[test]
    fn no_probability_is_told_as_none() {
        assert_eq!([1e-9, 0.0001, 0.25].map(format_p_column), ["<0.0001", "0.0001", "0.2500"]);
        assert_eq!(format_p(0.0), "< 0.0001");
    }

    #[test]
    fn warnings_are_broken_into_lines_of_80_columns() {
        let told = warning_line(
            &"near obstacles outcomes are seen too rarely, so learn in the open ".repeat(4),
        );
        assert!(told.lines().count() > 3 && told.starts_with("WARNING: near"), "{told}");
        assert!(told.lines().all(|line| line.chars().count() <= 80), "{told}");
    }

    #[test]
    fn numbers_take_six_characters() {
        assert_eq!(
            [0.02489, -0.2346, -90.0, 123.456, -1e-9].map(format_in_six),
            ["0.025", "-0.235", "-90.00", "123.5", "0.000"]
        );
    }
}
