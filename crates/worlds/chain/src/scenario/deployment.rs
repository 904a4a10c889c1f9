//! Scenarios in which agents that know only their neighbors and their own perception can move the chains.

use super::{ChainScenarioCompiler, ChainSpec};
use crate::deploy::deployment::Deployment;
use crate::driver::TaskKind;
use crate::world::ChainChangeKind;
use sidestep_kernel::InputError;
use sidestep_rods::{Mobility, ReactionRules};

/// A key whose value needs a view of the whole chain.
struct NonLocalKey {
    key: String,
    /// The reason why it does.
    reason: String,
    remedy: &'static str,
}

impl NonLocalKey {
    fn new(key: impl Into<String>, reason: impl Into<String>, remedy: &'static str) -> Self {
        Self { key: key.into(), reason: reason.into(), remedy }
    }
}

impl<const D: usize> ChainScenarioCompiler<'_, D> {
    /// Refuses a scenario that is deployed as a team and in which a connector would have to know more than it
    /// does.
    pub(super) fn check_local_knowledge(
        &self,
        chains: &[ChainSpec<D>],
        rules: &ReactionRules,
        escapes: bool,
    ) -> Result<(), InputError> {
        if self.file.chain.deployment == Deployment::Direct {
            return Ok(());
        }
        let counts = self.file.chains.0.iter().map(|section| section.get_ref().count);
        let sections = counts.enumerate().flat_map(|(s, count)| std::iter::repeat_n(s, count));
        let mut parts = sections.zip(chains).filter_map(|(s, spec)| non_local_key(s, spec));
        let Some(found) = non_local_rule(rules, escapes).or_else(|| parts.next()) else {
            return Ok(());
        };
        let cause = format!("{}, which no connector of a team sees", found.reason);
        let remedy = format!("{}, or set chain.deployment = \"direct\"", found.remedy);
        Err(self.source.error_at(&found.key, cause, remedy))
    }
}

/// Returns the first rule by which chains cannot be moved by their neighbors alone.
fn non_local_rule(rules: &ReactionRules, escapes: bool) -> Option<NonLocalKey> {
    if rules.self_collision {
        let reason =
            "self_collision = true: to avoid its own parts, a chain has to know all of them";
        let remedy = "set chain.self_collision = false";
        return Some(NonLocalKey::new("chain.self_collision", reason, remedy));
    }
    if rules.backtracks > 0 {
        let reason = format!(
            "backtracks = {}: to step back takes the places that all before it could have taken",
            rules.backtracks
        );
        return Some(NonLocalKey::new("chain.backtracks", reason, "set chain.backtracks = 0"));
    }
    if escapes {
        let reason = "escape: which parts escape first, or all at once, depends on all of them";
        return Some(NonLocalKey::new("chain.escape", reason, "set chain.escape = \"off\""));
    }
    if rules.slave_step_max_m == f64::INFINITY {
        let reason = "slave_step_max_m = inf: a follower may be thrown to any place";
        return Some(NonLocalKey::new("chain.slave_step_max_m", reason, "give a length"));
    }
    None
}

/// Returns the first thing about a chain of section `s` for which its neighbors are not enough.
fn non_local_key<const D: usize>(s: usize, spec: &ChainSpec<D>) -> Option<NonLocalKey> {
    let passes = "is reached by passes to and fro over the whole chain";
    if spec.arm.is_some() {
        let reason = format!("an arm: the target of its tool {passes}");
        let remedy = "give a chain without a base";
        return Some(NonLocalKey::new(format!("chains.{s}.arm"), reason, remedy));
    }
    let mut connectors = spec.start.connectors().iter();
    if let Some(k) = connectors.position(|c| c.failed || c.mobility != Mobility::Free) {
        let reason = format!("connector {k} is held: a target {passes}");
        let remedy = "make all connectors free";
        return Some(NonLocalKey::new(format!("chains.{s}.limits"), reason, remedy));
    }
    for (i, task) in spec.tasks.iter().enumerate() {
        if task.plans_after_s.is_some() {
            let key = format!("chains.{s}.tasks.{i}.planner");
            let reason = "a planner: its paths are postures of the whole chain";
            return Some(NonLocalKey::new(key, reason, "set planner = \"none\""));
        }
        if matches!(task.driver, TaskKind::External) {
            let key = format!("chains.{s}.tasks.{i}.kind");
            let reason =
                "kind = \"external\": as far as it goes is found by halves, of rods as well";
            return Some(NonLocalKey::new(key, reason, "give another kind"));
        }
    }
    spec.changes.iter().find_map(|change| {
        let reason = match &change.what {
            ChainChangeKind::MaxBend { .. } => return None,
            ChainChangeKind::Failed { connector, .. }
            | ChainChangeKind::Mobility { connector, .. } => {
                format!("connector {connector} is held at some time: a target {passes}")
            }
            ChainChangeKind::Scatter { .. } | ChainChangeKind::Reform { .. } => {
                "a chain that breaks: its parts find together by passes from end to end".into()
            }
        };
        Some(NonLocalKey::new(format!("chains.{s}.changes"), reason, "leave that change out"))
    })
}
