//! Scenarios that are refused, and those that look much like them and are valid.

use super::*;

/// Two links that a fixed joint holds together, and a third that turns.
const WRIST: &str = "<robot name='wrist'><link name='base'/><link name='post'/><link name='hand'/><link name='tool'/>\
    <joint name='mount' type='fixed'><parent link='base'/><child link='post'/><origin xyz='0.5 0 0'/></joint>\
    <joint name='turn' type='continuous'><parent link='post'/><child link='hand'/><axis xyz='0 0 1'/></joint>\
    <joint name='grip' type='fixed'><parent link='hand'/><child link='tool'/><origin xyz='0.5 0 0'/></joint></robot>";

/// Returns the error of a scenario, in one line; none if it is valid.
fn error_of(text: &str) -> Option<String> {
    let text = format!("format = 1\nworld = \"chain\"\n{text}");
    let error = AnyChainScenario::new(&Source::new("s.toml", text, "")).err()?;
    Some(format!("{} | {}", error.cause(), error.remedy()))
}

fn assert_refused(text: &str, words: &[&str]) {
    let error = error_of(text).unwrap_or_else(|| panic!("is taken for valid:\n{text}"));
    assert!(words.iter().all(|word| error.contains(word)), "{error}, not {words:?}:\n{text}");
}

fn assert_valid(text: &str) {
    assert_eq!(error_of(text), None, "{text}");
}

fn arm(keys: &str) -> String {
    format!(
        "[chain]\ndimensions = 3\n[[chains]]\narm = {{ urdf_text = \"{WRIST}\", {keys} }}\nradius_m = 0.02\n\
         [[chains.tasks]]\nkind = \"wander\"\nconnector = 1\n"
    )
}

#[test]
fn an_arm_without_a_joint_that_moves_is_refused() {
    let words = ["nothing moves between", "give another base or another tip"];
    assert_refused(&arm("base = \"base\", tip = \"post\""), &words);
    assert_refused(&arm("base = \"hand\""), &words);
    assert_valid(&arm("base = \"base\""));
}

#[test]
fn a_tool_is_as_thick_as_it_is_said_or_refused_by_name() {
    let radii_m = |tool: &str| {
        let text =
            format!("format = 1\nworld = \"chain\"\n{}", arm(&format!("tool = {{ {tool} }}")));
        let compiled = ChainScenario::<3>::new(&Source::new("s.toml", text, "")).expect("valid");
        let chain = &compiled.world.chains[0].start;
        let tip = chain.connectors().last().expect("a tip").radius_m;
        [chain.rods().last().expect("a rod").radius_m, tip]
    };
    // Connectors of 0.02 m, and rods of 0.016 m.
    assert_eq!(radii_m("load_radius_m = 0.01"), [0.01, 0.01]);
    assert_eq!(radii_m("load_radius_m = 0.05"), [0.016, 0.05]);
    assert_eq!(radii_m("radius_m = 0.018, load_radius_m = 0.01"), [0.018, 0.018]);
    assert_refused(
        &arm("tool = { radius_m = 0.06 }"),
        &["tool.radius_m = 0.06 is more than the 0.02 m", "give tool.radius_m = 0.02 or less"],
    );
}

#[test]
fn any_path_is_that_of_every_chain() {
    let task = "kind = \"targets\"\nconnector = 2\ntargets_m = [[1.0, 0.5]]\npath =";
    let chain = "[[chains]]\nconnectors = 4\nrod_m = 0.4\n[[chains.tasks]]\n";
    assert_valid(&format!("{chain}{task} \"any\"\n"));
    assert_refused(&format!("{chain}{task} \"line\"\n"), &["only the tool of an arm has"]);
}

#[test]
fn a_cycle_too_short_for_the_joints_of_an_arm_is_refused() {
    let text = arm("").replace("dimensions = 3", "dimensions = 3\ndt_s = 1e-8");
    assert_refused(&text, &["more than 4096 cycles", "give chain.dt_s = "]);
}

#[test]
fn numbers_of_a_navigator_are_numbers_and_in_order() {
    let navigator = |keys: &str| {
        format!(
            "[[chains]]\nconnectors = 3\nrod_m = 0.8\n[[chains.tasks]]\nkind = \"navigate\"\n\
             navigator = {{ target_m = [9.0, 0.0], {keys} }}\n"
        )
    };
    for keys in ["sector_deg = [nan, nan]", "sector_deg = [nan, 90]", "sector_deg = [-inf, 90]"] {
        assert_refused(&navigator(keys), &["-360 to 360"]);
    }
    assert_refused(&navigator("sector_deg = [90, 10]"), &["the right end of the sector first"]);
    for keys in ["detects_from_m = nan", "detects_from_m = -3.0", "detects_from_m = 0.0"] {
        assert_refused(&navigator(keys), &["a number above 0, or inf"]);
    }
    assert_valid(&navigator("sector_deg = [0, 90], detects_from_m = inf"));
}

