//! Arms in runs: whatever they do, no joint leaves its limits or is faster than it may be, and the connectors are where
//! the joints put them.

mod blend;
mod neighbors;

use crate::driver::TaskKind;
use crate::scenario::ChainScenario;
use crate::world_impl::ChainRun;
use sidestep_arms::kinematics::{ArmBody, SerialChain};
use sidestep_import::urdf::Model;
use sidestep_kernel::geometry::{distance, norm, normalized, perpendicular_component, sub};
use sidestep_kernel::stream::{Draws, Purpose, Streams};
use sidestep_kernel::{Seed, Simulation};
use sidestep_rods::{Obstacle, Obstacles};
use sidestep_scenario::Source;
use sidestep_testing::{ROBOT_MODELS, robot_model, root};
use std::path::Path;

/// The arm that is shipped, of seven joints; connector 3 is its tool.
fn shipped() -> String {
    let file = root().join("scenarios/chain/arm.urdf");
    format!("{:?}, joints = [0.0, 0.5, 0.0, 1.0, 0.0, 0.5, 0.0]", file.display().to_string())
}

/// Returns a run of one arm with a task.
fn arm(urdf: &str, rest: &str, task: &str) -> ChainRun<3> {
    let text = format!(
        "format = 1\nworld = \"chain\"\ncycles = 20000\n{rest}\n[[chains]]\narm = {{ urdf = {urdf} }}\n\
         radius_m = 0.02\nrod_radius_m = 0.01\n[[chains.tasks]]\n{task}"
    );
    let source = Source::new("s.toml", &text, root());
    ChainScenario::<3>::new(&source).expect("valid").start(&source, 1)
}

fn joints(run: &ChainRun<3>) -> Vec<f64> {
    run.state().body(0).joints.clone().expect("an arm")
}

/// Advances a run to its end; `case` names it where a joint breaks a law.
fn assert_joints_keep_their_laws(run: &mut ChainRun<3>, most: u64, case: &str) {
    let arm = run.world().chains[0].arm.clone().expect("an arm");
    let dt_s = run.world().dt_s;
    let mut before = joints(run);
    // Speed and acceleration of each joint in the cycle before: it starts at rest.
    let mut rates = vec![[0.0; 2]; before.len()];
    while run.cycle() < most && !run.is_over() {
        run.advance(1);
        let now = joints(run);
        assert!(arm.serial.outside_limits(&now).is_empty(), "{case}: {now:?}");
        for (i, limits) in arm.motion.rates().iter().enumerate() {
            let speed = (now[i] - before[i]) / dt_s;
            let acceleration = (speed - rates[i][0]) / dt_s;
            let jerk = (acceleration - rates[i][1]) / dt_s;
            rates[i] = [speed, acceleration];
            let cycle = run.cycle();
            assert!(speed.abs() <= limits.speed, "{case}: {speed} in cycle {cycle}");
            assert!(
                acceleration.abs() <= limits.acceleration,
                "{case}: {acceleration} in cycle {cycle}"
            );
            assert!(jerk.abs() <= limits.jerk, "{case}: {jerk} in cycle {cycle}");
        }
        let places = arm.connector_positions::<3>(&now);
        assert_eq!(places, run.state().body(0).chain.points(), "{case}");
        before = now;
    }
}

fn assert_all_is_reached(run: &ChainRun<3>, case: &str) {
    let metrics = run.world().chain_metrics(run.state(), 0);
    assert!(metrics.tally.given_up.is_empty(), "{case}: {:?}", metrics.tally.given_up);
    assert_eq!(metrics.progress, 1.0, "{case}");
}

#[test]
fn the_shipped_arm_visits_its_places_inside_the_limits_and_speeds_of_its_joints() {
    let path = root().join("scenarios/chain/arm.toml");
    let source = Source::read(&path, &[]).expect("a scenario");
    let mut run = ChainScenario::<3>::new(&source).expect("valid").start(&source, 1);
    assert_joints_keep_their_laws(&mut run, 3000, "arm.toml");
    assert_all_is_reached(&run, "arm.toml");
    let metrics = run.world().chain_metrics(run.state(), 0);
    assert_eq!(metrics.tally.penetrations, 0);
    assert_eq!(metrics.joints.expect("told").len(), 7);
    assert_eq!(metrics.joint_limits.expect("told").len(), 7);
    // The last target is where the arm rests, as drivers of arms want their trajectories to end.
    assert!(run.state().body(0).motion.is_at_rest());
}

