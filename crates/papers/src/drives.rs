//! What robots have done in drives, beside what a simulation predicts: does the model tell what is driven?
//!
//! `sidestep drive --out` writes a table of the motions of a robot. The same trips are simulated with many seeds, by a scenario that
//! has what was learned. A drive is one draw, so it is held against an interval that contains one more run.

use crate::methods::SeedSpan;
use crate::study::{Progress, run_all};
use serde::Serialize;
use serde_json::Value;
use sidestep::experiment::sweep::plan::check_seeds;
use sidestep::import::table::{CsvRow, CsvTable};
use sidestep::kernel::{Cycle, EntityId, InputError, Simulation};
use sidestep::scenario::Source;
use sidestep::statistics::{Interval, MIN_PREDICTION_VALUES, mean, prediction_interval};
use sidestep::worlds::robots::robots_run;
use sidestep_document::Table;
use sidestep_document::estimate::format_short;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a robot has done in a drive, or in a run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct DriveTotals {
    /// Its actions.
    pub actions: u64,
    /// The cycles that they took.
    pub cycles: u64,
    /// Actions that ended because they took too long; none in a run.
    pub timeouts: u64,
}

/// Reads tables of motions, and returns what each robot has done in all, by its id.
///
/// # Errors
/// When a table cannot be read, a robot is in two of them, or there is no row.
pub fn read_motions(files: &[PathBuf]) -> Result<BTreeMap<EntityId, DriveTotals>, InputError> {
    let mut driven: BTreeMap<EntityId, (DriveTotals, &Path)> = BTreeMap::new();
    for file in files {
        let table = CsvTable::read_recording(file)?;
        let [robot, delay, timeout] = table.columns(["robot", "delay_cycles", "timeout"])?;
        // A cut last line is of a drive that was killed: what it has done is not known as a whole.
        if let Some(misfit) = table.misfits().first() {
            return Err(table.misfit_error(*misfit));
        }
        for row in table.rows() {
            let id = row.field(robot).integer(&row.place())?;
            let delay_cycles = u64::from(row.field(delay).integer(&row.place())?);
            let (totals, first) = driven.entry(id).or_insert((DriveTotals::default(), file));
            if *first != file {
                let cause = format!("robot {id} is in {}, too", first.display());
                let remedy = "give one table for each robot, of the same drive";
                return Err(InputError::new(row.place(), cause, remedy));
            }
            totals.actions += 1;
            totals.cycles += 1 + delay_cycles;
            totals.timeouts += u64::from(is_timeout(row, timeout)?);
        }
    }
    if driven.is_empty() {
        let places: Vec<String> = files.iter().map(|file| file.display().to_string()).collect();
        let cause = "there are no motions";
        return Err(InputError::new(places.join(", "), cause, "drive first: sidestep drive --out"));
    }
    Ok(driven.into_iter().map(|(robot, (totals, _))| (robot, totals)).collect())
}

fn is_timeout(row: CsvRow<'_>, column: usize) -> Result<bool, InputError> {
    match row.text(column) {
        "yes" => Ok(true),
        "no" => Ok(false),
        other => {
            let cause = format!("`{other}` is neither yes nor no");
            Err(row.field(column).error(&row.place(), cause, "write yes or no"))
        }
    }
}

/// The runs by which drives are judged.
#[derive(Debug)]
pub struct DrivePrediction<'a> {
    /// The scenario, of the world robots, with what was learned.
    pub source: &'a Source,
    /// What was driven, by robot.
    pub driven: &'a BTreeMap<EntityId, DriveTotals>,
    /// The trips that each of these robots has made.
    pub trips: u64,
    /// The seeds of the runs.
    pub seeds: SeedSpan,
    /// Number of runs at the same time; only the time depends on it.
    pub workers: usize,
}

/// A number that was driven, beside what runs have of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PredictedNumber {
    /// `actions` or `cycles`.
    pub measure: &'static str,
    /// The robot; none for the sum of all.
    pub robot: Option<EntityId>,
    /// What was driven.
    pub driven: u64,
    /// The mean of all runs.
    pub mean: f64,
    /// The interval that contains one more run with a probability of at least 95 %.
    pub interval: Interval,
    /// Whether it contains what was driven.
    pub is_within: bool,
}