#[test]
fn a_limit_that_another_one_replaces_or_that_limits_nothing_is_refused() {
    let limits = |more: &str| {
        format!(
            "[[chains]]\nconnectors = 4\nrod_m = 0.4\nlimits = [{{ connector = 2, mobility = \"fixed\" }}, {more}]\n\
             [[chains.tasks]]\nkind = \"rest\"\n"
        )
    };
    let twice = limits("{ connector = 2, mobility = \"free\" }");
    assert_refused(&twice, &["connector 2 has `mobility` twice", "once"]);
    assert_refused(&limits("{ connector = 1 }"), &["connector 1 is given without a limit"]);
    assert_valid(&limits("{ connector = 2, max_bend_deg = 90.0 }"));
}

/// Two chains anywhere on a map.
fn anywhere(second: &str) -> String {
    let chain = "[[chains]]\nconnectors = 3\nrod_m = 0.4\nradius_m = 0.1\nanywhere = true\n";
    let task = "[[chains.tasks]]\nkind = \"wander\"\n";
    format!(
        "format = 1\nworld = \"chain\"\nseed = 1\n[ground]\nmap = \"examples/building.yaml\"\n\
         {chain}{task}{chain}{second}{task}"
    )
}

fn starts(text: &str, seed: u64) -> Vec<Vec<[f64; 2]>> {
    let text = text.replace("seed = 1", &format!("seed = {seed}"));
    let source = Source::new("s.toml", text, sidestep_testing::root());
    let compiled =
        ChainScenario::<2>::new(&source).unwrap_or_else(|error| panic!("{seed}: {error}"));
    compiled.world.chains.iter().map(|spec| spec.start.points().to_vec()).collect()
}

#[test]
fn chains_anywhere_have_places_of_their_own_beside_each_other_and_beside_obstacles() {
    let alone = anywhere("");
    for seed in 1..=10 {
        let [a, b] = &starts(&alone, seed)[..] else { panic!("two chains") };
        assert_ne!(a, b, "{seed}");
    }
    // A room that only just holds both, and a pillar in it.
    let within = "within_m = [[0.3, 0.3], [2.5, 2.5]]\n";
    let pillar = "[[obstacles]]\nat_m = [1.2, 1.2]\nradius_m = 0.2\n[[chains]]";
    let cramped =
        anywhere(within).replacen("anywhere = true\n", &format!("anywhere = true\n{within}"), 1);
    let cramped = cramped.replacen("[[chains]]", pillar, 1);
    for seed in 1..=10 {
        assert_eq!(starts(&cramped, seed).len(), 2);
    }
}

#[test]
fn a_chain_that_is_whole_is_not_joined() {
    let chain = |breaks_s: f64, joins_s: f64| {
        format!(
            "[[chains]]\nconnectors = 6\nrod_m = 0.5\ntasks = [{{ kind = \"rest\" }}]\n\
             changes = [{{ at_s = {joins_s}, reform = true }}, {{ at_s = {breaks_s}, scatter = [2, 3] }}]\n"
        )
    };
    // Cycles are rounded, of 0.02 s.
    assert_refused(&chain(1.0, 0.985), &["reform of a chain that is whole"]);
    assert_valid(&chain(1.0, 1.0));
    assert_valid(&chain(1.005, 1.0));
}

#[test]
fn keys_that_have_no_effect_are_refused() {
    let task = "tasks = [{ kind = \"rest\" }]\n";
    let points = |key: &str| {
        format!("[[chains]]\npoints_m = [[0.0, 0.0], [0.5, 0.0]]\nrod_m = 0.5\n{key}\n{task}")
    };
    assert_refused(&points("heading_deg = 90"), &["`heading_deg` does nothing", "points_m"]);
    assert_refused(&points("along = [1.0, 0.0]"), &["`along` does nothing", "points_m"]);
    assert_valid(&points(""));
    let apart = |count: &str| {
        format!("[[chains]]\nconnectors = 2\nrod_m = 0.5\napart_m = [0.0, 2.0]\n{count}\n{task}")
    };
    // Sweeps vary the number of chains from one on.
    assert_valid(&apart("count = 1"));
    assert_valid(&apart("count = 2"));
    let folded =
        arm("base = \"base\"").replace("radius_m = 0.02", "radius_m = 0.02\nfolded_m = [1.0, 0.5]");
    assert_refused(&folded, &["an arm has its shape from its URDF file", "folded_m"]);
    let corridor = "[ground]\ncorridor = { width_m = 1.5 }\nunknown = \"free\"\n";
    let chain = format!("[[chains]]\nconnectors = 2\nrod_m = 0.5\n{task}");
    assert_refused(&format!("{corridor}{chain}"), &["`unknown` does nothing", "ground.map"]);
}

