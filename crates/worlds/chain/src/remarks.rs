//! Remarks on a valid scenario: effects that will surprise its author. `sidestep check` shows them.

mod no_posture;

use super::scenario::ChainScenario;
use super::scenario::own_overlap_text;
use super::world::{ChainChangeKind, ChainSpec, ChainWorld};
use sidestep_arms::kinematics::JointMotionKind;
use sidestep_arms::motion::{AssumedSpeed, CutRates};
use sidestep_rods::{Mobility, RodBvh};
use sidestep_scenario::Remark;
use std::collections::BTreeSet;

/// Fraction of its highest speed below which a joint counts as led slowly: more than what is kept for rounding.
const SLOW_FRACTION: f64 = 0.99;

/// Returns remarks on files, then on joints, on the network, and on rules without effect.
pub(super) fn remarks<const D: usize>(compiled: &ChainScenario<D>) -> Vec<Remark> {
    let ground = compiled.recipe.iter().flat_map(|recipe| recipe.ground_remarks.iter().cloned());
    let chains = compiled.world.chains.iter().enumerate();
    let files = chains.clone().flat_map(|(k, spec)| arm_file_remarks(k, spec));
    let unlimited = chains.clone().filter_map(|(k, spec)| unlimited_speeds_remark(k, spec));
    let led_slowly = chains.clone().filter_map(|(k, spec)| slow_joints_remark(k, spec));
    // One of them is enough: all chains talk over the same network.
    let slow = chains.clone().find_map(|(k, spec)| slow_network_remark(&compiled.world, k, spec));
    let of_files = ground.chain(files);
    let own_overlap = own_overlap_remark(&compiled.world);
    let overlaps = chains.clone().filter_map(|(k, spec)| exempt_overlaps_remark(k, spec));
    // Otherwise all links may touch.
    let overlaps = overlaps.filter(|_| compiled.world.rules.self_collision);
    let without_posture = chains
        .clone()
        .flat_map(|(k, spec)| no_posture::no_posture_remarks(&compiled.world, k, spec));
    let of_arms = unlimited.chain(led_slowly).chain(overlaps);
    of_files
        .chain(of_arms)
        .chain(without_posture)
        .chain(slow)
        .chain(own_overlap)
        .chain(unused_rules(compiled))
        .collect()
}

/// Returns a warning on chains whose own parts overlap at the start, where that is allowed.
fn own_overlap_remark<const D: usize>(world: &ChainWorld<D>) -> Option<Remark> {
    if !world.rules.self_collision {
        return None;
    }
    let mut tree = RodBvh::default();
    let mut overlaps = world
        .chains
        .iter()
        .enumerate()
        // An arm with shapes is told of the links that overlap.
        .filter(|(_, spec)| spec.arm.as_ref().is_none_or(|arm| arm.body.is_none()))
        .filter_map(|(k, spec)| Some((k, own_overlap_text(&spec.start, &mut tree)?)));
    let (k, words) = overlaps.next()?;
    let more = match overlaps.count() {
        0 => String::new(),
        n => format!(", and {n} more chains likewise"),
    };
    let words = format!(
        "chain {k} {words}{more}; parts that overlap at the start may come apart, and go no deeper into each other"
    );
    Some(Remark::warning(format!("chains.{k}"), words))
}

/// Returns what was not taken as it stood in the files of an arm.
fn arm_file_remarks<const D: usize>(k: usize, spec: &ChainSpec<D>) -> Vec<Remark> {
    let Some(arm) = &spec.arm else { return Vec::new() };
    arm.findings.iter().map(|finding| finding.remark(&format!("chains.{k}.arm"))).collect()
}

/// Returns notes on rules that are given and have no effect.
fn unused_rules<const D: usize>(compiled: &ChainScenario<D>) -> impl Iterator<Item = Remark> {
    let world = &compiled.world;
    let moves = !world.movers.is_empty();
    let holds = world.chains.iter().any(is_ever_held);
    let given = compiled.recipe.iter().flat_map(|recipe| recipe.given_rules());
    let escapes = world.escape.is_some();
    // Chains that nothing holds keep to the speed of escapes where parts escape, and to none where their own body is not
    // solid.
    let is_free_limited = world.rules.self_collision && !escapes;
    let idle = given
        .filter(move |(_, of_movers)| if *of_movers { !moves } else { !holds && !is_free_limited });
    idle.map(move |(key, of_movers)| {
        let why = if of_movers {
            "no obstacle moves: give one velocity_m_s or patrol_m"
        } else if escapes {
            "no connector is held and parts escape: give a connector a mobility, or escape_speed_m_s for this"
        } else {
            "no connector is held and self_collision is off: give a connector a mobility, or set self_collision = true"
        };
        Remark::note(
            format!("chain.{key}"),
            format!("it does nothing where {why}, or leave it out"),
        )
    })
}