/// What is driven in one run, or why it is not known.
type RunTotals = Option<BTreeMap<EntityId, DriveTotals>>;

impl DrivePrediction<'_> {
    /// Simulates the trips with each seed, and returns the sums of all robots, and then the numbers of each.
    ///
    /// # Errors
    /// When the scenario is wrong or has no such robots, there are too few runs, or trips are not made within its cycles.
    pub fn run(&self, progress: &mut Progress<'_>) -> Result<Vec<PredictedNumber>, InputError> {
        let SeedSpan { first, runs } = self.seeds;
        check_seeds(first, runs as u64).map_err(|cause| {
            let remedy = "begin with a smaller seed, or run less often";
            InputError::new(self.source.file_place(), cause, remedy)
        })?;
        if runs < MIN_PREDICTION_VALUES {
            let cause =
                format!("{runs} runs have no interval with one more run in 95 of 100 cases");
            let remedy = format!("give at least {MIN_PREDICTION_VALUES}");
            return Err(InputError::new("--runs", cause, remedy));
        }
        self.check_robots()?;
        let seeds: Vec<u64> = (first..first + runs as u64).collect();
        let report = |share| progress("simulate what was driven", share);
        let totals = run_all(&seeds, self.workers, report, |seed| self.totals_of(*seed))?;
        let unfinished = totals.iter().filter(|totals| totals.is_none()).count();
        if unfinished > 0 {
            let cause =
                format!("in {unfinished} of {runs} runs not all trips are made within the cycles");
            let remedy = "give more --cycles, fewer --trips, or goals that can be reached";
            return Err(InputError::new(self.source.file_place(), cause, remedy));
        }
        let totals: Vec<BTreeMap<EntityId, DriveTotals>> = totals.into_iter().flatten().collect();
        let robots = self.driven.keys().map(|robot| Some(*robot));
        let of_robot = |robot: Option<EntityId>| {
            [
                predicted("actions", robot, self.driven, &totals, |totals| totals.actions),
                predicted("cycles", robot, self.driven, &totals, |totals| totals.cycles),
            ]
        };
        Ok(std::iter::once(None).chain(robots).flat_map(of_robot).collect())
    }

    /// Checks that the scenario has the robots that were driven.
    fn check_robots(&self) -> Result<(), InputError> {
        let run = robots_run(self.source, 1)?;
        let robots = run.agent_count() as EntityId;
        let Some(missing) = self.driven.keys().find(|robot| **robot >= robots) else {
            return Ok(());
        };
        let cause = format!("robot {missing} was driven, and the scenario has {robots} robots");
        Err(InputError::new(self.source.file_place(), cause, "give the scenario of the drive"))
    }

    /// Returns what the robots have done in a run when they have made their trips; none if they do not make them.
    fn totals_of(&self, seed: u64) -> Result<RunTotals, InputError> {
        let source = self.source.clone().with_overrides(&[format!("seed={seed}")])?;
        let mut run = robots_run(&source, 1)?;
        let none = TripCount { wanted: self.trips, ..TripCount::default() };
        let mut trips: BTreeMap<EntityId, TripCount> =
            self.driven.keys().map(|robot| (*robot, none)).collect();
        while !run.is_over() && run.cycle() < run.config().cycles {
            run.advance(1);
            let metrics = run.agent_metrics();
            let cycle = run.cycle();
            for (robot, count) in &mut trips {
                count.update(&metrics[*robot as usize]["counts"], cycle);
            }
            if trips.values().all(TripCount::is_done) {
                return Ok(Some(trips.into_iter().map(|(id, count)| (id, count.done)).collect()));
            }
        }
        Ok(None)
    }
}

/// The trips of a robot in a run.
#[derive(Debug, Clone, Copy, Default)]
struct TripCount {
    /// The trips that it is to make.
    wanted: u64,
    trips: u64,
    actions: u64,
    /// Cycles that were done when its last action had begun, and the one before.
    begun: [Cycle; 2],
    /// What it had done when its last trip was complete.
    done: DriveTotals,
}