#[test]
fn a_field_may_be_given_by_the_earlier_name_of_its_fill_fraction() {
    let field = |keys: &str| {
        format!(
            "[[fields]]\nlo_m = [1, 1]\nhi_m = [9, 9]\nradius_m = 0.5\n{keys}\n\
             [[chains]]\nconnectors = 2\nat_m = [0, 0]\nrod_m = 0.5\n[[chains.tasks]]\nkind = \"wander\"\n"
        )
    };
    assert_valid(&field("fill_fraction = 0.1"));
    assert_valid(&field("part = 0.1"));
    let words = ["earlier name of `fill_fraction`", "leave out `part`"];
    assert_refused(&field("part = 0.1\nfill_fraction = 0.1"), &words);
}

/// A chain of five rods of 0.3 m with one target, or one between two fixed ends whose middle has it.
fn with_target(mobility: &str, target: &str) -> String {
    format!(
        "[[chains]]\nconnectors = 6\nat_m = [0.0, 1.5]\nalong = [0.0, -1.0]\nrod_m = 0.3\nradius_m = 0.02\n\
         rod_radius_m = 0.01\nlimits = [{{ connector = 5, mobility = {mobility} }}]\n\
         tasks = [{{ kind = \"targets\", targets_m = [[0.5, 0.5], {target}], tolerance_m = 0.01 }}]\n"
    )
}

#[test]
fn a_target_that_no_posture_reaches_is_refused_with_its_distance() {
    let base = "\"fixed\"";
    assert_valid(&with_target(base, "[0.0, 1.505]"));
    let words = ["target 1, [0.0, 1.52]: it is 1.5200 m from connector 5", "5 rods reach 1.5000 m"];
    assert_refused(&with_target(base, "[0.0, 1.52]"), &words);
    assert_refused(
        &with_target(base, "[0.0, 1.52]"),
        &["give a target at most 1.5000 m from there"],
    );
    let rail = "{ on_segment = [[-1.0, 0.0], [1.0, 0.0]] }";
    assert_valid(&with_target(rail, "[2.4, 0.2]"));
    assert_refused(&with_target(rail, "[2.6, 0.2]"), &["1.6125 m from the segment of connector 5"]);
    let line = "{ on_plane = { normal = [0.0, 1.0], offset_m = 0.0 } }";
    assert_valid(&with_target(line, "[90.0, 1.4]"));
    assert_refused(&with_target(line, "[90.0, -1.6]"), &["1.6000 m from the plane of connector 5"]);
    let room = "{ in_box = [[-1.0, -0.5], [1.0, 0.0]] }";
    assert_valid(&with_target(room, "[2.0, -1.0]"));
    assert_refused(&with_target(room, "[2.2, -1.6]"), &["1.6279 m from the box of connector 5"]);
    assert_valid(&with_target("\"free\"", "[90.0, 90.0]"));
}

#[test]
fn a_target_in_the_hole_of_unequal_rods_is_refused() {
    let near = |mobility: &str, target: &str| {
        format!(
            "[[chains]]\npoints_m = [[0, 0], [1.0, 0.0], [1.3, 0.0]]\nrod_m = 1.0\n\
             limits = [{{ connector = 0, mobility = {mobility} }}]\n\
             tasks = [{{ kind = \"targets\", connector = 1, targets_m = [{target}], tolerance_m = 0.01 }}]\n"
        )
        .replace("[1.3, 0.0]", "[2.0, 0.0]")
    };
    assert_valid(&near("\"fixed\"", "[0.0, -0.995]"));
    assert_refused(
        &near("\"fixed\"", "[0.0, 0.9]"),
        &["0.9000 m from connector 0", "at least 1.0000 m"],
    );
    assert_valid(&near("{ on_segment = [[0.0, 0.0], [0.5, 0.0]] }", "[-0.5, 0.1]"));
    let rail = "{ on_segment = [[0.0, 0.0], [0.5, 0.0]] }";
    assert_refused(&near(rail, "[0.25, 0.9]"), &["0.9341 m from the segment", "at least 1.0000 m"]);
    let room = "{ in_box = [[-0.1, 0.0], [0.5, 0.2]] }";
    assert_refused(&near(room, "[0.2, 0.7]"), &["0.7616 m from the box", "at least 1.0000 m"]);
}

#[test]
fn a_target_between_two_ends_is_refused_if_one_of_them_does_not_reach_it() {
    let between = |target: &str, changes: &str| {
        format!(
            "[[chains]]\npoints_m = [[0, 0], [1, 0], [2, 1], [3, 1]]\nrod_m = [0.9, 1.5]\n{changes}\n\
             limits = [{{ connector = 0, mobility = \"fixed\" }}, {{ connector = 3, mobility = \"fixed\" }}]\n\
             tasks = [{{ kind = \"targets\", connector = 1, targets_m = [{target}], tolerance_m = 0.01 }}]\n"
        )
    };
    assert_valid(&between("[1.2, 0.0]", ""));
    assert_refused(
        &between("[0.0, -1.3]", ""),
        &["from connector 3, which is fixed", "2 rods reach 3.0000 m"],
    );
    // It may be let go before it is needed.
    let change = "changes = [{ at_s = 1.0, connector = 3, mobility = \"free\" }]";
    assert_valid(&between("[0.0, -1.3]", change));
}