/// Returns whether some connector of a chain is, or comes to be, unable to go anywhere.
fn is_ever_held<const D: usize>(spec: &ChainSpec<D>) -> bool {
    let mut connectors = spec.start.connectors().iter();
    let mut changes = spec.changes.iter();
    connectors.any(|c| c.mobility != Mobility::Free || c.failed)
        || changes.any(|change| {
            matches!(change.what, ChainChangeKind::Mobility { .. } | ChainChangeKind::Failed { .. })
        })
}

/// Returns a warning on a chain whose agents talk too slowly to move all of it in a cycle.
fn slow_network_remark<const D: usize>(
    world: &ChainWorld<D>,
    k: usize,
    spec: &ChainSpec<D>,
) -> Option<Remark> {
    let network = world.network.as_ref()?;
    let rods = spec.start.rods().len();
    let led_m = spec.tasks.iter().map(|task| task.speed_m_s * world.dt_s).fold(0.0, f64::max);
    let is_empty = world.obstacles.is_empty() && world.movers.is_empty() && world.chains.len() == 1;
    let step_m = match world.rules.step_m {
        Some(step_m) => step_m,
        None if is_empty => f64::INFINITY,
        None => spec.start.step_m(),
    };
    let steps = (led_m / step_m).ceil().max(1.0);
    let talk_s = steps * 2.0 * rods as f64 * network.latency_s;
    if talk_s <= network.deadline_s {
        return None;
    }
    let words = format!(
        "a motion that moves all of chain {k} takes at least {talk_s} s of talk ({steps} sub-steps, each there \
         and back along {rods} rods), and a talk ends after {} s: such a motion is not carried out; \
         give messages less time, or cycles more",
        network.deadline_s
    );
    Some(Remark::warning("chain.network.latency_s", words))
}

/// Returns a note on joints for whose speed nothing gives a limit.
fn unlimited_speeds_remark<const D: usize>(k: usize, spec: &ChainSpec<D>) -> Option<Remark> {
    let arm = spec.arm.as_deref()?;
    let mut taken = Vec::new();
    for AssumedSpeed { joint, speed, motion } in &arm.rate_sources.assumed_speeds {
        let unit = if *motion == JointMotionKind::Turn { "rad/s" } else { "m/s" };
        taken.push(format!("`{joint}` {speed:.4} {unit}"));
    }
    if taken.is_empty() {
        return None;
    }
    let words = format!(
        "the model gives no velocity for some joints, which are taken to reach: {}; write \
         <limit velocity=\"...\"/> for others",
        taken.join(", ")
    );
    Some(Remark::note(format!("chains.{k}.arm"), words))
}

/// Returns a note on links that overlap at the start, and may therefore touch.
fn exempt_overlaps_remark<const D: usize>(k: usize, spec: &ChainSpec<D>) -> Option<Remark> {
    let arm = spec.arm.as_deref().filter(|arm| !arm.exempt_overlaps.is_empty())?;
    let pairs = arm.exempt_overlaps.iter();
    let pairs = pairs.map(|(a, b, depth_m)| format!("`{a}` and `{b}` by {depth_m:.4} m"));
    let words = format!(
        "links that overlap at the start may touch during the run: {}; start elsewhere, or name those that may touch \
         in an SRDF file",
        pairs.collect::<Vec<_>>().join(", ")
    );
    Some(Remark::note(format!("chains.{k}.arm"), words))
}

/// Returns a note on joints that are led more slowly than they may move, because they would take long to stop.
fn slow_joints_remark<const D: usize>(k: usize, spec: &ChainSpec<D>) -> Option<Remark> {
    let arm = spec.arm.as_deref()?;
    let motion = &arm.motion;
    let mut slow = Vec::new();
    let mut limiting_keys = BTreeSet::new();
    for (i, speed) in motion.reference_speeds().enumerate() {
        let joint = &arm.serial.variables[i];
        let rates = motion.rates()[i];
        if speed < SLOW_FRACTION * rates.speed {
            let unit = if joint.motion == JointMotionKind::Turn { "rad/s" } else { "m/s" };
            let limit = rates.speed;
            slow.push(format!("`{}` at up to {speed:.4} {unit} of {limit:.4}", joint.name));
            let cut = arm.rate_sources.cut.get(i).copied().unwrap_or_default();
            limiting_keys.insert(limiting_key(cut));
        }
    }
    if slow.is_empty() {
        return None;
    }
    let words = format!(
        "some joints need longer than 0.5 s to reach their highest speed, or 0.25 s to reverse their highest \
         acceleration, and are led more slowly: {}; a higher {} makes them faster",
        slow.join(", "),
        limiting_keys.into_iter().collect::<Vec<_>>().join(", or ")
    );
    Some(Remark::note(format!("chains.{k}.arm"), words))
}

