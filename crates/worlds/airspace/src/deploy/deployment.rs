//! The deployments, by their names in scenarios.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sidestep_collectives::{Estimator, OptimizerConfig, UpdateOrder, Utility};

/// A deployment of the optimizer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Deployment {
    /// One process decides for all.
    #[default]
    Direct,
    /// An agent per airplane, which sends its possible ways.
    Team,
    /// A coordinator that migrates.
    Pim,
    /// Coordinators that migrate, one above the others.
    HierarchicalPim,
    /// An agent per airplane, which sends its model.
    CompactTeam,
}

impl Deployment {
    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Team => "team",
            Self::Pim => "pim",
            Self::HierarchicalPim => "hierarchical-pim",
            Self::CompactTeam => "compact-team",
        }
    }
}

/// Returns the reason why a deployment cannot run with some settings, if there is one.
pub(crate) fn unsupported_reason(
    deployment: Deployment,
    settings: &OptimizerConfig,
) -> Option<&'static str> {
    let sampled = matches!(settings.estimator, Estimator::Sampled { .. });
    let as_in_the_paper =
        settings.order == UpdateOrder::Parallel && settings.utility == Utility::Joint;
    (deployment != Deployment::Direct && sampled && !as_in_the_paper)
        .then_some("agents that sample update in parallel and learn from the joint cost")
}
