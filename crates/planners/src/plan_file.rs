//! Plans in files: one line for each agent, with its start and its actions.
//!
//! ```text
//! # column row heading actions
//! 0 0 0 FFLFW
//! 7 2 2 WFFF
//! ```
//!
//! Headings are 0 east, 1 north, 2 west, 3 south. Actions are `F` forward, `L` and `R` a quarter turn, `W` wait; after its
//! last one an agent waits. Empty lines, and what follows a `#`, mean nothing.

use crate::instance::{Agent, Instance};
use crate::plan::{Plan, PlanError};
use crate::pose::{Action, ActionModel, GridPose};
use sidestep_kernel::InputError;
use sidestep_map::planning::FreeSpace;
use std::fmt::Write as _;

/// Letters of the actions.
const LETTERS: [(char, Action); 4] = [
    ('F', Action::Forward),
    ('L', Action::TurnLeft),
    ('R', Action::TurnRight),
    ('W', Action::Wait),
];

/// A plan that was read, and the line of each agent, from 1 on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlanFile {
    /// The plan.
    pub plan: Plan,
    /// The line of each agent.
    pub lines: Vec<usize>,
}

/// Reads a plan of agents that have headings. `place` is the name of the file, for errors.
///
/// # Errors
/// Where a line has no start, another character than those of actions, or an agent leaves the grid to the west or south,
/// and where there is no agent.
pub fn read(place: &str, text: &str) -> Result<PlanFile, InputError> {
    let mut lines = Vec::new();
    let mut paths = Vec::new();
    for (index, line) in text.lines().enumerate() {
        let words = line.split('#').next().unwrap_or_default().trim();
        if !words.is_empty() {
            let path = read_path(words);
            paths.push(path.map_err(|(cause, remedy)| {
                InputError::new(place, cause, remedy).with_position(index + 1, 1)
            })?);
            lines.push(index + 1);
        }
    }
    if paths.is_empty() {
        let remedy = "write one line for each robot: its column, row and heading, and its actions, as in 0 0 0 FFLFW";
        return Err(InputError::new(place, "has no plan", remedy));
    }
    Ok(PlanFile { plan: Plan::new(paths), lines })
}

fn read_path(words: &str) -> Result<Vec<GridPose>, (String, &'static str)> {
    let mut words = words.split_whitespace();
    let mut number = |name: &str| {
        let word = words.next().unwrap_or_default();
        let remedy =
            "write column, row and heading of the start, then the actions, as in 0 0 0 FFLFW";
        // The bound leaves room for a body, and for the steps of any plan.
        let number = word.parse::<u32>().ok().filter(|&number| number <= u32::MAX / 2);
        number.ok_or_else(|| (format!("the {name} of the start is `{word}`"), remedy))
    };
    let [col, row, heading] = [number("column")?, number("row")?, number("heading")?];
    if heading > 3 {
        let remedy = "write 0 for east, 1 for north, 2 for west or 3 for south";
        return Err((format!("the heading of the start is {heading}"), remedy));
    }
    let mut path = vec![GridPose::new(col, row, heading as u8)];
    for letter in words.flat_map(str::chars) {
        let Some(&(_, action)) = LETTERS.iter().find(|(known, _)| *known == letter) else {
            let remedy = "write F (forward), L (left), R (right) or W (wait) for each action";
            return Err((format!("an action is `{}`", letter.escape_debug()), remedy));
        };
        let pose = path[path.len() - 1];
        let Some(next) = pose.after(action) else {
            let cause =
                format!("step {} leaves the map from box {:?}", path.len(), pose.position());
            return Err((cause, "give actions that stay on the map"));
        };
        path.push(next);
    }
    Ok(path)
}