impl TripCount {
    fn is_done(&self) -> bool {
        self.trips >= self.wanted
    }

    /// Takes the counts after a cycle, until all trips are made: what the robot does then is not driven.
    fn update(&mut self, counts: &Value, cycle: Cycle) {
        if self.is_done() {
            return;
        }
        let number = |name: &str| counts[name].as_u64().unwrap_or(0);
        if number("actions") > self.actions {
            self.actions = number("actions");
            self.begun = [cycle, self.begun[0]];
        }
        if number("trips") > self.trips {
            self.trips = number("trips");
            // The decision that has seen the goal has begun one more action, before which there may have been a delay.
            let actions = self.actions.saturating_sub(1);
            self.done = DriveTotals { actions, cycles: self.begun[1], timeouts: 0 };
        }
    }
}

fn predicted(
    measure: &'static str,
    robot: Option<EntityId>,
    driven: &BTreeMap<EntityId, DriveTotals>,
    runs: &[BTreeMap<EntityId, DriveTotals>],
    number: fn(&DriveTotals) -> u64,
) -> PredictedNumber {
    let of = |totals: &BTreeMap<EntityId, DriveTotals>| -> u64 {
        let chosen = totals.iter().filter(|(id, _)| robot.is_none_or(|robot| robot == **id));
        chosen.map(|(_, totals)| number(totals)).sum()
    };
    let mut values: Vec<f64> = runs.iter().map(|totals| of(totals) as f64).collect();
    values.sort_by(f64::total_cmp);
    let driven = of(driven);
    let interval = prediction_interval(&values).expect("the number of runs was checked");
    let is_within = interval.contains(driven as f64);
    PredictedNumber {
        measure,
        robot,
        driven,
        mean: mean(&values).expect("there are runs"),
        interval,
        is_within,
    }
}

