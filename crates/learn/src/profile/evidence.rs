//! The evidence for a profile, as the table `evidence` of each of its sections.

use std::collections::BTreeMap;

use toml_edit::{Array, ArrayOfTables, InlineTable, Item, Table, Value, value};

use super::{implicit, words};
use crate::effector::LearnedEffector;
use crate::holdout::HoldoutTest;
use crate::sensor::{BeamFit, LearnedSensor};
use crate::{Estimate, EstimateOptions, LeftOut, LowCountRow};

pub(super) fn sensor_evidence(model: &LearnedSensor) -> Table {
    let report = &model.report;
    let mut table = Table::new();
    table["source"] = value(&report.source);
    table["rule"] = value(&model.profile.rule);
    table["sightings"] = count(report.sightings as f64).into();
    table["skipped"] = count(report.skipped as f64).into();
    write_left_out(&mut table, &report.left_out, &report.skipped_by_cause);
    table["correct"] = count(report.correct as f64).into();
    let certainty = Certainty {
        options: &report.estimate,
        assumed: &model.profile.assumed,
        warnings: &report.warnings,
        thin: &report.thin,
        hold_out: &report.hold_out,
        // Confusion between single subjects says more about one arena than about the camera.
        estimates: report.probabilities.iter().filter(|e| is_about_kinds(model, e)).collect(),
    };
    certainty.write(&mut table);
    table
}

pub(super) fn beam_evidence(model: &LearnedSensor, fit: &BeamFit) -> Table {
    let report = &model.report;
    let mut table = Table::new();
    table["source"] = value(&report.source);
    table["rule"] = value(BEAM_RULE);
    write_left_out(&mut table, &report.left_out, &report.skipped_by_cause);
    table["readings"] = count(fit.readings as f64).into();
    table["fitted"] = count(fit.fitted as f64).into();
    table["scans"] = count(fit.scans as f64).into();
    table["steps"] = count(fit.steps as f64).into();
    table["has_converged"] = value(fit.has_converged);
    table["largest_deviation"] = value(round_to_six(fit.largest_deviation));
    table["warnings"] = words(&report.warnings);
    let mut parameters = Table::new();
    for parameter in &fit.parameters {
        let mut fields = InlineTable::new();
        fields.insert("value", round_to_six(parameter.value).into());
        if let Some(interval) = parameter.interval {
            let ends = [interval.low, interval.high].map(round_to_six);
            fields.insert("interval", Array::from_iter(ends).into());
        }
        parameters[parameter.name] = value(fields);
    }
    table["parameters"] = Item::Table(parameters);
    table
}

/// The rule by which ranges become a beam model.
const BEAM_RULE: &str = "expectation and maximization of the beam model (Thrun, Burgard, Fox 2005, table 6.2) until \
    the mean log-likelihood rises by less than 1e-9; 95 % intervals of Fisher's information, scores summed by scan";

/// Writes the number of samples, the shares of them that are in no table, and their number by cause.
fn write_left_out(table: &mut Table, left_out: &LeftOut, by_cause: &BTreeMap<String, u64>) {
    table["samples"] = count(left_out.samples as f64).into();
    table["left_out_share"] = value(round_to_six(left_out.share()));
    table["unexplained_share"] = value(round_to_six(left_out.unexplained_share()));
    let causes = by_cause.iter().map(|(cause, n)| (cause.as_str(), count(*n as f64)));
    table["left_out"] = value(InlineTable::from_iter(causes));
}

/// Returns whether an estimate is about kinds; `confusion` is about subjects where kinds are known.
fn is_about_kinds(model: &LearnedSensor, estimate: &Estimate) -> bool {
    model.report.kinds.is_none() || estimate.table != "confusion"
}

