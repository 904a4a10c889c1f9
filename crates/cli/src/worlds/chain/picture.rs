//! The picture of a run: obstacles, chains, and where they went.

use super::super::{Comparison, Pictured};
use crate::exit::Failure;
use sidestep::kernel::ports::Values;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::worlds::chain::simulation::ChainSimulation;
use sidestep_draw::{Axis, Plot, Point as PlotPoint, Series, Style};
use sidestep_record::{Table, read_table};
use std::ops::RangeInclusive;
use std::path::Path;

/// The table that holds positions.
const TABLE: &str = "trajectories";
const AXES: [&str; 3] = ["x_m", "y_m", "z_m"];

/// One recorded position.
#[derive(Debug, Clone, PartialEq)]
struct Recorded {
    chain: u32,
    connector: u32,
    at: Vec<f64>,
}

/// The chains of `simulation` as they are.
pub(super) fn svg<const D: usize>(
    simulation: &ChainSimulation<D>,
    of: Pictured<'_>,
) -> Result<String, Failure> {
    let mut plot = Plot::new(simulation.compiled().name.clone())
        .x_axis(Axis::linear("x in m"))
        .y_axis(Axis::linear("y in m"))
        .note(of.origin);
    for slot in 0..simulation.state().len() {
        let body = simulation.state().body(slot);
        let points = body.chain.points().iter().map(|p| PlotPoint::new(p[0], p[1]));
        plot = plot.series(Series::line("", points.collect()));
    }
    Ok(plot.to_svg(&Style::CHART)?)
}

/// Compares the present positions with those recorded for the present cycle.
pub(super) fn compare<const D: usize>(
    simulation: &ChainSimulation<D>,
    folder: &Path,
) -> Result<Comparison, InputError> {
    let cycle = simulation.cycle();
    let Some(recorded) = rows::<D>(folder, cycle..=cycle)?.filter(|rows| !rows.is_empty()) else {
        return Ok(Comparison::NotRecorded);
    };
    let state = simulation.state();
    let differs = |row: &&Recorded| {
        let slot = row.chain as usize;
        let at = (slot < state.len())
            .then(|| state.body(slot).chain.points().get(row.connector as usize).copied());
        at.flatten().is_none_or(|at| at[..] != row.at[..])
    };
    let mut different: Vec<u32> = recorded.iter().filter(differs).map(|r| r.connector).collect();
    different.sort_unstable();
    different.dedup();
    Ok(match different.is_empty() {
        true => Comparison::Equal(recorded.len()),
        false => Comparison::Different(different),
    })
}

/// The recorded positions of some cycles; `None` where there are none, or in another form.
fn rows<const D: usize>(
    folder: &Path,
    cycles: RangeInclusive<Cycle>,
) -> Result<Option<Vec<Recorded>>, InputError> {
    if !crate::recorded::has_rows(folder, TABLE) {
        return Ok(None);
    }
    Ok(in_words::<D>(&read_table(folder, TABLE, cycles)?))
}

fn in_words<const D: usize>(table: &Table) -> Option<Vec<Recorded>> {
    let ids = |name| match table.column(name)? {
        Values::U32(values) => Some(values),
        _ => None,
    };
    let numbers = |name| match table.column(name)? {
        Values::F64(values) => Some(values),
        _ => None,
    };
    let (chains, connectors) = (ids("chain")?, ids("connector")?);
    let axes: Vec<&Vec<f64>> = AXES[..D].iter().map(|axis| numbers(axis)).collect::<Option<_>>()?;
    let row = |k: usize| Recorded {
        chain: chains[k],
        connector: connectors[k],
        at: axes.iter().map(|axis| axis[k]).collect(),
    };
    Some((0..chains.len()).map(row).collect())
}
