//! Named options for the reactions of a chain.

/// Reaction of a rod that hits an obstacle (slides A7, A8).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RotationRule {
    /// Turns to the nearest direction free of all obstacles at once: the default.
    #[default]
    Union,
    /// Turns once, to the tangent of the obstacle that is hit nearest to the master, as the slides
    /// say, and does not check again. Unsafe: it leads from one obstacle into the next, up to 0.19
    /// m deep where measured.
    Literal,
    /// Does not turn: every hit is a veto.
    Never,
}

/// Rules by which a chain reacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReactionRules {
    /// Reaction of a rod that hits an obstacle.
    pub rotation: RotationRule,
    /// Whether the chain's own parts are obstacles to it: all but those of one joint, see
    /// [`Chain::min_separation_m`](super::Chain::min_separation_m).
    pub self_collision: bool,
    /// Longest move of a slave in one sub-step, meters; infinite for no limit.
    pub slave_step_max_m: f64,
    /// Longest move of any connector in one request that a fixed base answers, meters; infinite for
    /// no limit. Near singular postures the initiator goes only as far as that allows.
    pub joint_step_max_m: f64,
    /// Longest move of any connector of a chain that nothing holds in one request, meters; infinite for no limit. It is for
    /// callers that ask for shorter motions, which propagation itself does not. Rods that
    /// turn aside throw the parts that hang on them farther than the initiator goes, which then goes less far.
    pub free_step_max_m: f64,
    /// Number of times that one sweep may try another direction for an earlier slave.
    pub backtracks: usize,
    /// Longest move of an initiator in one sub-step, meters. By default it is a quarter of the
    /// least rod or radius, and unlimited if nothing is in the way.
    pub step_m: Option<f64>,
}

impl Default for ReactionRules {
    fn default() -> Self {
        Self {
            rotation: RotationRule::Union,
            self_collision: false,
            slave_step_max_m: f64::INFINITY,
            joint_step_max_m: f64::INFINITY,
            free_step_max_m: f64::INFINITY,
            backtracks: 64,
            step_m: None,
        }
    }
}
