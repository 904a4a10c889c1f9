//! A run of robots in the output format of the League of Robot Runners of 2026, which its viewer PlanViz opens, with the
//! map of the run.
//!
//! The state before and after each cycle says what a robot did in this tick, and what became of its task. What a run does
//! not hold is left out: `plannerTimes`, `numEntryTimeouts`, and the numbers of errors.

mod actions;
mod tasks;

use super::target::Target;
use super::{ExportContext, ExportResult};
use crate::Error;
use crate::driver::Sinks;
use crate::files::write_file;
use crate::frame_sink::FrameSink;
use actions::RobotActions;
use serde_json::{Value, json};
use sidestep_kernel::view::{GridPlace, GridTeam, Occupancy, OccupancyGrid};
use sidestep_kernel::{Cycle, InputError, Simulation};
use std::io::Write;
use tasks::TaskHistory;

/// The files of the folder.
const OUTPUT: &str = "output.json";
const MAP: &str = "map.map";

/// Exports a run from its first cycle on.
pub(super) fn export(job: &ExportContext<'_>) -> Result<ExportResult, Error> {
    let target = Target::for_folder(job, "-lorr")?;
    let mut run = job.run_up_to(0)?;
    let floor = run.scenery().floor;
    let team = run.grid_team(0).map_err(|why| refuse(job, why))?;
    let Some(floor) = floor.filter(|_| !team.agents.is_empty()) else {
        let cause = "there are no robots in this run";
        return Err(refuse(job, [cause, "export a run of robots"].map(str::to_string)).into());
    };
    let mut sink = LeagueSink::new(floor.height, team, job);
    let is_confirmed = target.write_folder(job.watcher, |folder| {
        let sinks = Sinks { frames: Some(&mut sink), ..Sinks::default() };
        job.drive(run.as_mut(), job.span.until, sinks)?;
        let output = sink.output();
        let path = folder.join(OUTPUT);
        write_file(&path, |out| {
            serde_json::to_writer(&mut *out, &output)?;
            out.write_all(b"\n")
        })
        .map_err(|e| Error::cannot_store(&path, &e))?;
        let path = folder.join(MAP);
        write_file(&path, |out| out.write_all(map_text(&floor).as_bytes()))
            .map_err(|e| Error::cannot_store(&path, &e))?;
        job.recorded.verify_digest(run.as_ref())
    })?;
    let paths = [OUTPUT, MAP].map(|name| target.path().join(name)).to_vec();
    Ok(ExportResult { paths, is_confirmed, film: None })
}

fn refuse(job: &ExportContext<'_>, [cause, remedy]: [String; 2]) -> InputError {
    InputError::new(job.recorded.path.display(), cause, remedy)
}

/// Returns a floor as a map of MovingAI: the northern row comes first.
fn map_text(floor: &OccupancyGrid) -> String {
    let mut text = format!("type octile\nheight {}\nwidth {}\nmap\n", floor.height, floor.width);
    for row in floor.boxes.chunks(floor.width as usize).rev() {
        text.extend(row.iter().map(|&content| if content == Occupancy::Free { '.' } else { '@' }));
        text.push('\n');
    }
    text
}

/// Collects what robots do, tick by tick.
struct LeagueSink<'a> {
    job: &'a ExportContext<'a>,
    /// Rows of the map: the League counts them from the north.
    rows: u32,
    cycle: Cycle,
    before: GridTeam,
    robots: Vec<RobotActions>,
    tasks: TaskHistory,
}

impl<'a> LeagueSink<'a> {
    fn new(rows: u32, team: GridTeam, job: &'a ExportContext<'a>) -> Self {
        let robots = team.agents.iter().map(|agent| RobotActions::new(agent.place)).collect();
        let tasks = TaskHistory::new(team.agents.len());
        Self { job, rows, cycle: 0, before: team, robots, tasks }
    }

    /// Returns the file, with the keys of the League.
    fn output(mut self) -> Value {
        for robot in &mut self.robots {
            robot.finish(self.cycle);
        }
        let starts: Vec<Value> = self.robots.iter().map(|robot| self.start(robot.start)).collect();
        let [actual, planned] = [RobotActions::actual, RobotActions::planned]
            .map(|text| self.robots.iter().map(text).collect::<Vec<&str>>());
        let delays: Vec<&[[Cycle; 2]]> = self.robots.iter().map(RobotActions::delays).collect();
        let schedules = self.tasks.schedules();
        json!({
            "actionModel": "MAPF_T",
            "version": "2026 LoRR",
            "AllValid": "Yes",
            "teamSize": self.robots.len(),
            "numTaskFinished": self.before.finished_tasks,
            "sumOfCost": self.tasks.busy_ticks,
            "makespan": self.cycle,
            "agentMaxCounter": self.before.action_cycles,
            "outputSegmentSize": actions::SEGMENT_TICKS,
            "delayIntervals": delays,
            "start": starts,
            "actualPaths": actual,
            "plannerPaths": planned,
            "errors": [],
            "actualSchedule": schedules,
            "plannerSchedule": schedules,
            "scheduleErrors": [],
            "events": self.tasks.events(),
            "tasks": self.tasks.list(self.rows, self.robots[0].start),
        })
    }

    fn start(&self, place: GridPlace) -> Value {
        let heading = ["E", "N", "W", "S"][usize::from(place.heading)];
        json!([self.rows - 1 - place.row, place.col, heading])
    }
}

impl FrameSink for LeagueSink<'_> {
    fn interval(&self) -> Cycle {
        1
    }

    fn capture(&mut self, run: &mut dyn Simulation) -> Result<(), Error> {
        let now = run.cycle();
        if now == self.cycle {
            return Ok(());
        }
        let tick = self.cycle;
        let known = self.tasks.revealed();
        let team = run.grid_team(known).map_err(|why| refuse(self.job, why))?;
        let agents = self.before.agents.iter().zip(&team.agents);
        for ((id, robot), (before, after)) in self.robots.iter_mut().enumerate().zip(agents) {
            let state = actions::TickState { tick, rows: self.rows, cycles: team.action_cycles };
            robot.push(state, before, after).map_err(|cause| {
                let cause = format!("robot {id} {cause} in cycle {tick}: no action of the League");
                let remedy = "export a part before this cycle with --until, or to csv or mcap";
                refuse(self.job, [cause, remedy.to_string()])
            })?;
        }
        self.tasks.push(tick, &self.before, &team);
        self.before = team;
        self.cycle = now;
        Ok(())
    }
}
