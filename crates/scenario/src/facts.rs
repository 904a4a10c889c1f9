//! What a world declares of itself, so that programs control, plot and learn from its runs without knowing it.

use serde::Serialize;

/// Facts about a world beside its name. A world without some of them leaves them out.
#[derive(Debug, Clone, Copy, Default, Serialize)]
pub struct WorldFacts {
    /// The order in the actions of a learning agent that chooses no others: one in which every value within its bounds
    /// makes sense. Without it, the first order of a team.
    pub default_order: Option<&'static str>,
    /// The terms of rewards, from the observations of agents.
    pub reward_terms: &'static [RewardTerm],
    /// Where recordings have the positions of agents, for plots of their paths.
    pub positions: Option<RecordedPositions>,
    /// Where results have the sizes of conflict groups.
    pub group_sizes: Option<GroupSizes>,
}

/// A named term of a reward: a number for each agent and step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RewardTerm {
    /// Its name. Worlds that measure alike things use the same name.
    pub name: &'static str,
    /// The quantity that it measures.
    pub meaning: &'static str,
    /// How it follows from the observations before and after a step.
    pub measure: RewardMeasure,
    /// Its weight in the reward of a caller who gives none; 0 if that has no such term.
    pub default_weight: f64,
}

/// The computation of a term from the observations of an agent before and after a step, each by its name.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RewardMeasure {
    /// The observation after the step.
    Value {
        /// Name of the observation: that of its space.
        observation: &'static str,
    },
    /// 1 where the observation after the step is above 0.
    Positive {
        /// Name of the observation: that of its space.
        observation: &'static str,
    },
    /// 1 where the observation has changed.
    Changed {
        /// Name of the observation: that of its space.
        observation: &'static str,
    },
    /// The sum of the absolute changes of all components.
    Distance {
        /// The observation, e.g. a column and a row.
        observation: &'static str,
    },
    /// The increase of an observation.
    Increase {
        /// Name of the observation: that of its space.
        observation: &'static str,
        /// The observation that is 0 where the others are only padding, of agents that do not act yet, or no more.
        active: &'static str,
    },
    /// The decrease of the distance to a target.
    Approach {
        /// The relative position of the target, in meters.
        target: &'static str,
        /// The number of targets left. After reaching one, an agent observes the next one, at an unrelated distance:
        /// then the term is the distance to the reached one.
        targets_left: &'static str,
        /// The observation that is 0 for agents that do not act, as in [`RewardMeasure::Increase`].
        active: &'static str,
        /// The distance beyond which a target stands for none, in meters.
        none_beyond_m: f64,
    },
    /// The number of others that are nearer than their separations.
    Near {
        /// The relative positions of others, in meters.
        positions: &'static str,
        /// Their ids, below 0 where there are no more others.
        ids: &'static str,
        /// Their separations, in meters.
        separations: &'static str,
    },
}

/// The columns of the table `trajectories` with the positions of agents.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct RecordedPositions {
    /// The column with the number of the agent.
    pub agent: &'static str,
    /// The column with the number of its part, if agents have parts.
    pub part: Option<&'static str>,
    /// The columns with the coordinates x and y.
    pub axes: [&'static str; 2],
    /// The unit of the coordinates.
    pub unit: PositionUnit,
    /// The kinds of bodies that are agents, where the table has other bodies, too. Its facts have the ids of each kind:
    /// `ids_robot` = `0-7`.
    pub kinds: &'static [&'static str],
}

/// The unit of the coordinates, which decides how a plot scales them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PositionUnit {
    /// Meters in the frame of the world.
    Meters,
    /// Boxes of a floor, whose facts (`box_m`, `origin_x_m`, `origin_y_m`, `yaw_rad`) the table has.
    Boxes,
}

/// Where the sizes of conflict groups are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum GroupSizes {
    /// A metric: the number of groups of 1, 2 to 3, 4 to 7, ... bodies.
    Metric {
        /// Name of the metric, a list in the results of a run.
        metric: &'static str,
    },
    /// A recorded table with a row for each group.
    Column {
        /// Name of the table in a recording.
        table: &'static str,
        /// The column with the number of bodies of each group.
        column: &'static str,
    },
}
