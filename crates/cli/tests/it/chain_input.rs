//! E1 for chains: wrong input is an error with file, line, column, cause and remedy; exit code
//! 2, nothing written.

use crate::support::TestFolder;

const RIGHT: &str = r#"format = 1
world = "chain"
cycles = 20

[chain]
dt_s = 0.1

[[obstacles]]
at_m = [5.0, 5.0]
radius_m = 0.5

[[chains]]
connectors = 4
at_m = [0.0, 0.0]
rod_m = [0.9, 1.0]
radius_m = 0.1

[[chains.tasks]]
kind = "targets"
targets_m = [[1.0, 0.0]]
speed_m_s = 0.5
"#;

/// Runs the command, checks that the input is refused and that nothing was written, and returns the
/// error.
fn refused(place: &TestFolder, name: &str, more: &[&str]) -> String {
    let before = place.names();
    let mut told = String::new();
    for command in [&["run", "c.toml", "--out", "out"][..], &["check", "c.toml"]] {
        let ended = place.run(&[command, more].concat());
        told = ended.err();
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{name}: {told}");
        assert!(told.starts_with("error: ") && told.contains("\n  help: "), "{name}: {told}");
        // `check` reports all errors, `run` the first.
        let is_one = told.matches("error: ").count() == 1;
        assert!(is_one || command == ["check", "c.toml"], "{name}: {told}");
        assert_eq!(place.names(), before, "{name}: something was written");
    }
    told
}

/// Returns whether a text starts with `file:LINE:COLUMN: `.
fn has_position(err: &str, file: &str) -> bool {
    let Some((_, rest)) = err.split_once(&format!("{file}:")) else { return false };
    let mut parts = rest.splitn(3, ':');
    (0..2).all(|_| parts.next().is_some_and(|p| p.parse::<u32>().is_ok_and(|n| n > 0)))
}