/// Returns a table of the numbers, as reports have it.
pub fn table(numbers: &[PredictedNumber], runs: usize) -> Table {
    let note = format!(
        "{runs} runs. One more run would be within the interval in at least 95 of 100 cases. Of many robots some are outside of theirs \
         by chance: judge by all."
    );
    let columns = ["robot", "measure", "driven", "simulated, mean", "one more run", "within"];
    let mut table = Table::new("", note, &columns);
    for number in numbers {
        let robot = number.robot.map_or("all".into(), |robot| robot.to_string());
        let Interval { low, high } = number.interval;
        table.rows.push(vec![
            robot,
            number.measure.into(),
            number.driven.to_string(),
            format_short(number.mean),
            format!("{low} to {high}"),
            if number.is_within { "yes" } else { "no" }.into(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two robots without errors, on ways of 4 and of 3 boxes with a turn.
    const HALL: &str = "format = 1\nworld = \"robots\"\nseed = 1\ncycles = 200\n[map]\nascii = \"\"\"\n......\n......\n......\n\"\"\"\n\
        [[robots]]\nat = [[0, 0, 0]]\neffector = \"EFFECTOR\"\nbehaviour = { kind = \"goto\", goals = [[4, 0]] }\n\
        [[robots]]\nat = [[0, 2, 0]]\neffector = \"EFFECTOR\"\nbehaviour = { kind = \"goto\", goals = [[2, 1]] }\n";

    const HEAD: &str = "cycle,robot,action,ahead_boxes,left_boxes,turn_deg,contact,effector,box_m,delay_cycles,\
        duration_s,end_s,timeout\n";

    fn hall(effector: &str) -> Source {
        Source::new("hall.toml", HALL.replace("EFFECTOR", effector), "")
    }

    /// Returns a table of actions of a robot, each with its delay.
    fn motions(robot: u32, delays: &[u64]) -> String {
        let row = |delay| format!("0,{robot},forward,1,0,0,no,nomad,0.5,{delay},1,1,no\n");
        HEAD.to_string() + &delays.iter().map(row).collect::<String>()
    }

    fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
        let file = folder.join(name);
        std::fs::write(&file, text).expect("written");
        file
    }

    fn prediction<'a>(
        source: &'a Source,
        driven: &'a BTreeMap<EntityId, DriveTotals>,
        runs: usize,
    ) -> DrivePrediction<'a> {
        DrivePrediction { source, driven, trips: 1, seeds: SeedSpan { first: 1, runs }, workers: 2 }
    }

    #[test]
    fn tables_of_motions_are_summed_by_robot_and_each_robot_counts_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = write(folder.path(), "0.csv", &motions(0, &[0, 2, 1]));
        let other = motions(1, &[0]).replace(",no\n", ",yes\n");
        let second = write(folder.path(), "1.csv", &other);
        let driven = read_motions(&[first.clone(), second]).expect("tables");
        let totals = |actions, cycles, timeouts| DriveTotals { actions, cycles, timeouts };
        assert_eq!(driven, BTreeMap::from([(0, totals(3, 6, 0)), (1, totals(1, 1, 1))]));
        let again = write(folder.path(), "2.csv", &motions(0, &[0]));
        let refused = read_motions(&[first.clone(), again]).expect_err("robot 0 twice");
        assert!(refused.to_string().contains("0.csv"), "{refused}");
        let cut = write(folder.path(), "3.csv", &(motions(3, &[0]) + "1,3,forward"));
        assert!(read_motions(&[cut]).is_err(), "what was driven is not whole");
        let empty = write(folder.path(), "4.csv", HEAD);
        assert!(read_motions(&[empty]).expect_err("nothing").to_string().contains("no motions"));
        let misspelled = write(folder.path(), "5.csv", &motions(0, &[0]).replace(",no\n", ",on\n"));
        assert!(read_motions(&[misspelled]).expect_err("`on`").to_string().contains("yes nor no"));
    }

    #[test]
    fn trips_without_errors_are_predicted_to_the_action_and_the_cycle() {
        let source = hall("perfect");
        let totals = |actions| DriveTotals { actions, cycles: actions, timeouts: 0 };
        // Two boxes, a turn and a box are four actions.
        let driven = BTreeMap::from([(0, totals(4)), (1, totals(4))]);
        let numbers = prediction(&source, &driven, 39).run(&mut |_, _| {}).expect("trips");
        let found: Vec<_> =
            numbers.iter().map(|it| (it.measure, it.robot, it.mean, it.is_within)).collect();
        let expected = [
            ("actions", None, 8.0, true),
            ("cycles", None, 8.0, true),
            ("actions", Some(0), 4.0, true),
            ("cycles", Some(0), 4.0, true),
            ("actions", Some(1), 4.0, true),
            ("cycles", Some(1), 4.0, true),
        ];
        assert_eq!(found, expected);
        let slow = BTreeMap::from([(0, DriveTotals { cycles: 9, ..totals(4) })]);
        let numbers = prediction(&source, &slow, 39).run(&mut |_, _| {}).expect("trips");
        assert_eq!(
            numbers.iter().map(|it| it.is_within).collect::<Vec<_>>(),
            [true, false, true, false]
        );
        let table = table(&numbers, 39);
        assert_eq!(table.rows[1], ["all", "cycles", "9", "4.00", "4 to 4", "no"]);
    }

    #[test]
    fn what_the_runs_cannot_tell_is_refused_with_what_would_be_right() {
        let source = hall("nomad");
        let driven = BTreeMap::from([(0, DriveTotals::default())]);
        let few = prediction(&source, &driven, 38).run(&mut |_, _| {}).expect_err("too few");
        assert!(few.remedy().contains("39"), "{few}");
        let other = BTreeMap::from([(2, DriveTotals::default())]);
        let other = prediction(&source, &other, 39).run(&mut |_, _| {}).expect_err("no robot 2");
        assert!(other.to_string().contains("2 robots"), "{other}");
        let short = source.clone().with_overrides(&["cycles=3".to_string()]).expect("a scenario");
        let short = prediction(&short, &driven, 39).run(&mut |_, _| {}).expect_err("no trip");
        assert!(
            short.to_string().contains("39 of 39") && short.remedy().contains("--cycles"),
            "{short}"
        );
    }
}