impl PlanFile {
    /// Checks that agents with bodies of these sizes can carry the plan out on a floor without a conflict.
    ///
    /// # Errors
    /// Where the plan is wrong, with the line of an agent that is part of it.
    pub fn check(&self, place: &str, free: &FreeSpace, sizes: &[u32]) -> Result<(), InputError> {
        let error = |agent: usize, cause: String| {
            let remedy = "give a plan without conflicts on this map, for robots of these sizes, from where they start";
            let line = self.lines.get(agent).or(self.lines.last()).copied().unwrap_or(1);
            InputError::new(place, cause, remedy).with_position(line, 1)
        };
        if sizes.len() != self.plan.agents() {
            let cause = format!("has {} plans for {} robots", self.plan.agents(), sizes.len());
            return Err(error(sizes.len(), cause));
        }
        let mut agents = Vec::with_capacity(sizes.len());
        for (agent, &size) in sizes.iter().enumerate() {
            let start = self.plan.pose(agent, 0);
            let goal = self.plan.pose(agent, self.plan.steps()).position();
            agents.push(Agent { size, start, goal });
        }
        // Starts or ends that overlap or are in walls are refused here, all between them below.
        let instance = Instance::new(free, ActionModel::Turns, agents);
        let instance = instance
            .map_err(|e| error(place_agent(e.place()), format!("{} {}", e.place(), e.cause())))?;
        let checked = self.plan.validate(&instance);
        checked.map_err(|e| error(first_agent(&e), e.to_string()))
    }
}

/// Returns the agent that the place of an error names, as in `agents[3].start`.
fn place_agent(place: &str) -> usize {
    let number = place.split(['[', ']']).nth(1);
    number.and_then(|number| number.parse().ok()).unwrap_or(0)
}

/// Returns an agent that is part of a fault.
fn first_agent(error: &PlanError) -> usize {
    match *error {
        PlanError::AgentCount { expected, .. } => expected,
        PlanError::Start { agent, .. }
        | PlanError::Wall { agent, .. }
        | PlanError::Motion { agent, .. }
        | PlanError::Goal { agent, .. } => agent,
        PlanError::Overlap { agents, .. } | PlanError::Swap { agents, .. } => agents[1],
    }
}

/// Returns a plan of agents that have headings in the form that [`read`] reads.
pub fn write(plan: &Plan) -> String {
    let mut text = String::from("# column row heading actions\n");
    for agent in 0..plan.agents() {
        let path = plan.path(agent);
        let start = path[0];
        let _ = write!(text, "{} {} {} ", start.col, start.row, start.heading);
        for pair in path.windows(2) {
            let letter = LETTERS.iter().find(|(_, action)| pair[0].after(*action) == Some(pair[1]));
            text.push(letter.map_or('W', |(letter, _)| *letter));
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(text: &str) -> Result<PlanFile, InputError> {
        // A wall in the middle of the second row.
        let free = FreeSpace::new(4, 2, |col, row| row == 0 || col != 1);
        let file = read("a.plan", text)?;
        file.check("a.plan", &free, &[1, 1])?;
        Ok(file)
    }

    #[test]
    fn a_plan_that_was_written_is_read_as_it_was() {
        let text = "# column row heading actions\n0 0 0 FFLF\n3 0 2 WWLL\n";
        let file = checked(text).expect("is right");
        assert_eq!(write(&file.plan), text);
        let loose = "  # a team\n\n0 0 0 FF LF # the first\n3 0 2 WWLL";
        let other = checked(loose).expect("is right");
        assert_eq!((&other.plan, &other.lines[..]), (&file.plan, &[3, 4][..]));
    }

    #[test]
    fn a_plan_that_is_wrong_is_refused_with_its_line() {
        let cases = [
            ("", None, "no plan"),
            ("0 0 0 F\nx 0 0", Some(2), "column of the start is `x`"),
            ("0 0\n3 0 2", Some(1), "heading of the start is ``"),
            ("0 0 4\n3 0 2", Some(1), "heading of the start is 4"),
            ("0 0 0\n3 0 2 FxF", Some(2), "action is `x`"),
            ("0 0 3 F\n3 0 2", Some(1), "leaves the map"),
            ("0 0 0", Some(1), "1 plans for 2 robots"),
            ("0 0 0\n3 0 2\n2 0 0", Some(3), "3 plans for 2 robots"),
            ("0 0 0 LF\n1 0 1 F", Some(2), "wall"),
            ("0 0 0 W\n0 0 0 F", Some(2), "start of agent"),
            ("0 0 0 FF\n3 0 2 FWLLF", Some(2), "both cover box (2, 0)"),
            ("0 0 0 FF\n3 0 2 FW", Some(2), "goal covers box (2, 0)"),
            ("0 0 0 F\n1 0 2 F", Some(2), "swap"),
            ("0 0 0 F\n3 0 0 FW", Some(2), "wall"),
        ];
        for (text, line, cause) in cases {
            let error = checked(text).expect_err(text);
            assert_eq!(error.line_and_column().map(|at| at.0), line, "{text}: {error}");
            assert!(error.to_string().contains(cause), "{text}: {error}");
        }
    }
}