/// Returns places of the tool at joint values at random.
fn reachable(path: &Path, draws: &mut Draws) -> (usize, Vec<[f64; 3]>) {
    let model = Model::load(path).expect("a model");
    let arm = SerialChain::new(&model, model.root, model.default_tip(), "tip").expect("an arm");
    let mut target = || {
        let mut value = |limits: Option<[f64; 2]>| {
            let [lower, upper] = limits.unwrap_or([-3.0, 3.0]);
            lower + draws.uniform() * (upper - lower)
        };
        let limits = arm.variables.iter().map(|v| v.limits.map(|l| [l.lower, l.upper]));
        let values: Vec<f64> = limits.map(&mut value).collect();
        arm.forward_kinematics(&values).tip.origin_m
    };
    let targets = (0..4).map(|_| target()).collect();
    (arm.skeleton().rods.len(), targets)
}

#[test]
fn arms_of_others_reach_what_their_joints_reach() {
    for model in ROBOT_MODELS {
        let Some(path) = robot_model(model) else { return };
        let mut draws = Streams::new(Seed(1)).draws(0, 0, Purpose(1));
        let (tip, targets) = reachable(&path, &mut draws);
        // Some of these places the joints reach only through the arm's own rods.
        let open = "[chain]\ndimensions = 3\nself_collision = false";
        let task = format!(
            "kind = \"targets\"\nconnector = {tip}\ntargets_m = {targets:?}\nspeed_m_s = 0.4"
        );
        let mut run = arm(&format!("{:?}", path.display().to_string()), open, &task);
        assert_joints_keep_their_laws(&mut run, 20_000, model);
        assert_all_is_reached(&run, model);
    }
}

/// A file of limits that a joint of the shipped arm has, and keys for all of them.
#[test]
fn an_arm_keeps_to_the_limits_of_a_file_and_of_keys() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("joint_limits.yaml");
    let text = "joint_limits:\n  turn_1:\n    has_acceleration_limits: true\n    max_acceleration: 0.8\n    \
                has_jerk_limits: true\n    max_jerk: 6.0\n";
    std::fs::write(&file, text).expect("written");
    let keys = format!(
        "{}, joint_limits = {:?}, max_velocity = 0.7, max_acceleration = 3",
        shipped(),
        file.display().to_string()
    );
    let task = "kind = \"targets\"\nconnector = 3\ntargets_m = [[0.4, 0.3, 0.6], [0.4, -0.3, 0.6]]";
    let mut run = arm(&keys, "[chain]\ndimensions = 3", task);
    let rates = run.world().chains[0].arm.clone().expect("an arm").motion.rates().to_vec();
    assert_eq!([rates[0].speed, rates[0].acceleration, rates[0].jerk], [0.7, 0.8, 6.0]);
    assert_eq!([rates[1].speed, rates[1].acceleration], [0.7, 3.0]);
    assert_joints_keep_their_laws(&mut run, 5000, "limits");
    assert_all_is_reached(&run, "limits");
    // It is not slower than it has to be, either: some joint comes near its limits.
    let peaks = run.state().body(0).tally.joint_peaks.clone();
    assert!(peaks[0].max_acceleration > 0.5 * 0.8, "{peaks:?}");
}

#[test]
fn an_arm_in_motion_goes_on_alike_from_a_checkpoint() {
    let task = "kind = \"targets\"\nconnector = 3\ntargets_m = [[0.4, 0.3, 0.6]]";
    let mut run = arm(&shipped(), "[chain]\ndimensions = 3", task);
    run.advance(20);
    assert!(!run.state().body(0).motion.is_at_rest());
    let checkpoint = run.checkpoint();
    let mut again = arm(&shipped(), "[chain]\ndimensions = 3", task);
    again.restore(&checkpoint).expect("its own");
    assert_eq!(run.digest(), again.digest());
    run.advance(40);
    again.advance(40);
    assert_eq!(run.digest(), again.digest());
}

#[test]
fn a_script_leads_a_tool_exactly_and_is_told_what_its_joints_cannot_do() {
    let there = [0.35, 0.1, 0.75];
    let [x, y, z] = there;
    let script = format!("kind = \"script\"\nconnector = 3\nscript = \"goto {x}, {y}, {z}\"\n");
    let mut run = arm(&shipped(), "[chain]\ndimensions = 3", &script);
    assert_joints_keep_their_laws(&mut run, 2000, "goto");
    assert!(run.is_over());
    assert!(distance(run.state().body(0).chain.points()[3], there) < 1e-8);
    // Two meters away no joint gets it.
    let script = "kind = \"script\"\nconnector = 3\nscript = \"goto 2, 0, 0.5\"\npatience_s = 1.0";
    let mut run = arm(&shipped(), "[chain]\ndimensions = 3", script);
    assert_joints_keep_their_laws(&mut run, 2000, "too far");
    let metrics = run.world().chain_metrics(run.state(), 0);
    assert!(run.is_over() && metrics.tally.given_up.len() == 1, "{metrics:?}");
}

