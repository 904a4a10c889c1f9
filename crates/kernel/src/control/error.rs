//! Orders that cannot be obeyed, and observations for which there is no room.

use crate::units::EntityId;

/// A reason why an order was refused; nothing of it was noted then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// The agent does not exist, or the body is no agent.
    #[error("there is no {who} that can be ordered; {}", known(noun, *last))]
    NoAgent {
        /// The agent.
        who: String,
        /// The noun for an agent.
        noun: &'static str,
        /// The last existing agent.
        last: Option<EntityId>,
    },
    /// The agent decides for itself.
    #[error("{who} decides for itself; make it `external` in the scenario")]
    NotExternal {
        /// The agent.
        who: String,
    },
    /// An order that the agent does not know.
    #[error("{who} takes no order `{order}`; it takes {}", known.join(", "))]
    Unknown {
        /// The order.
        order: String,
        /// The agent.
        who: String,
        /// The orders that it takes.
        known: Vec<String>,
    },
    /// Too few or too many values.
    #[error("the order `{order}` needs {expected} values, not {found}")]
    Shape {
        /// The order.
        order: String,
        /// The number of values in words.
        expected: String,
        /// The number of values that came.
        found: usize,
    },
    /// A value out of its bounds.
    #[error("the order `{order}` to {who} is {value}; it must be {expected}")]
    Value {
        /// The order.
        order: String,
        /// The agent.
        who: String,
        /// The value.
        value: f64,
        /// The allowed values.
        expected: String,
    },
    /// Controls were handed over to a run with agents that decide within it.
    #[error("this run has no external agents: {cause}")]
    NoExternalAgents {
        /// The reason, and the remedy.
        cause: String,
    },
    /// The control of an agent is refused.
    #[error("the control of {who} is refused: {cause}")]
    Control {
        /// The agent.
        who: String,
        /// The reason, and the remedy.
        cause: String,
    },
    /// An order that makes no sense to the world.
    #[error("the order `{order}` to {who} cannot be obeyed: {cause}")]
    Invalid {
        /// The order.
        order: String,
        /// The agent.
        who: String,
        /// The world's reason, and the remedy.
        cause: String,
    },
    /// A missing team.
    #[error("there is no team {team}; the scenario has {teams}, from 0")]
    NoTeam {
        /// Its number.
        team: usize,
        /// Number of teams.
        teams: usize,
    },
    /// Room of another shape than the observations.
    #[error("the room for observations does not fit; it must be {expected}")]
    BufferShape {
        /// The rooms that would fit.
        expected: String,
    },
}

fn known(noun: &str, last: Option<EntityId>) -> String {
    match last {
        None => format!("this scenario has no {noun} that observes or takes orders"),
        Some(last) => format!("the last {noun} that observes or takes orders is {last}"),
    }
}
