//! Tasks of a section of robots: where their errands are, and how they are given.

use super::super::{TaskPolicyName, TaskSection};
use super::*;
use sidestep_import::lorr;
use sidestep_planners::TeamTasks;
use sidestep_planners::tasks::TaskPolicy;

/// Robots whose tasks are compared at once under the policy `optimal`: the comparison takes the cube of it.
const OPTIMAL_WINDOW: usize = 64;

impl Compiler<'_> {
    /// Returns the tasks of a section of `count` robots.
    pub(super) fn tasks(
        &self,
        s: &RobotSection,
        count: u64,
    ) -> Result<Option<TeamTasks>, InputError> {
        let Some(section) = &s.tasks else { return Ok(None) };
        if s.planner.is_none() {
            let cause =
                "the robots have tasks and no planner, and a planner says who carries out which";
            let remedy = "add planner = { method = \"pibt\" }";
            return Err(self.source.error(section.span(), cause, remedy));
        }
        let size = s.size.map_or(1, |side| side.get() as u32);
        let anchors = FreeSpace::from_map(&self.map).anchors(size);
        let fits = |(col, row): (u32, u32)| {
            col < anchors.width() && row < anchors.height() && anchors.is_free(col, row)
        };
        let tasks = self.task_list(section, size, fits)?;
        let reveal = section.get_ref().reveal.map_or(1.0, |reveal| reveal.get());
        let known = (reveal * count as f64) as usize;
        let policy = match section.get_ref().policy {
            TaskPolicyName::Nearest => TaskPolicy::Nearest,
            TaskPolicyName::Fifo => TaskPolicy::Fifo,
            TaskPolicyName::Optimal => TaskPolicy::Optimal { window: OPTIMAL_WINDOW },
        };
        Ok(Some(TeamTasks { tasks, known: known.max(1), policy }))
    }

    fn task_list(
        &self,
        section: &Spanned<TaskSection>,
        size: u32,
        fits: impl Fn((u32, u32)) -> bool,
    ) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
        match (&section.get_ref().list, &section.get_ref().file) {
            (Some(list), None) if !list.is_empty() => {
                list.iter().map(|task| self.listed_task(task, size, &fits)).collect()
            }
            (None, Some(file)) => self.filed_tasks(file, size, fits),
            (Some(_), Some(file)) => {
                let cause = "the tasks are in a list and in a file";
                Err(self.source.error(file.span(), cause, "give `list` or `file`"))
            }
            _ => {
                let cause = "no tasks are given";
                let remedy = "add list = [[[col, row], [col, row]], ...]: the errands of each task";
                Err(self.source.error(section.span(), cause, remedy))
            }
        }
    }

    /// Checks one task of a list.
    fn listed_task(
        &self,
        task: &Spanned<Vec<(u32, u32)>>,
        size: u32,
        fits: impl Fn((u32, u32)) -> bool,
    ) -> Result<Vec<(u32, u32)>, InputError> {
        let errands = task.get_ref();
        if errands.is_empty() {
            let remedy = "give at least one [col, row]";
            return Err(self.source.error(task.span(), "the task has no errand", remedy));
        }
        match errands.iter().find(|&&errand| !fits(errand)) {
            None => Ok(errands.clone()),
            Some(errand) => {
                let (cause, remedy) = self.misfit(*errand, size);
                Err(self.source.error(task.span(), cause, remedy))
            }
        }
    }

    /// Reads a list of the League of Robot Runners.
    fn filed_tasks(
        &self,
        file: &Spanned<PathBuf>,
        size: u32,
        fits: impl Fn((u32, u32)) -> bool,
    ) -> Result<Vec<Vec<(u32, u32)>>, InputError> {
        let tasks = lorr::load_tasks(&self.source.path(file.get_ref()), &self.map);
        let tasks = tasks.map_err(|error| self.source.with_key_at(file.span(), error))?;
        match tasks.iter().flatten().find(|&&errand| !fits(errand)) {
            None => Ok(tasks),
            Some(errand) => {
                let (cause, _) = self.misfit(*errand, size);
                let remedy = "give smaller robots, or another list";
                Err(self.source.error(file.span(), cause, remedy))
            }
        }
    }

    fn misfit(&self, errand: (u32, u32), size: u32) -> (String, &'static str) {
        let columns = self.map.width();
        let rows = self.map.height();
        let (col, row) = errand;
        let remedy =
            "give the lower-left box of a free place; `sidestep map FILE --box B` shows them";
        if col >= columns || row >= rows {
            let cause = format!(
                "the errand at [{col}, {row}] is outside the map of {columns} x {rows} boxes"
            );
            return (cause, remedy);
        }
        let cause =
            format!("a robot of {size} x {size} boxes does not fit at the errand [{col}, {row}]");
        (cause, remedy)
    }
}
