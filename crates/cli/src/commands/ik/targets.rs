//! Many targets from a table, and the table of their results.

use super::super::arm::Arm;
use super::args::{GoalArgs, TipTarget};
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use cpu_time::ProcessTime;
use serde::Serialize;
use sidestep::arms::kinematics::IkResult;
use sidestep::import::table::{CsvRow, CsvTable};
use sidestep::kernel::InputError;
use std::path::Path;

/// Names of the columns of positions, without and with orientations.
const POSITION_COLUMNS: [&str; 3] = ["x", "y", "z"];
const RPY_COLUMNS: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];
const QUATERNION_COLUMNS: [&str; 7] = ["x", "y", "z", "qx", "qy", "qz", "qw"];
/// The largest number in a table, a place in m or an angle in rad: larger ones are mistyped or in other units.
const MAX_VALUE: f64 = 1e7;

/// The results of all targets.
#[derive(Debug, Serialize)]
struct IkTable {
    targets: usize,
    reached: usize,
    /// Meshes that stand as boxes, and shapes that could not be read.
    remarks: Vec<String>,
    /// Names of the joints that the values of each result belong to.
    joint_names: Vec<String>,
    /// CPU time of the search in us per target. It is no part of the results.
    cpu_us_per_target: f64,
    answers: Vec<IkTableRow>,
}

/// The result of a target.
#[derive(Debug, Serialize)]
struct IkTableRow {
    reached: bool,
    error_m: f64,
    error_rad: f64,
    iterations: usize,
    starts: usize,
    /// Joint values from the base out, in rad or m; if it is not reached, those that came nearest.
    joints: Vec<f64>,
    /// Joint values of further postures.
    others: Vec<Vec<f64>>,
    reason: Option<String>,
}

/// Solves all targets of a table, and prints the results.
///
/// # Errors
/// When the table or an option is wrong.
pub(super) fn solve_table(
    path: &Path,
    arm: &Arm,
    args: &GoalArgs,
    console: Console,
) -> Result<ExitCode, Failure> {
    let (body, remarks) = args.body(arm)?;
    let goals = read_targets(path)?.into_iter().map(|target| args.goal(target, &body));
    let goals = goals.collect::<Result<Vec<_>, InputError>>()?;
    let start = ProcessTime::now();
    let solved = goals.iter().map(|goal| arm.selection.chain.solve(goal, &arm.values));
    let solved = solved.collect::<Result<Vec<_>, InputError>>()?;
    let cpu_us = start.elapsed().as_secs_f64() * 1e6;
    let answers = IkTable {
        targets: goals.len(),
        reached: solved.iter().filter(|answer| answer.reached).count(),
        remarks,
        joint_names: arm.selection.chain.variables.iter().map(|v| v.name.clone()).collect(),
        cpu_us_per_target: cpu_us / goals.len().max(1) as f64,
        answers: solved.into_iter().map(IkTableRow::new).collect(),
    };
    console.print_result(&answers, || answers.to_csv())?;
    let IkTable { targets, reached, cpu_us_per_target, remarks, .. } = &answers;
    remarks.iter().for_each(|remark| console.note(remark));
    console.note(format!("{reached} of {targets} reached, {cpu_us_per_target:.0} us each"));
    Ok(if reached == targets { ExitCode::Done } else { ExitCode::Failed })
}

impl IkTableRow {
    fn new(result: IkResult) -> Self {
        Self {
            reached: result.reached,
            error_m: result.error_m,
            error_rad: result.error_rad,
            iterations: result.iterations,
            starts: result.starts,
            joints: result.values,
            others: result.others.into_iter().map(|posture| posture.values).collect(),
            reason: result.reason.map(|reason| reason.to_string()),
        }
    }

    fn csv_line(&self, target: usize, joints: &[f64]) -> String {
        let Self { reached, error_m, error_rad, iterations, starts, .. } = self;
        let joints: String = joints.iter().map(|value| format!(",{value}")).collect();
        let reason = self.reason.as_deref().unwrap_or_default().replace('"', "\"\"");
        format!(
            "{target},{reached},{error_m},{error_rad},{iterations},{starts}{joints},\"{reason}\"\n"
        )
    }
}

impl IkTable {
    /// Returns the answers as CSV: a row for each posture, with the number of its target from 1.
    fn to_csv(&self) -> String {
        let names: String = self
            .joint_names
            .iter()
            .map(|name| format!(",\"{}\"", name.replace('"', "\"\"")))
            .collect();
        let mut text =
            format!("target,reached,error_m,error_rad,iterations,starts{names},reason\n");
        for (i, row) in self.answers.iter().enumerate() {
            for joints in std::iter::once(&row.joints).chain(&row.others) {
                text += &row.csv_line(i + 1, joints);
            }
        }
        text
    }
}

/// Reads the targets from the columns of a CSV file, whose names decide how orientations are given.
fn read_targets(path: &Path) -> Result<Vec<TipTarget>, InputError> {
    let table = CsvTable::read(path)?;
    let rotation_columns = POSITION_COLUMNS.len()..;
    let has_rpy = has_any_column(&table, &RPY_COLUMNS[rotation_columns.clone()]);
    let has_quaternions = has_any_column(&table, &QUATERNION_COLUMNS[rotation_columns]);
    if has_rpy && has_quaternions {
        let cause = "the header has both angles and quaternions";
        let remedy = "keep roll,pitch,yaw or qx,qy,qz,qw";
        return Err(InputError::new(table.place(), cause, remedy).with_position(1, 1));
    }
    if has_rpy {
        read_rpy_targets(&table)
    } else if has_quaternions {
        read_quaternion_targets(&table)
    } else {
        let position = table.columns(POSITION_COLUMNS)?;
        let mut targets = Vec::new();
        for row in table.rows() {
            targets.push(TipTarget::from_position(values(&table, row, position)?));
        }
        Ok(targets)
    }
}

fn has_any_column(table: &CsvTable, names: &[&str]) -> bool {
    names.iter().any(|name| table.find(name).is_some())
}

fn read_rpy_targets(table: &CsvTable) -> Result<Vec<TipTarget>, InputError> {
    let [x, y, z, roll, pitch, yaw] = table.columns(RPY_COLUMNS)?;
    let mut targets = Vec::new();
    for row in table.rows() {
        let position_m = values(table, row, [x, y, z])?;
        targets.push(TipTarget::from_rpy(position_m, values(table, row, [roll, pitch, yaw])?));
    }
    Ok(targets)
}

fn read_quaternion_targets(table: &CsvTable) -> Result<Vec<TipTarget>, InputError> {
    let [x, y, z, quaternion @ ..] = table.columns(QUATERNION_COLUMNS)?;
    let mut targets = Vec::new();
    for row in table.rows() {
        let place = row.field(quaternion[0]);
        let position_m = values(table, row, [x, y, z])?;
        let rotation = values(table, row, quaternion)?;
        let target = TipTarget::from_quaternion(table.place(), position_m, rotation)
            .map_err(|error| error.with_position(place.line, place.column))?;
        targets.push(target);
    }
    Ok(targets)
}

fn values<const N: usize>(
    table: &CsvTable,
    row: CsvRow,
    columns: [usize; N],
) -> Result<[f64; N], InputError> {
    let mut numbers = [0.0; N];
    for (value, column) in numbers.iter_mut().zip(columns) {
        let field = row.field(column);
        *value = field.number(&table.place())?;
        if value.abs() > MAX_VALUE {
            let cause = format!("{value} is out of range");
            return Err(field.error(&table.place(), cause, "give places in m and angles in rad"));
        }
    }
    Ok(numbers)
}
