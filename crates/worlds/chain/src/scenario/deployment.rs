//! Scenarios in which agents that know only their neighbors and their own perception can move the chains.

use super::{ChainSpec, Compiler};
use crate::deploy::deployment::Deployment;
use crate::driver::TaskKind;
use crate::world::ChangeKind;
use sidestep_kernel::InputError;
use sidestep_rods::{Mobility, Rules};

/// A key, the reason why its value needs a view of the whole chain, and the remedy.
type NonLocalKey = (String, String, &'static str);

impl<const D: usize> Compiler<'_, D> {
    /// Refuses a scenario that is deployed as a team and in which a connector would have to know more than it
    /// does.
    pub(super) fn check_local(
        &self,
        chains: &[ChainSpec<D>],
        rules: &Rules,
        escapes: bool,
    ) -> Result<(), InputError> {
        if self.file.chain.deployment == Deployment::Direct {
            return Ok(());
        }
        let counts = self.file.chains.0.iter().map(|section| section.get_ref().count);
        let sections = counts.enumerate().flat_map(|(s, count)| std::iter::repeat_n(s, count));
        let mut parts = sections.zip(chains).filter_map(|(s, spec)| non_local_key(s, spec));
        match non_local_rule(rules, escapes).or_else(|| parts.next()) {
            None => Ok(()),
            Some((key, reason, remedy)) => {
                let cause = format!("{reason}, which no connector of a team sees");
                let remedy = format!("{remedy}, or set chain.deployment = \"direct\"");
                Err(self.source.error_at(&key, cause, remedy))
            }
        }
    }
}

/// Returns the first rule by which chains cannot be moved by their neighbors alone.
fn non_local_rule(rules: &Rules, escapes: bool) -> Option<NonLocalKey> {
    let at = |key: &str, reason: &str, remedy| Some((key.into(), reason.into(), remedy));
    if rules.self_collision {
        let reason =
            "self_collision = true: to avoid its own parts, a chain has to know all of them";
        return at("chain.self_collision", reason, "set chain.self_collision = false");
    }
    if rules.backtracks > 0 {
        let reason = format!(
            "backtracks = {}: to step back takes the places that all before it could have taken",
            rules.backtracks
        );
        return at("chain.backtracks", &reason, "set chain.backtracks = 0");
    }
    if escapes {
        let reason = "escape: which parts escape first, or all at once, depends on all of them";
        return at("chain.escape", reason, "set chain.escape = \"off\"");
    }
    if rules.slave_step_max_m == f64::INFINITY {
        let reason = "slave_step_max_m = inf: a follower may be thrown to any place";
        return at("chain.slave_step_max_m", reason, "give a length");
    }
    None
}

/// Returns the first thing about a chain of section `s` for which its neighbors are not enough.
fn non_local_key<const D: usize>(s: usize, spec: &ChainSpec<D>) -> Option<NonLocalKey> {
    let passes = "is reached by passes to and fro over the whole chain";
    if spec.arm.is_some() {
        let reason = format!("an arm: the target of its tool {passes}");
        return Some((format!("chains.{s}.arm"), reason, "give a chain without a base"));
    }
    let held =
        spec.start.connectors().iter().position(|c| c.failed || c.mobility != Mobility::Free);
    if let Some(k) = held {
        let reason = format!("connector {k} is held: a target {passes}");
        return Some((format!("chains.{s}.limits"), reason, "make all connectors free"));
    }
    for (i, task) in spec.tasks.iter().enumerate() {
        let key = |key: &str| format!("chains.{s}.tasks.{i}.{key}");
        if task.plans_after_s.is_some() {
            let reason = "a planner: its paths are postures of the whole chain".into();
            return Some((key("planner"), reason, "set planner = \"none\""));
        }
        if matches!(task.driver, TaskKind::External) {
            let reason =
                "kind = \"external\": as far as it goes is found by halves, of rods as well".into();
            return Some((key("kind"), reason, "give another kind"));
        }
    }
    spec.changes.iter().find_map(|change| {
        let reason = match &change.what {
            ChangeKind::MaxBend { .. } => return None,
            ChangeKind::Failed { connector, .. } | ChangeKind::Mobility { connector, .. } => {
                format!("connector {connector} is held at some time: a target {passes}")
            }
            ChangeKind::Scatter { .. } | ChangeKind::Reform { .. } => {
                "a chain that breaks: its parts find together by passes from end to end".into()
            }
        };
        Some((format!("chains.{s}.changes"), reason, "leave that change out"))
    })
}