#[test]
fn an_arm_gets_out_of_the_way_at_the_speeds_of_its_joints() {
    let ball = "[chain]\ndimensions = 3\n[[obstacles]]\nat_m = [1.2, 0.05, 0.6]\nradius_m = 0.1\n\
                patrol_m = [[1.2, 0.05, 0.6], [0.25, 0.05, 0.6]]\nspeed_m_s = 0.15";
    let mut run = arm(&shipped(), ball, "kind = \"rest\"\nlasts_s = 20.0");
    assert_joints_keep_their_laws(&mut run, 1000, "ball");
    let tally = run.world().chain_metrics(run.state(), 0).tally;
    assert!(tally.escapes.moves > 0, "it gives way");
    assert_eq!(tally.penetrations, 0);
}

/// The tool points down at each target, and may be turned about its axis.
#[test]
fn a_tool_is_turned_as_its_targets_ask() {
    let task = "kind = \"targets\"\nconnector = 3\ntargets_m = [[0.45, 0.1, 0.5], [0.35, -0.3, 0.6]]\n\
                rpy_rad = [[3.141592653589793, 0.0, 0.0]]\nfree = [\"rz\"]";
    let mut run = arm(&shipped(), "[chain]\ndimensions = 3", task);
    assert_joints_keep_their_laws(&mut run, 5000, "poses");
    assert_all_is_reached(&run, "poses");
    let arm = run.world().chains[0].arm.clone().expect("an arm");
    let tip = arm.serial.forward_kinematics(&joints(&run)).tip;
    assert!(distance(tip.origin_m, [0.35, -0.3, 0.6]) <= 1e-3);
    let down = tip.transform_direction([0.0, 0.0, 1.0]);
    assert!(down[2] < -1.0 + 1e-6, "{down:?}");
}

#[test]
fn joints_end_at_the_values_that_are_asked_for_around_an_obstacle() {
    let values = [1.2, 0.5, 0.0, 1.0, 0.0, 0.5, 0.3];
    let task = format!("kind = \"targets\"\nconnector = 3\njoints = [{values:?}]\nspeed_m_s = 0.4");
    let pillar = "[chain]\ndimensions = 3\n[[obstacles]]\nends_m = [[0.34, 0.24, 0.0], [0.34, 0.24, 1.2]]\nradius_m = 0.05";
    let mut run = arm(&shipped(), pillar, &task);
    assert_joints_keep_their_laws(&mut run, 5000, "joints");
    assert_all_is_reached(&run, "joints");
    let now = joints(&run);
    assert!(now.iter().zip(values).all(|(a, b)| (a - b).abs() < 1e-9), "{now:?}");
    assert_eq!(run.world().chain_metrics(run.state(), 0).tally.penetrations, 0);
}

/// A square with straight sides, seen by forward kinematics in every cycle.
#[test]
fn a_tool_goes_along_straight_lines() {
    let corners = [[0.5, -0.15, 0.6], [0.5, 0.15, 0.6], [0.4, 0.15, 0.75], [0.5, -0.15, 0.6]];
    let task = format!(
        "kind = \"targets\"\nconnector = 3\ntargets_m = {corners:?}\npath = \"line\"\nspeed_m_s = 0.4\ntolerance_m = 5e-4"
    );
    let mut run = arm(&shipped(), "[chain]\ndimensions = 3", &task);
    let mut from = run.state().body(0).chain.points()[3];
    let mut farthest_m: f64 = 0.0;
    let mut fastest_m_s: f64 = 0.0;
    let mut tool = from;
    while run.cycle() < 5000 && !run.is_over() {
        let next = run.state().body(0).driving.next as usize;
        run.advance(1);
        let body = run.state().body(0);
        let at = body.chain.points()[3];
        fastest_m_s = fastest_m_s.max(distance(at, tool) / 0.02);
        tool = at;
        if let Some(corner) = corners.get(next).filter(|_| body.driving.task == 0) {
            let along = normalized(sub(*corner, from)).expect("a length");
            farthest_m = farthest_m.max(norm(perpendicular_component(sub(at, from), along)));
            if body.driving.next as usize > next {
                from = at;
            }
        }
    }
    assert_all_is_reached(&run, "line");
    assert!(farthest_m <= 5e-4, "{farthest_m}");
    assert!(fastest_m_s > 0.2, "{fastest_m_s}");
}

