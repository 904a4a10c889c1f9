//! A snake of 450 and more connectors creeps at random through space (slides E1, V6, F4): among
//! balls that stand, and balls that fly.

use super::corridor::{CLEARANCE, FASTEST, OWN_PARTS, ROD_VIOLATION};
use super::{DT_S, SerpentinePlan};
use crate::cells::{CaseResults, Columns, Value, column};
use crate::study::{Progress, Study, number};
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
        column("connectors", "connectors", |r| r.set(CONNECTORS)),
        column("filled", "filled, %", |r| Value::Number(of_fields(r.variant(), "part")))
            .shown(|c| (100.0 * c.number("filled")).to_string()),
        column("movers", "flying balls", |r| Value::Count(of_fields(r.variant(), "n") as u64)),
    ],
    came: &[
        column("steps_per_s", "steps / CPU s", |r| r.mean("steps_per_cpu_s")),
        column("real_time", "times real time", |r| {
            r.mean_of(|run| run.or_zero("steps_per_cpu_s") * DT_S)
        }),
        column("veto_percent", "vetoes, %", |r| r.mean_rate("vetoes")),
        column("penetrations", "steps inside", |r| r.sum("penetrations")),
        column("steps", "steps", |r| r.sum("steps")),
        CLEARANCE,
        OWN_PARTS,
        FASTEST,
        column("way_percent", "way, %", |r| r.mean_share(|run| 100.0 * run.or_zero("progress"))),
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
pub(super) struct Snakes {
    /// Results by case.
    pub(super) cells: Vec<CaseResults>,
}

/// Returns the sweep of a plan.
pub(super) fn study(plan: &SerpentinePlan) -> Result<Study, InputError> {
    let study = Study::of_file(SWEEP, SCENARIO)?;
    let study = study.keep(|v| plan.snake_connectors.contains(&(number(v, CONNECTORS) as usize)));
    Ok(study.sized(plan.snake_seeds, Some(plan.snake_cycles)))
}

impl Snakes {
    pub(super) fn run(
        plan: &SerpentinePlan,
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
