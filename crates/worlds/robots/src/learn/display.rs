//! Tables for people: counts, probabilities, intervals, fits.

use std::fmt::{Formatter, Result};

use super::holdout::Fit;
use super::{Estimate, ThinRow};
use sidestep_statistics::Moments;

/// The names of a table's rows and columns.
pub(super) struct Heading {
    pub(super) row: &'static str,
    pub(super) column: &'static str,
}

/// Writes warnings, one per line.
pub(super) fn warnings(f: &mut Formatter<'_>, warnings: &[String]) -> Result {
    warnings.iter().try_for_each(|warning| writeln!(f, "WARNING: {warning}"))
}

/// Writes named moments, one per line; those without values are left out.
pub(super) fn moments(f: &mut Formatter<'_>, named: &[(String, Option<Moments>)]) -> Result {
    if named.iter().all(|(_, moments)| moments.is_none()) {
        return Ok(());
    }
    let heads = ["n", "mean", "sd", "p01", "p05", "p50", "p95", "p99"];
    write!(f, "\n{:26} {:>6}", "", heads[0])?;
    heads[1..].iter().try_for_each(|head| write!(f, " {head:>9}"))?;
    writeln!(f)?;
    for (name, m) in named {
        let Some(m) = m else { continue };
        write!(f, "{name:26} {:>6}", m.n)?;
        let values = [m.mean, m.sd, m.p01, m.p05, m.p50, m.p95, m.p99];
        values.iter().try_for_each(|value| write!(f, " {value:>9.4}"))?;
        writeln!(f)?;
    }
    Ok(())
}

/// Writes estimates, one table for each name; cells without counts are left out.
pub(super) fn estimates(f: &mut Formatter<'_>, all: &[Estimate], heading: &Heading) -> Result {
    let mut table = "";
    for estimate in all.iter().filter(|estimate| estimate.count > 0.0) {
        if estimate.table != table {
            table = &estimate.table;
            writeln!(f, "\n{table}")?;
            let (row, column) = (heading.row, heading.column);
            let heads = ["count", "of", "probability", "95 % interval"];
            let [count, of, probability, interval] = heads;
            writeln!(f, "  {row:12} {column:14} {count:>10} {of:>7}  {probability}  {interval}")?;
        }
        line(f, estimate)?;
    }
    Ok(())
}

fn line(f: &mut Formatter<'_>, e: &Estimate) -> Result {
    // Counts of events that are spread over outcomes are fractional.
    let decimals = if e.count.fract() == 0.0 { 0 } else { 2 };
    writeln!(
        f,
        "  {:12} {:14} {:>10.decimals$} {:>7.0}  {:>11.5}  [{:.5}, {:.5}]",
        e.row, e.column, e.count, e.of, e.probability, e.interval.low, e.interval.high
    )
}

/// Writes the rows with few counts.
pub(super) fn thin(f: &mut Formatter<'_>, thin: &[ThinRow], below: u32) -> Result {
    if thin.is_empty() {
        return writeln!(f, "\nEvery row has at least {below} counts.");
    }
    writeln!(f, "\nRows with fewer than {below} counts")?;
    thin.iter().try_for_each(|row| writeln!(f, "  {} {}: {}", row.table, row.row, row.count))
}

/// Writes how well a part of the events predicts the rest.
pub(super) fn hold_out(f: &mut Formatter<'_>, fits: &[Fit]) -> Result {
    writeln!(f, "\nHold-out fit (same law in both parts? log-loss in nat per event)")?;
    let heads = ["table", "learned", "held out", "chi2", "df", "p", "log-loss", "floor"];
    let [table, learned, held, chi2, df, p, loss, floor] = heads;
    writeln!(
        f,
        "  {table:18} {learned:>8} {held:>8} {chi2:>8} {df:>4} {p:>7} {loss:>9} {floor:>9}"
    )?;
    for fit in fits {
        let shown = |loss: Option<f64>| loss.map_or("-".to_string(), |loss| format!("{loss:.5}"));
        writeln!(
            f,
            "  {:18} {:>8.0} {:>8.0} {:>8.2} {:>4} {:>7.4} {:>9} {:>9}",
            fit.table,
            fit.trained_on,
            fit.held_out,
            fit.chi_square,
            fit.degrees_of_freedom,
            fit.p_value,
            shown(fit.log_loss),
            shown(fit.log_loss_floor)
        )?;
    }
    Ok(())
}