#[test]
fn what_only_a_tool_can_do_is_refused_elsewhere_with_a_remedy() {
    let cause = |task: &str| {
        let urdf = shipped();
        let text = format!(
            "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\narm = {{ urdf = {urdf} }}\n\
             radius_m = 0.02\n[[chains.tasks]]\n{task}"
        );
        let source = Source::new("s.toml", &text, root());
        let error = ChainScenario::<3>::new(&source).expect_err("wrong");
        (error.cause().to_string(), error.remedy().to_string())
    };
    let goes = "kind = \"targets\"\ntargets_m = [[0.4, 0.1, 0.6]]";
    for (task, words) in [
        (format!("{goes}\nconnector = 2\nrpy_rad = [[0, 0, 0]]"), "give connector = 3, the tool"),
        (format!("{goes}\nconnector = 3\nfree = [\"rz\"]"), "add rpy_rad or quaternions"),
        (
            format!("{goes}\nconnector = 3\nrpy_rad = [[0, 0, 0], [0, 0, 1]]"),
            "give one for each target, or one for all",
        ),
        (
            format!("{goes}\nconnector = 3\npath = \"line\"\nplanner = \"none\""),
            "leave planner = \"none\" out",
        ),
        (
            "kind = \"targets\"\nconnector = 3\njoints = [[0, 9, 0, 1, 0, 0.5, 0]]".into(),
            "stay between -2.094 and 2.094 rad",
        ),
        ("kind = \"rest\"\nconnector = 3\npath = \"line\"".into(), "leave"),
        (
            format!("{goes}\nconnector = 3\npath = \"line\"\nfree = [\"rz\"]"),
            "add rpy_rad or quaternions",
        ),
        (
            format!("{goes}\nconnector = 3\npath = \"line\"\ntolerance_rad = 0.1"),
            "add rpy_rad or quaternions",
        ),
        (
            "kind = \"targets\"\nconnector = 3\njoints = [[0, 0, 0, 1, 0, 0.5, 0]]\ntolerance_m = 0.1".into(),
            "leave one of them out",
        ),
    ] {
        let (cause, remedy) = cause(&task);
        assert!(remedy.contains(words), "{task}: {cause}; {remedy}");
    }
}

/// A planar arm of three links with boxes for shapes.
fn boxed() -> String {
    let link = |k: usize, length: f64| {
        format!(
            "<link name='l{k}'><collision><origin xyz='{} 0 0'/><geometry><box size='{length} 0.1 0.1'/></geometry>\
             </collision></link>",
            0.5 * length
        )
    };
    let joint = |k: usize, x: f64| {
        format!(
            "<joint name='j{k}' type='revolute'><parent link='l{}'/><child link='l{k}'/><origin xyz='{x} 0 0'/>\
             <axis xyz='0 0 1'/><limit lower='-2.5' upper='2.5' velocity='1.5'/></joint>",
            k - 1
        )
    };
    format!(
        "<robot name='boxed'>{}{}{}{}{}{}{}<link name='tool'/><joint name='t' type='fixed'><parent link='l3'/>\
         <child link='tool'/><origin xyz='0.3 0 0'/></joint></robot>",
        link(0, 0.1),
        link(1, 0.4),
        link(2, 0.4),
        link(3, 0.3),
        joint(1, 0.0),
        joint(2, 0.4),
        joint(3, 0.4)
    )
}

/// Returns a run of the arm of boxes among obstacles, with radii of rods that its boxes do not have.
fn boxed_run(more: &str, rest: &str, task: &str) -> ChainRun<3> {
    let text = format!(
        "format = 1\nworld = \"chain\"\ncycles = 20000\n[chain]\ndimensions = 3\n{rest}\n[[chains]]\n\
         arm = {{ urdf_text = \"\"\"{}\"\"\", joints = [0.3, 0.5, 0.4]{more} }}\nradius_m = 0.2\nrod_radius_m = 0.15\n\
         [[chains.tasks]]\n{task}",
        boxed()
    );
    let source = Source::new("s.toml", &text, root());
    ChainScenario::<3>::new(&source).expect("valid").start(&source, 1)
}