pub(super) fn effector_evidence(model: &LearnedEffector) -> Table {
    let report = &model.report;
    let mut table = Table::new();
    table["source"] = value(&report.source);
    table["rule"] = value(&model.profile.rule);
    if let Some(effector) = &report.effector {
        table["effector"] = value(effector);
    }
    table["events"] = count(report.events as f64).into();
    write_left_out(&mut table, &report.left_out, &report.rejected);
    if let Some(turns) = &report.turns {
        table["turns"] = count(turns.n as f64).into();
    }
    if let Some(delays) = &report.delays {
        table["delayed_actions"] = count(delays.delays as f64).into();
        table["actions_with_pause"] = count(delays.actions as f64).into();
        if let Some(correlation) = delays.autocorrelation {
            table["pause_autocorrelation"] = value(round_to_six(correlation));
        }
    }
    if let Some(sd) = report.lateral_slip_sd {
        table["lateral_slip_sd"] = value(round_to_six(sd));
    }
    if let Some(sd) = report.lateral_slip_robust_sd {
        table["lateral_slip_robust_sd"] = value(round_to_six(sd));
    }
    let certainty = Certainty {
        options: &report.estimate,
        assumed: &model.profile.assumed,
        warnings: &report.warnings,
        thin: &report.thin,
        hold_out: &report.hold_out,
        estimates: report.probabilities.iter().collect(),
    };
    certainty.write(&mut table);
    table
}

/// The certainty of the numbers; the same for sensors and effectors.
struct Certainty<'a> {
    options: &'a EstimateOptions,
    assumed: &'a [String],
    warnings: &'a [String],
    thin: &'a [LowCountRow],
    hold_out: &'a [HoldoutTest],
    estimates: Vec<&'a Estimate>,
}

impl Certainty<'_> {
    fn write(&self, table: &mut Table) {
        table["alpha"] = value(self.options.alpha);
        table["thin_below"] = value(i64::from(self.options.thin_below));
        table["thin"] = value(Array::from_iter(self.thin.iter().map(low_count_row)));
        table["assumed"] = words(self.assumed);
        table["warnings"] = words(self.warnings);
        table["hold_out_every"] = count(self.options.hold_out_every as f64).into();
        let fits = ArrayOfTables::from_iter(self.hold_out.iter().map(holdout_table));
        table["hold_out"] = Item::ArrayOfTables(fits);
        let mut by_table: BTreeMap<&str, BTreeMap<&str, Vec<&Estimate>>> = BTreeMap::new();
        for estimate in &self.estimates {
            let rows = by_table.entry(&estimate.table).or_default();
            rows.entry(&estimate.row).or_default().push(estimate);
        }
        let mut probabilities = implicit();
        for (name, rows) in by_table {
            probabilities[name] = Item::Table(estimates(&rows));
        }
        table["probabilities"] = Item::Table(probabilities);
    }
}

/// Returns one table of counts: a table for each row, in it an entry for each column.
fn estimates(rows: &BTreeMap<&str, Vec<&Estimate>>) -> Table {
    let mut table = implicit();
    for (row, cells) in rows {
        let mut entries = Table::new();
        for cell in cells {
            entries[&cell.column] = value(estimate(cell));
        }
        table[row] = Item::Table(entries);
    }
    table
}

fn estimate(estimate: &Estimate) -> InlineTable {
    let mut fields = InlineTable::new();
    fields.insert("count", count(estimate.count));
    fields.insert("of", count(estimate.of));
    fields.insert("p", round_to_six(estimate.probability).into());
    if let Some(interval) = estimate.interval {
        let ends = [interval.low, interval.high].map(round_to_six);
        fields.insert("interval", Array::from_iter(ends).into());
    }
    fields
}

fn low_count_row(row: &LowCountRow) -> InlineTable {
    let mut fields = InlineTable::new();
    fields.insert("table", row.table.as_str().into());
    fields.insert("row", row.row.as_str().into());
    fields.insert("count", count(row.count));
    fields
}

fn holdout_table(fit: &HoldoutTest) -> Table {
    let mut table = Table::new();
    table["table"] = value(&fit.table);
    table["split"] = value(fit.split.name());
    table["trained_on"] = count(fit.trained_on).into();
    table["held_out"] = count(fit.held_out).into();
    table["chi_square"] = value(round_to_six(fit.chi_square));
    table["degrees_of_freedom"] = count(fit.degrees_of_freedom as f64).into();
    table["p_value"] = value(round_to_six(fit.p_value));
    for (name, loss) in [("log_loss", fit.log_loss), ("log_loss_floor", fit.log_loss_floor)] {
        if let Some(loss) = loss {
            table[name] = value(round_to_six(loss));
        }
    }
    table
}

/// Returns a count: whole where it is, else (events spread over outcomes) with four decimals.
fn count(count: f64) -> Value {
    let near = (count * 1e4).round() / 1e4;
    if near.fract() == 0.0 { (near as i64).into() } else { near.into() }
}

/// Returns a value with six decimals: more than any interval justifies.
fn round_to_six(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
