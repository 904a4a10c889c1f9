//! A snake of 450 and more connectors creeps at random through space (slides E1, V6, F4): among
//! balls that stand, and balls that fly.

use super::corridor::{CLEARANCE, MAX_SPEED, OWN_GAP, ROD_VIOLATION};
use super::{DT_S, SerpentineConfig};
use crate::cells::{CaseResults, Columns, Value, column};
use crate::study::{Progress, Study, setting_number};
use serde::Serialize;
use sidestep::experiment::sweep::Variant;
use sidestep::kernel::InputError;
use sidestep_document::Table;

/// The scenario.
pub(super) const SCENARIO: &str = include_str!("../../scenarios/serpentine/snake.toml");
const SWEEP: &str = include_str!("../../scenarios/serpentine/snake.sweep.toml");
const CONNECTORS: &str = "chains.connectors";

const COLUMNS: Columns = Columns {
    case: &[
        column("connectors", "connectors", |r| r.setting(CONNECTORS)),
        column("filled", "filled, %", |r| Value::Number(of_fields(r.variant(), "part")))
            .with_format(|c| (100.0 * c.number("filled")).to_string()),
        column("movers", "flying balls", |r| Value::Count(of_fields(r.variant(), "n") as u64)),
    ],
    results: &[
        column("steps_per_s", "steps / CPU s", |r| r.mean("steps_per_cpu_s")),
        column("real_time", "times real time", |r| {
            r.mean_of(|run| run.number_or_zero("steps_per_cpu_s") * DT_S)
        }),
        column("veto_percent", "vetoes, %", |r| r.mean_rate("vetoes")),
        column("penetrations", "steps inside", |r| r.sum("penetrations")),
        column("steps", "steps", |r| r.sum("steps")),
        CLEARANCE,
        OWN_GAP,
        MAX_SPEED,
        column("way_percent", "way, %", |r| {
            r.mean_proportion(|run| 100.0 * run.number_or_zero("progress"))
        }),
        ROD_VIOLATION,
    ],
};

/// Returns the total of a key over the fields of a case.
fn of_fields(case: &Variant, key: &str) -> f64 {
    let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|n| n as f64));
    let fields = case.value("fields").and_then(toml::Value::as_array).into_iter().flatten();
    // From 0, because the sum of none is -0.
    fields.filter_map(|field| number(field.get(key)?)).fold(0.0, |all, of_one| all + of_one)
}

/// All cases.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SnakeResults {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the sweep of a plan.
pub(super) fn study(plan: &SerpentineConfig) -> Result<Study, InputError> {
    let study = Study::from_file(SWEEP, SCENARIO)?;
    let study = study
        .filtered(|v| plan.snake_connectors.contains(&(setting_number(v, CONNECTORS) as usize)));
    Ok(study.with_size(plan.snake_seeds, Some(plan.snake_cycles)))
}

impl SnakeResults {
    pub(super) fn run(
        plan: &SerpentineConfig,
        progress: &mut Progress<'_>,
    ) -> Result<Self, InputError> {
        let results = study(plan)?.run(plan.workers, "snake in space", progress)?;
        Ok(Self { cells: COLUMNS.cells(&results) })
    }

    /// Returns cells among balls that all stand.
    pub(super) fn at_rest(&self) -> impl Iterator<Item = &CaseResults> {
        self.cells.iter().filter(|c| c.count("movers") == 0 && c.number("filled") > 0.0)
    }

    pub(super) fn table(&self) -> Table {
        let note = "Rods of 0.1 m, balls of 0.4 m in a room of 16 m, in which the snake lies in folds at \
                    the start, with balls between them; steps of 1 cm; a step includes looking for the least distance of every part. Real time is 50 steps \
                    a second.";
        COLUMNS.table("A snake in space", note, &self.cells)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_without_balls_is_filled_by_nothing_not_by_less() {
        let none = of_fields(&Variant::default(), "part");
        assert_eq!(none.to_string(), "0");
    }
}