/// Cases: if `find` is replaced in [`RIGHT`], the input must be refused with these words.
#[rustfmt::skip]
const TABLE: &[(&str, &str, &str, &str)] = &[
    ("no time", "dt_s = 0.1", "dt_s = 0.0", "dt_s = 0"),
    ("time that is no number", "dt_s = 0.1", "dt_s = nan", "dt_s = NaN"),
    ("endless time", "dt_s = 0.1", "dt_s = inf", "dt_s = inf"),
    ("time going back", "dt_s = 0.1", "dt_s = -0.1", "dt_s = -0.1"),
    ("place of a chain", "at_m = [0.0, 0.0]", "at_m = [nan, 0.0]", "at_m"),
    ("place far away", "at_m = [0.0, 0.0]", "at_m = [0.0, 1e9]", "at_m"),
    ("place of an obstacle", "at_m = [5.0, 5.0]", "at_m = [5.0, inf]", "at_m"),
    ("radius of an obstacle", "radius_m = 0.5", "radius_m = nan", "radius NaN m"),
    ("radius below nothing", "radius_m = 0.5", "radius_m = -1.0", "radius -1 m"),
    ("endless radius", "radius_m = 0.1", "radius_m = inf", "radius"),
    ("radius of a connector", "radius_m = 0.1", "radius_m = nan", "radius"),
    ("rod limits swapped", "rod_m = [0.9, 1.0]", "rod_m = [1.1, 1.0]", "[1.1, 1] m"),
    ("rods without length", "rod_m = [0.9, 1.0]", "rod_m = [0.0, 1.0]", "0 < min"),
    ("rods that are no number", "rod_m = [0.9, 1.0]", "rod_m = nan", "finite"),
    ("rods of no length", "rod_m = [0.9, 1.0]", "rod_m = 0.0", "0 < min"),
    ("no rods", "rod_m = [0.9, 1.0]\n", "", "rod_m"),
    ("bend", "radius_m = 0.1", "radius_m = 0.1\nmax_bend_deg = nan", "bend limit"),
    ("bend too far", "radius_m = 0.1", "radius_m = 0.1\nmax_bend_deg = 270", "bend limit"),
    ("heading", "radius_m = 0.1", "radius_m = 0.1\nheading_deg = inf", "finite"),
    ("direction without length", "radius_m = 0.1", "radius_m = 0.1\nalong = [0.0, 0.0]", "along"),
    ("speed", "speed_m_s = 0.5", "speed_m_s = nan", "speed_m_s = NaN"),
    ("no speed", "speed_m_s = 0.5", "speed_m_s = 0.0", "speed_m_s = 0"),
    ("endless speed", "speed_m_s = 0.5", "speed_m_s = inf", "speed_m_s = inf"),
    ("too many steps", "speed_m_s = 0.5", "speed_m_s = 1e6", "in steps of"),
    ("target", "[[1.0, 0.0]]", "[[1.0, nan]]", "targets_m"),
    ("target of three", "[[1.0, 0.0]]", "[[1.0, 0.0, 0.0]]", "chain.dimensions is 2"),
    ("no targets", "[[1.0, 0.0]]", "[]", "needs targets"),
    ("patience", "speed_m_s = 0.5", "patience_s = nan", "patience_s = NaN"),
    ("tolerance", "speed_m_s = 0.5", "tolerance_m = 0.0", "tolerance_m = 0"),
    ("no connectors", "connectors = 4", "connectors = 0", "connectors = 0"),
    ("too many connectors", "connectors = 4", "connectors = 20000000", "10000000"),
    ("too many together", "connectors = 4", "connectors = 10000000\ncount = 7\napart_m = [0.0, 1.0]", "at most 10000000"),
    ("copies at one place", "connectors = 4", "connectors = 4\ncount = 2", "apart_m"),
    ("coincident connectors", "connectors = 4\nat_m = [0.0, 0.0]", "points_m = [[0.0, 0.0], [0.0, 0.0]]", "same place"),
    ("connectors too far apart", "connectors = 4\nat_m = [0.0, 0.0]", "points_m = [[0.0, 0.0], [3.0, 0.0]]", "3 m apart"),
    ("no points", "connectors = 4\nat_m = [0.0, 0.0]", "points_m = []", "points_m"),
    ("placed twice", "connectors = 4", "connectors = 4\npoints_m = [[0.0, 0.0]]", "placed twice"),
    ("initiator that is not there", "kind = \"targets\"", "kind = \"targets\"\nconnector = 4", "connector = 4 of a chain of 4"),
    ("limit of nobody", "[[chains.tasks]]", "[[chains.limits]]\nconnector = 9\nfailed = true\n[[chains.tasks]]", "connector = 9"),
    ("change of nobody", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1.0\nconnector = 9\nfailed = true\n[[chains.tasks]]", "of 4"),
    ("change at no time", "[[chains.tasks]]", "[[chains.changes]]\nat_s = nan\nconnector = 1\nfailed = true\n[[chains.tasks]]", "at_s = NaN"),
    ("change of two things", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1\nconnector = 1\nfailed = true\nreform = true\n[[chains.tasks]]", "not one thing"),
    ("scattered end", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1\nscatter = [0, 1]\n[[chains.tasks]]", "whole end"),
    ("change of a bend", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1\nconnector = 1\nmax_bend_deg = -3\n[[chains.tasks]]", "bend limit"),
    ("unknown mobility", "[[chains.tasks]]", "[[chains.limits]]\nconnector = 1\nmobility = \"fixd\"\n[[chains.tasks]]", "fixed"),
    ("connector off its line", "[[chains.tasks]]", "[[chains.limits]]\nconnector = 1\nmobility = { on_segment = [[0, 5], [1, 5]] }\n[[chains.tasks]]", "mobility"),
    ("mobility without number", "[[chains.tasks]]", "[[chains.limits]]\nconnector = 1\nmobility = { on_segment = [[nan, 5], [1, 5]] }\n[[chains.tasks]]", "mobility"),
    ("unknown key", "connectors = 4", "conectors = 4", "did you mean `connectors`?"),
    ("unknown key of a task", "speed_m_s = 0.5", "sped_m_s = 0.5", "did you mean `speed_m_s`?"),
    ("unknown key of the world", "dt_s = 0.1", "dt = 0.1", "dt_s"),
    ("unknown key of an obstacle", "radius_m = 0.5", "radus_m = 0.5", "did you mean `radius_m`?"),
    ("unknown kind", "kind = \"targets\"", "kind = \"target\"", "did you mean `targets`?"),
    ("foreign key", "speed_m_s = 0.5", "turn_deg = 5.0", "does nothing"),
    ("escape that is off", "dt_s = 0.1", "dt_s = 0.1\nescape = \"off\"\nescape_speed_m_s = 1.0", "does nothing with escape = \"off\""),
    ("look-ahead of a touch", "dt_s = 0.1", "dt_s = 0.1\nescape = \"touch\"\nescape_ahead_s = 1.0", "does nothing with escape = \"touch\""),
    ("unknown method of escape", "dt_s = 0.1", "dt_s = 0.1\nescape_by = \"both\"", "known are: simultaneous, literal"),
    ("no task", "[[chains.tasks]]\nkind = \"targets\"\ntargets_m = [[1.0, 0.0]]\nspeed_m_s = 0.5\n", "", "without a task"),
    ("dimensions", "dt_s = 0.1", "dimensions = 4", "dimensions = 4"),
    ("three dimensions", "dt_s = 0.1", "dimensions = 3", "chain.dimensions is 3"),
    ("records nothing", "[chain]", "[record]\nevery = 0\n[chain]", "every = 0"),
    ("two shapes", "radius_m = 0.5", "radius_m = 0.5\nsize_m = [1.0, 1.0]\nends_m = [[0.0, 0.0], [1.0, 1.0]]", "two"),
    ("box of no size", "radius_m = 0.5", "size_m = [1.0, 0.0]", "a box of no size"),
    ("joined whole", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1\nreform = true\n[[chains.tasks]]", "that is whole"),
    ("joined too early", "[[chains.tasks]]", "[[chains.changes]]\nat_s = 1\nreform = true\n[[chains.changes]]\nat_s = 2\nscatter = [1, 1]\n[[chains.tasks]]", "that is whole"),
    ("velocity", "radius_m = 0.5", "radius_m = 0.5\nvelocity_m_s = [nan, 0.0]", "velocity_m_s"),
    ("mover out of its room", "radius_m = 0.5", "radius_m = 0.5\nvelocity_m_s = [1.0, 0.0]\nbounces_m = [[0, 0], [1, 1]]", "not in its room"),
    ("two grounds", "[chain]", "[ground]\nmap = \"m.yaml\"\ncorridor = { width_m = 1.0 }\n[chain]", "2 grounds"),
    ("no ground", "[chain]", "[ground]\n[chain]", "0 grounds"),
    ("narrow corridor", "[chain]", "[ground]\ncorridor = { width_m = 0.0 }\n[chain]", "width of 0 m"),
    ("corridor without legs", "[chain]", "[ground]\ncorridor = { width_m = 3.0, legs = [] }\n[chain]", "no leg"),
    ("corridor of no length", "[chain]", "[ground]\ncorridor = { width_m = 3.0, legs = [{ straight_m = nan }] }\n[chain]", "leg 0"),
    ("field of too much", "[chain]", "[[fields]]\nlo_m = [0, 0]\nhi_m = [9, 9]\npart = 0.5\nradius_m = 1e-6\n[chain]", "obstacles of radius"),
    ("field of nothing", "[chain]", "[[fields]]\nlo_m = [0, 0]\nhi_m = [9, 9]\npart = nan\nradius_m = 1.0\n[chain]", "obstacles of radius"),
    ("two names of a key", "[chain]", "[[fields]]\nlo_m = [0, 0]\nhi_m = [9, 9]\npart = 0.1\nfill_fraction = 0.1\nradius_m = 1.0\n[chain]", "earlier name of `fill_fraction`"),
    ("crowd too large", "[chain]", "[[fields]]\nlo_m = [0, 0]\nhi_m = [9, 9]\nn = 4000000000\nradius_m = 0.1\nspeed_m_s = 1.0\n[chain]", "moving obstacles"),
    ("starts inside", "at_m = [5.0, 5.0]", "at_m = [-2.2, 0.3]", "deep in obstacle 0, with connector 2"),
    ("a mover starts inside", "at_m = [5.0, 5.0]", "at_m = [-2.0, 0.3]\nvelocity_m_s = [0.0, 1.0]", "deep in obstacle 0, with connector 2"),
];

#[test]
fn a_wrong_scenario_is_refused_where_it_is_wrong() {
    for (name, find, replace, said) in TABLE {
        let place = TestFolder::new();
        assert!(RIGHT.contains(find), "{name}");
        place.write("c.toml", RIGHT.replacen(find, replace, 1));
        let err = refused(&place, name, &[]);
        assert!(err.contains(said), "{name}: {err}");
        assert!(has_position(&err, "c.toml"), "{name}: {err}");
    }
}

#[test]
fn chains_that_begin_in_each_other_are_refused_unless_they_may() {
    let place = TestFolder::new();
    let other = "[[chains]]\nconnectors = 4\nat_m = [-1.5, 1.0]\nalong = [0.0, -1.0]\nrod_m = 1.0\n\
                 radius_m = 0.1\n[[chains.tasks]]\nkind = \"rest\"\n";
    place.write("c.toml", format!("{RIGHT}{other}"));
    let err = refused(&place, "overlap", &[]);
    assert!(err.contains("chain 0 begins") && err.contains("deep in chain 1"), "{err}");
    assert!(has_position(&err, "c.toml"), "{err}");
    place.json(&["check", "c.toml", "--set", "chain.may_start_inside=true"]);
    let copies = RIGHT.replace("connectors = 4", "connectors = 4\ncount = 2\napart_m = [0.5, 0.0]");
    place.write("c.toml", copies);
    assert!(refused(&place, "copies", &[]).contains("deep in chain"));
}

const SCRIPTED: &str = "format = 1\nworld = \"chain\"\n[chains]\nconnectors = 2\nrod_m = 1.0\n\
                        [chains.tasks]\nkind = \"script\"\n";

#[test]
fn a_wrong_script_is_refused_where_it_is_wrong() {
    for (script, said) in [
        ("forward", "script:1:8"),
        ("forward 1\\n  turn left", "script:2:8"),
        ("forward 1 / 0", "script:1:9"),
        ("to go forward 0 go end go", "motions"),
        ("to go go turn 1 end go", "in each other"),
        ("repeat 10000000 [ repeat 10000000 [ ] ]", "repeat less often"),
        ("repeat -1 [ forward 1 ]", "whole number"),
        ("goto 1e300, 0", "1e6 m"),
        ("dance 3", "dance"),
        ("wait -1", "script:1:6"),
    ] {
        let place = TestFolder::new();
        place.write("c.toml", format!("{SCRIPTED}script = \"{script}\"\n"));
        let err = refused(&place, script, &[]);
        assert!(err.contains(said), "{script}: {err}");
        if !said.starts_with("script:") {
            continue;
        }
        place.write("way.txt", script.replace("\\n", "\n"));
        place.write("c.toml", format!("{SCRIPTED}script_file = \"way.txt\"\n"));
        let err = refused(&place, script, &[]);
        assert!(has_position(&err, "way.txt"), "{script}: {err}");
    }
    let place = TestFolder::new();
    place.write("c.toml", SCRIPTED);
    assert!(refused(&place, "no script", &[]).contains("needs one script"));
    place.write("c.toml", format!("{SCRIPTED}script_file = \"gone.txt\"\n"));
    assert!(refused(&place, "no file", &[]).contains("gone.txt"));
}

#[test]
fn an_error_of_a_key_points_at_the_key_not_at_its_section() {
    for (header, line) in [
        ("[[chains.tasks]]", "connector = 9"),
        ("[[chains.tasks]]", "turn_deg = 5.0"),
        ("[[chains.limits]]\nfailed = true", "connector = 9"),
        ("[[chains.changes]]\nat_s = 1.0\nfailed = true", "connector = 9"),
        ("[[chains.changes]]\nat_s = 1.0", "scatter = [0, 1]"),
        ("[[chains.changes]]\nat_s = 1.0\nconnector = 1", "max_bend_deg = -3"),
        ("[[chains]]", "count = 2"),
        ("[[chains]]", "points_m = [[0.0, 0.0]]"),
        ("[[chains]]", "anywhere = true"),
        ("[[obstacles]]", "turn_deg = 5.0"),
        ("[[obstacles]]", "size_m = [nan, 1.0]"),
        ("[[obstacles]]", "corners_m = [[0.0, 0.0]]"),
    ] {
        let place = TestFolder::new();
        let with = format!("{header}\n{line}\n");
        let text = match RIGHT.contains(header) {
            true => RIGHT.replacen(&format!("{header}\n"), &with, 1),
            false => RIGHT.replacen("[[chains.tasks]]", &format!("{with}[[chains.tasks]]"), 1),
        };
        place.write("c.toml", &text);
        let number = text.lines().position(|l| l == line).expect(line) + 1;
        let err = refused(&place, line, &[]);
        assert!(err.contains(&format!("c.toml:{number}:")), "{line} is {number}: {err}");
    }
}

/// All scripts are checked with the first one, not in the middle of a run.
#[test]
fn every_script_is_tried_before_a_run_begins() {
    let place = TestFolder::new();
    let second = "script = \"forward 1\"\n[[chains.tasks]]\nkind = \"script\"\nscript = \"to go forward 0 go end go\"\n";
    let text = SCRIPTED.replace("[chains.tasks]", "[[chains.tasks]]");
    place.write("c.toml", format!("{text}{second}"));
    assert!(refused(&place, "second", &[]).contains("motions"));
}

#[test]
fn wrong_grounds_are_named() {
    let ground = |what: &str| format!("{RIGHT}[ground]\n{what}\n");
    let place = TestFolder::new();
    place.write("c.toml", ground("map = \"gone.yaml\""));
    assert!(refused(&place, "no map", &[]).contains("gone.yaml"));
    place.write("m.yaml", "image: gone.pgm\nresolution: 0.5\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n");
    place.write("c.toml", ground("map = \"m.yaml\""));
    assert!(refused(&place, "no image", &[]).contains("gone.pgm"));
    place.write("c.toml", ground("stage = \"gone.world\""));
    assert!(refused(&place, "no world", &[]).contains("gone.world"));
    place.write("a.world", "include \"b.inc\"\n");
    place.write("b.inc", "include \"a.world\"\n");
    place.write("c.toml", ground("stage = \"a.world\""));
    let err = refused(&place, "loop", &[]);
    assert!(err.contains("includes itself") && has_position(&err, "b.inc"), "{err}");
    place.write("c.toml", ground("map = \"m.yaml\"").replace("dt_s = 0.1", "dimensions = 3"));
    refused(&place, "a floor in space", &[]);
}

const ARM: &str = "format = 1\nworld = \"chain\"\n[chain]\ndimensions = 3\n[chains]\n\
                   arm = { urdf = \"a.urdf\" }\nradius_m = 0.05\n[chains.tasks]\nkind = \"rest\"\nlasts_s = 0.1\n";

fn urdf(joint: &str, more: &str) -> String {
    format!(
        "<robot name=\"a\">\n<link name=\"base\"/><link name=\"tip\"/>\n\
         <joint name=\"j\" type=\"revolute\"><parent link=\"base\"/><child link=\"tip\"/>\n\
         <origin xyz=\"0 0 0.5\"/>{joint}<limit lower=\"-1\" upper=\"1\" effort=\"1\" velocity=\"1\"/></joint>\n\
         {more}</robot>\n"
    )
}

#[test]
fn wrong_models_of_arms_are_named() {
    let axis = "<axis xyz=\"0 1 0\"/>";
    let back =
        "<joint name=\"k\" type=\"fixed\"><parent link=\"tip\"/><child link=\"base\"/></joint>";
    let second = "<link name=\"x\"/><link name=\"y\"/>\
                  <joint name=\"k\" type=\"fixed\"><parent link=\"x\"/><child link=\"y\"/></joint>";
    for (name, text, said) in [
        ("loop", urdf(axis, back), "a.urdf:"),
        ("missing link", urdf(axis, "").replace("<link name=\"tip\"/>", ""), "`tip`"),
        ("zero axis", urdf("<axis xyz=\"0 0 0\"/>", ""), "not zero"),
        ("no axis of numbers", urdf("<axis xyz=\"nan 0 1\"/>", ""), "a.urdf:"),
        ("xacro", urdf(axis, "<xacro:hand side=\"left\"/>"), "xacro"),
        ("no XML", "not xml".into(), "a.urdf"),
        ("no robot", "<world/>".into(), "a.urdf"),
        ("two roots", urdf(axis, second), "connect"),
    ] {
        let place = TestFolder::new();
        place.write("c.toml", ARM);
        place.write("a.urdf", text);
        let err = refused(&place, name, &[]);
        assert!(err.contains(said), "{name}: {err}");
    }
    let place = TestFolder::new();
    place.write("c.toml", ARM);
    assert!(refused(&place, "no file", &[]).contains("a.urdf"));
    let mesh = "<link name=\"base\"><visual><geometry><mesh filename=\"package://x/gone.dae\"/></geometry></visual></link>";
    place.write("a.urdf", urdf(axis, "").replace("<link name=\"base\"/>", mesh));
    place.json(&["run", "c.toml"]);
    for wrong in [
        "chains.arm.tip=nobody",
        "chains.arm.joints=[9.0]",
        "chains.arm.joints=[nan]",
        "chains.arm.joints=[]",
        "chain.dimensions=2",
    ] {
        refused(&place, wrong, &["--set", wrong]);
    }
}