/// Beside a wall that rods of the radius of its chain would be in.
#[test]
fn the_links_of_an_arm_are_what_must_not_touch() {
    let wall = "[[obstacles]]\nat_m = [0.2, 0.65, 0.0]\nsize_m = [0.6, 0.05, 0.4]";
    let task = "kind = \"targets\"\nconnector = 3\ntargets_m = [[0.55, 0.55, 0.0], [0.8, -0.3, 0.0]]\nspeed_m_s = 0.3";
    let mut run = boxed_run("", wall, task);
    let arm = run.world().chains[0].arm.clone().expect("an arm");
    let body = arm.body.clone().expect("shapes");
    let mut least_m = f64::INFINITY;
    while run.cycle() < 5000 && !run.is_over() {
        run.advance(1);
        let now = joints(&run);
        let (clearance_m, _) = body.clearance_m(arm.posture(&now), &run.world().obstacles, 0.5);
        least_m = least_m.min(clearance_m);
    }
    assert_all_is_reached(&run, "boxes");
    assert!(least_m > -1e-9 && least_m < 0.15, "{least_m}");
    let tally = run.world().chain_metrics(run.state(), 0).tally;
    assert!((tally.min_clearance_m - least_m).abs() < 1e-9, "{}", tally.min_clearance_m);
    assert_eq!(tally.penetrations, 0);
    // As connectors of a radius its tool overlaps the wall at the start already.
    let text = format!(
        "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n{wall}\n[[chains]]\narm = {{ urdf_text = \"\"\"{}\"\"\", \
         joints = [0.3, 0.5, 0.4], body = \"rods\" }}\nradius_m = 0.3\nrod_radius_m = 0.15\n[[chains.tasks]]\n{task}",
        boxed()
    );
    let source = Source::new("s.toml", &text, root());
    assert!(ChainScenario::<3>::new(&source).is_err());
}

/// Links one above another, whose rods are in one plane.
#[test]
fn links_that_pass_over_each_other_follow_their_plan() {
    let stacked = boxed()
        .replace("<origin xyz='0.4 0 0'/>", "<origin xyz='0.4 0 0.3'/>")
        .replace("<origin xyz='0.3 0 0'/>", "<origin xyz='0.6 0 -0.6'/>");
    let text = format!(
        "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[[chains]]\n\
         arm = {{ urdf_text = \"\"\"{stacked}\"\"\", joints = [0.0, 2.2, 0.5] }}\nradius_m = 0.02\nrod_radius_m = 0.01\n\
         [[chains.tasks]]\nkind = \"targets\"\nconnector = 3\njoints = [[0.0, 2.2, 2.2]]\nspeed_m_s = 0.3"
    );
    let source = Source::new("s.toml", &text, root());
    let start = || ChainScenario::<3>::new(&source).expect("valid").start(&source, 1);
    let mut run = start();
    let points = run.state().body(0).chain.points().to_vec();
    assert!(points.iter().all(|point| (point[2] - points[0][2]).abs() < 1e-9), "{points:?}");
    run.advance(5);
    // The cycle in which the path was planned; it counts on if the path is dropped.
    assert_eq!(run.state().body(0).driving.late, 1);
    let mut run = start();
    assert_joints_keep_their_laws(&mut run, 5000, "stacked");
    assert_all_is_reached(&run, "stacked");
    assert_eq!(run.state().body(0).tally.rungs.planned, 1);
}

#[test]
fn a_tool_and_its_load_are_parts_of_an_arm() {
    let rest = "kind = \"rest\"\nlasts_s = 0.1";
    let tool = ", tool = { xyz_m = [0.2, 0.0, 0.0], radius_m = 0.02, load_radius_m = 0.06 }";
    let run = boxed_run(tool, "", rest);
    let arm = run.world().chains[0].arm.clone().expect("an arm");
    let body = arm.body.clone().expect("shapes");
    let tip = run.state().body(0).chain.points()[3];
    let bare = boxed_run("", "", rest).state().body(0).chain.points()[3];
    assert!((distance(tip, bare) - 0.2).abs() < 1e-12);
    // A wall 0.1 m from the tool's point, which its load comes within 0.04 m of.
    let wall = Obstacle::ball(7, [tip[0], tip[1], 1.1], 1.0);
    let obstacles = Obstacles::new(vec![wall], 1.0).expect("valid");
    let (clearance_m, link) = body.clearance_m(arm.posture(&arm.values), &obstacles, 0.5);
    assert!((clearance_m - 0.04).abs() < 1e-6 && link == 3, "{clearance_m}");
}
