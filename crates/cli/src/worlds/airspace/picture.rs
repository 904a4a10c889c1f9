//! The picture of a run: where everybody flew.

use super::{Comparison, Pictured};
use crate::exit::Failure;
use sidestep::kernel::ports::Values;
use sidestep::kernel::{Cycle, InputError, Simulation};
use sidestep::worlds::airspace::airplane::Point;
use sidestep::worlds::airspace::simulation::AirspaceSimulation;
use sidestep_draw::{Axis, Plot, Point as PlotPoint, Series, Style};
use sidestep_record::{Table, read_table};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;

/// The table that holds poses.
const TABLE: &str = "trajectories";
/// More tracks than this cannot be told apart.
const MOST_TRACKS: u32 = 60;

/// One recorded pose.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Recorded {
    airplane: u32,
    at: Point,
    heading_rad: f64,
}

/// The tracks of `simulation`, recorded or from start to goal.
pub(super) fn svg(simulation: &AirspaceSimulation, of: Pictured<'_>) -> Result<String, Failure> {
    let mut tracks: BTreeMap<u32, Vec<Point>> = BTreeMap::new();
    if let Some(folder) = of.folder {
        for row in rows(folder, 0..=simulation.cycle())?.unwrap_or_default() {
            if row.airplane < MOST_TRACKS {
                tracks.entry(row.airplane).or_default().push(row.at);
            }
        }
    }
    let shown = MOST_TRACKS.min(simulation.agents() as u32);
    for (id, cell) in (0..shown).zip(&simulation.state().airplanes) {
        tracks.entry(id).or_default().push(cell.pose().at);
    }
    let km = |at: &Point| PlotPoint::new(at[0] / 1000.0, at[1] / 1000.0);
    let mut plot = Plot::new(simulation.compiled().name.clone())
        .x_axis(Axis::linear("east in km"))
        .y_axis(Axis::linear("north in km"))
        .note(of.origin);
    for way in tracks.values() {
        plot = plot.series(Series::line("", way.iter().map(km).collect()));
    }
    let now = simulation.state().airplanes.iter().take(shown as usize);
    plot = plot.series(Series::points("now", now.map(|cell| km(&cell.pose().at)).collect()));
    Ok(plot.to_svg(&Style::CHART)?)
}

/// Compares the present poses with those recorded for the present cycle.
pub(super) fn compare(
    simulation: &AirspaceSimulation,
    folder: &Path,
) -> Result<Comparison, InputError> {
    let cycle = simulation.cycle();
    let Some(recorded) = rows(folder, cycle..=cycle)?.filter(|rows| !rows.is_empty()) else {
        return Ok(Comparison::NotRecorded);
    };
    let differs = |row: &&Recorded| {
        let cell = simulation.state().airplanes.get(row.airplane as usize);
        cell.is_none_or(|cell| cell.pose().at != row.at || cell.pose().psi_rad != row.heading_rad)
    };
    let different: Vec<u32> = recorded.iter().filter(differs).map(|r| r.airplane).collect();
    Ok(match different.is_empty() {
        true => Comparison::Equal(recorded.len()),
        false => Comparison::Different(different),
    })
}

/// The recorded poses of some cycles; `None` where there are none, or in another form.
fn rows(folder: &Path, cycles: RangeInclusive<Cycle>) -> Result<Option<Vec<Recorded>>, InputError> {
    if !crate::recorded::has_rows(folder, TABLE) {
        return Ok(None);
    }
    Ok(in_words(&read_table(folder, TABLE, cycles)?))
}

fn in_words(table: &Table) -> Option<Vec<Recorded>> {
    let numbers = |name| match table.column(name)? {
        Values::F64(values) => Some(values),
        _ => None,
    };
    let Values::U32(airplanes) = table.column("airplane")? else { return None };
    let (x, y, heading) = (numbers("x_m")?, numbers("y_m")?, numbers("heading_rad")?);
    let row =
        |k: usize| Recorded { airplane: airplanes[k], at: [x[k], y[k]], heading_rad: heading[k] };
    Some((0..airplanes.len()).map(row).collect())
}
