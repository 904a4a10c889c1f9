//! Reasons why orders and controls are refused, and why observations cannot be written.

use crate::units::EntityId;

/// A reason why an order was refused; the state is unchanged then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// The agent does not exist, or the body is no agent.
    #[error("there is no {agent} that can be ordered; {}", last_agent(noun, *last))]
    NoAgent {
        /// The agent.
        agent: String,
        /// The noun for an agent.
        noun: &'static str,
        /// The last existing agent.
        last: Option<EntityId>,
    },
    /// The agent decides for itself.
    #[error("{agent} decides for itself; set `external` in the scenario to control it externally")]
    NotExternal {
        /// The agent.
        agent: String,
    },
    /// An order that the agent does not know.
    #[error("{agent} takes no order `{order}`; it takes {}", known.join(", "))]
    Unknown {
        /// The order.
        order: String,
        /// The agent.
        agent: String,
        /// The orders that it takes.
        known: Vec<String>,
    },
    /// Too few or too many values for an order.
    #[error("the order `{order}` needs {expected} values, not {found}")]
    Shape {
        /// The order.
        order: String,
        /// The number of values in words.
        expected: String,
        /// The number of values given.
        found: usize,
    },
    /// A value out of its bounds.
    #[error("the order `{order}` to {agent} is {value}; it must be {expected}")]
    Value {
        /// The order.
        order: String,
        /// The agent.
        agent: String,
        /// The value.
        value: f64,
        /// The allowed values.
        expected: String,
    },
    /// Controls were submitted to a run whose agents decide within it.
    #[error("no agent of this run is controlled externally: {cause}")]
    NoExternalAgents {
        /// The reason, and the remedy.
        cause: String,
    },
    /// The control of an agent is refused.
    #[error("the control of {agent} is refused: {cause}")]
    Control {
        /// The agent.
        agent: String,
        /// The reason, and the remedy.
        cause: String,
    },
    /// An order that makes no sense to the world.
    #[error("the order `{order}` to {agent} cannot be obeyed: {cause}")]
    Invalid {
        /// The order.
        order: String,
        /// The agent.
        agent: String,
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
    /// Buffers of another shape than the observations.
    #[error("the buffers for observations have the wrong shape; they must be {expected}")]
    BufferShape {
        /// The buffers that would fit.
        expected: String,
    },
}

/// Returns the range of valid agents in words.
fn last_agent(noun: &str, last: Option<EntityId>) -> String {
    match last {
        None => format!("this scenario has no {noun} that observes or takes orders"),
        Some(last) => format!("the last {noun} that observes or takes orders is {last}"),
    }
}
