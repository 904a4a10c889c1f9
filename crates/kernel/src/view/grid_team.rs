//! Robots on a grid as the formats of multi-agent path finding show them: whole boxes, actions that take several cycles,
//! and tasks.

/// A place on a grid with a heading.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridPlace {
    /// Column, from the west.
    pub col: u32,
    /// Row, from the south.
    pub row: u32,
    /// Heading in quarter turns, counterclockwise from east.
    pub heading: u8,
}

/// A task that an agent has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridTask {
    /// Its number among all that were revealed.
    pub task: u64,
    /// The number of its errands that were done.
    pub visited: u32,
}

/// An agent at the start of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridAgent {
    /// Where it is, or where its action leads it.
    pub place: GridPlace,
    /// Cycles for which its action still goes on.
    pub cycles_left: u32,
    /// Cycles in which it was delayed so far.
    pub delayed_cycles: u64,
    /// Where a planner meant it to be after the action that it chose in the cycle before; none without a planner, or
    /// where it chose none.
    pub planned: Option<GridPlace>,
    /// Its task.
    pub task: Option<GridTask>,
}

/// All agents at the start of a cycle, and their tasks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GridTeam {
    /// Cycles that an action takes.
    pub action_cycles: u32,
    /// The agents, by id.
    pub agents: Vec<GridAgent>,
    /// The errands (column, row) of each task that was revealed, from the number on that was asked for.
    pub new_tasks: Vec<Vec<(u32, u32)>>,
    /// Tasks that nobody has, by rising number.
    pub open_tasks: Vec<u64>,
    /// The number of tasks that were finished.
    pub finished_tasks: u64,
}