/// Returns what keeps a joint from its highest speed: the key for all joints where that is lower than its own limit.
fn limiting_key(cut: CutRates) -> &'static str {
    if cut.acceleration {
        return "arm.max_acceleration";
    }
    if cut.jerk {
        return "arm.max_jerk";
    }
    "max_acceleration or max_jerk in arm.joint_limits"
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_scenario::{Severity, Source};

    /// Hinges that all turn about one direction, by their number.
    fn planar(hinges: usize) -> String {
        let link = |k: usize| format!("<link name=\"l{k}\"/>");
        let joint = |k: usize| {
            format!(
                "<joint name=\"j{k}\" type=\"continuous\"><parent link=\"l{k}\"/><child link=\"l{}\"/>\
                 <origin xyz=\"0 0 0.3\"/><axis xyz=\"0 1 0\"/></joint>",
                k + 1
            )
        };
        let links: String = (0..=hinges).map(link).collect();
        let joints: String = (0..hinges).map(joint).collect();
        format!("<robot name=\"planar\">{links}{joints}</robot>")
    }

    #[test]
    fn a_limit_of_joints_that_has_no_effect_on_a_free_chain_is_told_with_what_has() {
        let told = |chain: &str| {
            let text = format!(
                "format = 1\nworld = \"chain\"\n[chain]\njoint_speed_m_s = 0.2\n{chain}\n[[obstacles]]\nat_m = [9.0, 9.0]\n\
                 radius_m = 0.5\nvelocity_m_s = [0.1, 0.0]\n[[chains]]\nconnectors = 5\nrod_m = 0.5\n\
                 [[chains.tasks]]\nkind = \"script\"\nscript = \"forward 1\"\n"
            );
            let scenario =
                ChainScenario::<2>::new(&Source::new("s.toml", text, "")).expect("valid");
            let all = remarks(&scenario).into_iter().map(|remark| format!("{remark:?}"));
            all.filter(|remark| remark.contains("joint_speed_m_s")).collect::<String>()
        };
        assert!(told("").contains("escape_speed_m_s"), "{}", told(""));
        assert_eq!(told("escape = \"off\""), "", "it holds there");
        let loose = told("escape = \"off\"\nself_collision = false");
        assert!(loose.contains("self_collision = true"), "{loose}");
    }

    #[test]
    fn a_team_that_talks_too_slowly_to_move_all_is_told() {
        let remarks_of = |network: &str| {
            let text = format!(
                "format = 1\nworld = \"chain\"\n[chain]\nself_collision = false\nbacktracks = 0\n\
                 deployment = \"team\"\nnetwork = {{ {network} }}\n[[chains]]\nconnectors = 20\n\
                 rod_m = 0.5\n[[chains.tasks]]\nkind = \"script\"\nscript = \"forward 1\"\n"
            );
            remarks(&ChainScenario::<2>::new(&Source::new("s.toml", text, "")).expect("valid"))
        };
        assert_eq!(remarks_of("loss = 0.1").len(), 0);
        let [told] = &remarks_of("latency_s = 5e-4, patience_s = 2e-3")[..] else {
            panic!("one remark")
        };
        assert_eq!(told.key, "chain.network.latency_s");
        assert!(told.words.contains("0.019 s of talk (1 sub-steps"), "{}", told.words);
    }

    #[test]
    fn rules_of_what_is_not_there_are_told_to_do_nothing() {
        let chain = "[[chains]]\nconnectors = 3\nrod_m = 0.5\ntasks = [{ kind = \"rest\" }]\n";
        let keys_of = |rules: &str, more: &str| {
            let text = format!("format = 1\nworld = \"chain\"\n[chain]\n{rules}\n{chain}{more}");
            let compiled =
                ChainScenario::<2>::new(&Source::new("s.toml", text, "")).expect("valid");
            remarks(&compiled).into_iter().map(|told| told.key).collect::<Vec<_>>()
        };
        let rules = "joint_speed_m_s = 1.0\nescape_by = \"literal\"\nescape_speed_m_s = 1.0\nescape_ahead_s = 0.5";
        let [joints, by, speed, ahead] =
            ["joint_speed_m_s", "escape_by", "escape_speed_m_s", "escape_ahead_s"]
                .map(|key| format!("chain.{key}"));
        assert_eq!(keys_of(rules, ""), [&by, &speed, &ahead].map(String::clone));
        let ball = "[[obstacles]]\nat_m = [9.0, 9.0]\nradius_m = 0.1\nvelocity_m_s = [0.1, 0.0]\n";
        assert_eq!(keys_of(rules, ball), [joints]);
        let held = "[[chains.limits]]\nconnector = 2\nmobility = \"fixed\"\n";
        assert_eq!(keys_of(rules, held), [by, speed, ahead]);
        assert!(keys_of("", "").is_empty());
    }

    #[test]
    fn what_was_not_taken_as_it_stood_in_a_file_is_told_at_its_key() {
        let folder = tempfile::tempdir().expect("a folder");
        let yaml = "image: floor.pgm\nresolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.25\n";
        let arm = planar(3).replace("<link name=\"l0\"/>", "<link name=\"l0\"/><gazebo/>");
        for (name, text) in [
            ("floor.pgm", "P2 2 1 255 255 205"),
            ("floor.yaml", yaml),
            ("a.world", "speedup 3\nmodel ( obstacle_return 0 pose [9 9 0 0] )"),
            ("arm.urdf", &arm),
        ] {
            std::fs::write(folder.path().join(name), text).expect("written");
        }
        let source = |text: &str| {
            Source::new("s.toml", format!("format = 1\nworld = \"chain\"\n{text}"), folder.path())
        };
        let told = |ground: &str| {
            let text = format!(
                "[[chains]]\nconnectors = 3\nrod_m = 0.1\nradius_m = 0.01\nat_m = [1.0, 0.5]\n\
                 tasks = [{{ kind = \"rest\" }}]\n[ground]\n{ground}\n"
            );
            remarks(&ChainScenario::<2>::new(&source(&text)).expect("valid"))
        };
        let floor = told("map = \"floor.yaml\"");
        assert!(floor.iter().all(|told| told.key == "ground.map"), "{floor:?}");
        assert!(floor[0].words.starts_with("suspicious: pixels of the gray 205"), "{floor:?}");
        let world = told("stage = \"a.world\"");
        assert!(world.iter().all(|told| told.key == "ground.stage"), "{world:?}");
        assert_eq!((world.len(), world[1].severity), (2, Severity::Warning));
        let text = "[chain]\ndimensions = 3\n[[chains]]\narm = { urdf = \"arm.urdf\" }\nradius_m = 0.02\n\
                    tasks = [{ kind = \"rest\" }]\n";
        let arm = remarks(&ChainScenario::<3>::new(&source(text)).expect("valid"));
        assert_eq!(arm[0].key, "chains.0.arm");
        assert!(arm[0].words.starts_with("not used: elements <gazebo>"), "{arm:?}");
    }

    #[test]
    fn joints_without_a_velocity_are_told_with_the_speed_that_they_are_taken_to_reach() {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("arm.urdf"), planar(4)).expect("written");
        let text = "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
                    arm = { urdf = \"arm.urdf\" }\nradius_m = 0.02\n\
                    [[chains.tasks]]\nkind = \"targets\"\nconnector = 3\ntargets_m = [[0.3, 0.0, 0.8]]\nspeed_m_s = 0.2\n";
        let source = Source::new("s.toml", text, folder.path());
        let compiled = ChainScenario::<3>::new(&source).expect("valid");
        let [told] = &remarks(&compiled)[..] else { panic!("one remark") };
        assert_eq!(told.key, "chains.0.arm");
        assert!(told.words.contains("`j0` 3.1416 rad/s"), "{}", told.words);
    }

    #[test]
    fn arms_are_told_of_the_limits_that_their_scenario_gives() {
        let told = |keys: &str| {
            let text = format!(
                "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
                 arm = {{ urdf_text = '{}', {keys} }}\nradius_m = 0.02\n[[chains.tasks]]\nkind = \"rest\"\n",
                planar(3)
            );
            let compiled =
                ChainScenario::<3>::new(&Source::new("s.toml", text, "")).expect("valid");
            remarks(&compiled).into_iter().map(|told| told.words).collect::<Vec<_>>()
        };
        assert!(told("max_velocity = 1.0").is_empty());
        let [slow] = &told("max_velocity = 1.0, max_acceleration = 0.5")[..] else {
            panic!("one remark")
        };
        assert!(slow.ends_with("a higher arm.max_acceleration makes them faster"), "{slow}");
        let [slow] = &told("max_velocity = 1.0, max_jerk = 1.0")[..] else { panic!("one remark") };
        assert!(slow.ends_with("a higher arm.max_jerk makes them faster"), "{slow}");
    }
}
