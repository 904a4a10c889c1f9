//! The motions of the joints of arms in a recorded run, as controllers of arms take them.

use crate::{Error, RecordedRun};
use sidestep_kernel::ports::ColumnValues;
use sidestep_kernel::{Cycle, InputError};
use sidestep_record::{Table, for_each_block};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// The table that has the values of joints.
const TABLE: &str = "joints";

/// The motion of the joints of one arm. Rows of values have one for each joint.
#[derive(Debug, Clone, PartialEq)]
pub struct ArmTrajectory {
    /// The number of its chain.
    pub chain: u32,
    /// The name of its chain, or `chain_` and its number, with another number behind where a chain has that
    /// name; names of ROS: letters, digits and `_`.
    pub name: String,
    /// The names of its joints, from base to tip.
    pub joints: Vec<String>,
    /// The time of each point, seconds since the start of the run, rising.
    pub times_s: Vec<f64>,
    /// The values of the joints at these times, rad or m.
    pub positions: Vec<Vec<f64>>,
    /// Their speeds, rad/s or m/s: of the parabola through the values before, at and after each time. At the start of
    /// a run arms rest.
    pub velocities: Vec<Vec<f64>>,
    /// Their accelerations, rad/s2 or m/s2, by the same parabola.
    pub accelerations: Vec<Vec<f64>>,
}

/// Returns the motions of all arms in cycles of a recorded run that are multiples of `every`, by chain.
///
/// # Errors
/// When the run has no arms, or recorded no joints; when its scenario is no longer valid, or a file is damaged.
pub fn arm_trajectories(
    recorded: &RecordedRun,
    cycles: RangeInclusive<Cycle>,
    every: Cycle,
) -> Result<Vec<ArmTrajectory>, Error> {
    let Some(folder) = &recorded.folder else {
        let remedy = "give the run folder; one is made by `sidestep run SCENARIO --out DIR`";
        let cause = "a recording for viewers has no tables";
        return Err(InputError::new(recorded.path.display(), cause, remedy).into());
    };
    if !recorded.tables()?.iter().any(|table| table == TABLE) {
        let cause = "the run recorded no joints of arms";
        let remedy = "run a scenario with an arm (`arm = { urdf = \"FILE\" }`) and without record.joints = false";
        return Err(InputError::new(recorded.path.display(), cause, remedy).into());
    }
    let scenery = recorded.start_for_viewing(1)?.scenery();
    let mut arms: BTreeMap<u32, JointRows> = BTreeMap::new();
    let starts_run = *cycles.start() == 0;
    for_each_block(folder, TABLE, cycles, |block| {
        let added = add_block(&mut arms, &block, every);
        added.ok_or_else(|| {
            let remedy = "run its scenario again with this version";
            InputError::new(folder.display(), "the table joints has no names of joints", remedy)
        })?;
        Ok::<(), Error>(())
    })?;
    let names: BTreeMap<u32, &String> =
        scenery.names.iter().map(|(_, number, name)| (*number, name)).collect();
    let mut trajectories = Vec::new();
    for (chain, rows) in arms {
        let given = names.get(&chain).map(|name| name.as_str());
        let is_taken =
            |name: &str| trajectories.iter().any(|other: &ArmTrajectory| other.name == name);
        let name = arm_name(given, chain, is_taken);
        trajectories.push(rows.trajectory(chain, name, scenery.cycle_s, starts_run));
    }
    Ok(trajectories)
}

/// Returns the name of an arm that no other has taken: that of its chain, or else one of its chain's number.
fn arm_name(given: Option<&str>, chain: u32, is_taken: impl Fn(&str) -> bool) -> String {
    // Names of topics begin with a letter.
    let named =
        given.map(ros_name).filter(|name| name.starts_with(|c: char| c.is_ascii_alphabetic()));
    let numbered = std::iter::once(format!("chain_{chain}"));
    // Other chains may have the names that this one would get from its number.
    let others = (2_u32..).map(|n| format!("chain_{chain}_{n}"));
    let mut names = named.into_iter().chain(numbered).chain(others);
    names.find(|name| !is_taken(name)).unwrap_or_default()
}

/// Returns a name without characters that a topic may not have.
pub(crate) fn ros_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// The recorded rows of one arm.
#[derive(Default)]
struct JointRows {
    joints: Vec<String>,
    cycles: Vec<Cycle>,
    positions: Vec<Vec<f64>>,
}

impl JointRows {
    fn push(&mut self, cycle: Cycle, joint: usize, name: &str, value: f64) {
        if self.cycles.last() != Some(&cycle) {
            self.cycles.push(cycle);
            self.positions.push(Vec::new());
        }
        if self.joints.len() == joint {
            self.joints.push(name.to_string());
        }
        if let Some(row) = self.positions.last_mut() {
            row.push(value);
        }
    }

