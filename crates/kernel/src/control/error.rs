//! Reasons why orders and controls are refused, and why observations cannot be written.

use crate::units::EntityId;

/// A reason why an order was refused; the state is unchanged then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// The agent does not exist, or the body is no agent.
    #[error("there is no {agent} that can be ordered; {}", valid_agents_text(noun, *last))]
    NoAgent {
        /// Noun and id of the agent, e.g. `robot 3`.
        agent: String,
        /// The world's noun for an agent, e.g. `robot`.
        noun: &'static str,
        /// The highest id of an agent in a team; `None` where no agent is in one.
        last: Option<EntityId>,
    },
    /// The agent decides for itself.
    #[error("{agent} decides for itself; set `external` in the scenario to control it externally")]
    NotExternal {
        /// Noun and id of the agent, e.g. `robot 3`.
        agent: String,
    },
    /// An order that the agent does not know.
    #[error("{agent} takes no order `{order}`; it takes {}", known.join(", "))]
    Unknown {
        /// Name of the order, as it was given.
        order: String,
        /// Noun and id of the agent, e.g. `robot 3`.
        agent: String,
        /// Names of the orders that its team takes.
        known: Vec<String>,
    },
    /// Too few or too many values for an order.
    #[error("the order `{order}` needs {expected} values, not {found}")]
    Shape {
        /// Name of the order, as it was given.
        order: String,
        /// The number of values in words.
        expected: String,
        /// Number of values given: of all agents, or of the one for which it is wrong.
        found: usize,
    },
    /// A value out of its bounds.
    #[error("the order `{order}` to {agent} is {value}; it must be {expected}")]
    Value {
        /// Name of the order, as it was given.
        order: String,
        /// Noun and id of the agent, e.g. `robot 3`.
        agent: String,
        /// The first of the agent's values that is out of bounds.
        value: f64,
        /// The allowed values in words, by [`Space::describe`](super::ValueSpace::describe).
        expected: String,
    },
    /// Controls were submitted to a run whose agents decide within it.
    #[error("no agent of this run is controlled externally: {cause}")]
    NoExternalAgents {
        /// The reason and the remedy, in the words of the final error.
        cause: String,
    },
    /// The control of an agent is refused.
    #[error("the control of {agent} is refused: {cause}")]
    Control {
        /// The agent in the world's words, e.g. `connector 2 of chain 0`.
        agent: String,
        /// The world's reason and the remedy.
        cause: String,
    },
    /// An order that makes no sense to the world.
    #[error("the order `{order}` to {agent} cannot be obeyed: {cause}")]
    Invalid {
        /// Name of the order, as it was given.
        order: String,
        /// Noun and id of the agent, e.g. `robot 3`.
        agent: String,
        /// The world's reason, and the remedy.
        cause: String,
    },
    /// A missing team.
    #[error("there is no team {team}; the scenario has {teams}, from 0")]
    NoTeam {
        /// The number that was given.
        team: usize,
        /// Number of teams; valid numbers are below it.
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
fn valid_agents_text(noun: &str, last: Option<EntityId>) -> String {
    match last {
        None => format!("this scenario has no {noun} that observes or takes orders"),
        Some(last) => format!("the last {noun} that observes or takes orders is {last}"),
    }
}