    fn trajectory(self, chain: u32, name: String, cycle_s: f64, starts_run: bool) -> ArmTrajectory {
        let Self { joints, cycles, positions } = self;
        let times_s: Vec<f64> = cycles.iter().map(|cycle| *cycle as f64 * cycle_s).collect();
        let mut velocities = Vec::with_capacity(times_s.len());
        let mut accelerations = Vec::with_capacity(times_s.len());
        for i in 0..times_s.len() {
            let rates = rates_at(&times_s, &positions, i);
            let rests = i == 0 && starts_run;
            let rates = if rests { vec![[0.0; 2]; joints.len()] } else { rates };
            velocities.push(rates.iter().map(|rate| rate[0]).collect());
            accelerations.push(rates.iter().map(|rate| rate[1]).collect());
        }
        ArmTrajectory { chain, name, joints, times_s, positions, velocities, accelerations }
    }
}

/// Returns speed and acceleration of each joint at a point: of the parabola through it and its neighbors, of the
/// straight line to the only neighbor at either end, and 0 of a single point.
fn rates_at(times_s: &[f64], positions: &[Vec<f64>], i: usize) -> Vec<[f64; 2]> {
    let slope = |a: usize, b: usize, joint: usize| {
        (positions[b][joint] - positions[a][joint]) / (times_s[b] - times_s[a])
    };
    let last = times_s.len() - 1;
    let joints = 0..positions[i].len();
    if last == 0 {
        return joints.map(|_| [0.0; 2]).collect();
    }
    if i == 0 || i == last {
        let from = i.min(last - 1);
        return joints.map(|joint| [slope(from, from + 1, joint), 0.0]).collect();
    }
    let before_s = times_s[i] - times_s[i - 1];
    let after_s = times_s[i + 1] - times_s[i];
    let span_s = before_s + after_s;
    let rates = joints.map(|joint| {
        let before = slope(i - 1, i, joint);
        let after = slope(i, i + 1, joint);
        let speed = (before * after_s + after * before_s) / span_s;
        [speed, 2.0 * (after - before) / span_s]
    });
    rates.collect()
}

/// Adds the rows of a block; `None` where it has not all columns.
fn add_block(arms: &mut BTreeMap<u32, JointRows>, block: &Table, every: Cycle) -> Option<()> {
    let ColumnValues::U64(cycles) = block.column("cycle")? else { return None };
    let ColumnValues::U32(chains) = block.column("chain")? else { return None };
    let ColumnValues::U32(joints) = block.column("joint")? else { return None };
    let ColumnValues::F64(values) = block.column("value")? else { return None };
    let ColumnValues::Label(names) = block.column("name")? else { return None };
    let labels = &block.schema.columns.iter().find(|column| column.name == "name")?.labels;
    for row in 0..block.rows() {
        if cycles[row].is_multiple_of(every) {
            let name = labels.get(names[row] as usize)?;
            let rows = arms.entry(chains[row]).or_default();
            rows.push(cycles[row], joints[row] as usize, name, values[row]);
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_two_arms_have_one_name() {
        let mut taken: Vec<String> = Vec::new();
        for (chain, given) in [Some("chain_1"), None, Some("left arm"), Some("left_arm"), Some("4")]
            .into_iter()
            .enumerate()
        {
            let name =
                arm_name(given, chain as u32, |name| taken.iter().any(|other| other == name));
            taken.push(name);
        }
        assert_eq!(taken, ["chain_1", "chain_1_2", "left_arm", "chain_3", "chain_4"]);
    }

    #[test]
    fn rates_are_those_of_a_parabola_also_at_uneven_times() {
        let times_s = [0.0, 0.1, 0.4, 0.5];
        let parabola = |t: f64| 1.0 + 2.0 * t - 3.0 * t * t;
        let positions: Vec<Vec<f64>> = times_s.iter().map(|t| vec![parabola(*t)]).collect();
        for i in [1, 2] {
            let [speed, acceleration] = rates_at(&times_s, &positions, i)[0];
            assert!((speed - (2.0 - 6.0 * times_s[i])).abs() < 1e-12, "{speed}");
            assert!((acceleration + 6.0).abs() < 1e-12, "{acceleration}");
        }
        let [speed, acceleration] = rates_at(&times_s, &positions, 3)[0];
        assert!((speed + 0.7).abs() < 1e-12 && acceleration == 0.0, "{speed}");
        assert_eq!(rates_at(&times_s[..1], &positions[..1], 0), [[0.0; 2]]);
    }
}
