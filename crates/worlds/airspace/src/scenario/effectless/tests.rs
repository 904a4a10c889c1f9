use super::*;
use sidestep_scenario::Source;

fn remarks(keys: &str) -> Vec<String> {
    let text = format!(
        "format = 1\nworld = \"airspace\"\n[airspace]\n{keys}\n[airspace.generator]\nkind = \"superconflict\"\nn = 2\n"
    );
    let compiled = CompiledAirspace::new(&Source::new("test", text, "")).expect("a scenario");
    effectless_remarks(&compiled).into_iter().map(|remark| remark.key).collect()
}

#[test]
fn changes_of_level_and_speed_that_nobody_chooses_among_are_named() {
    let weights = "combinations = \"all\"\nlevel_weight = 2.0\nspeed_weight = 1.0\n";
    let of_weights = ["combinations", "level_weight", "speed_weight"];
    let of_weights = of_weights.map(|key| format!("airspace.{key}"));
    assert_eq!(remarks(weights), of_weights);
    let changes = "[airplane]\nlevel_changes_m = [300.0]\nspeed_changes_m_s = [-3.0]\n";
    assert_eq!(remarks(&format!("{weights}{changes}")), [""; 0]);
    let by_mvp = remarks(&format!("method = \"mvp\"\n{weights}{changes}"));
    let of_changes = ["airplane.level_changes_m", "airplane.speed_changes_m_s"];
    assert_eq!(by_mvp[..3], of_weights);
    assert_eq!(by_mvp[3..], of_changes);
}

#[test]
fn settings_of_a_method_that_nobody_uses_are_named() {
    let optimizer = "alpha = 0.1\ncooling = 0.5\nmax_rounds = 3\n";
    assert_eq!(remarks(optimizer), [""; 0]);
    let keys = ["alpha", "cooling", "max_rounds"].map(|key| format!("airspace.{key}"));
    for method in ["none", "mvp", "orca", "bands", "external"] {
        assert_eq!(remarks(&format!("method = \"{method}\"\n{optimizer}")), keys, "{method}");
    }
    let mvp = "mvp = { margin = 1.3 }\n";
    assert_eq!(remarks(mvp), ["airspace.mvp"]);
    assert_eq!(remarks(&format!("method = \"mvp\"\n{mvp}")), [""; 0]);
    let vertical = "method = \"mvp\"\nmvp = { resolution = \"vertical\", resolution_factor = 1.1, vertical_factor = 1.1 }\n";
    assert_eq!(remarks(vertical), ["airspace.mvp.resolution_factor"]);
    let heading = "method = \"mvp\"\nmvp = { vertical_factor = 1.1, speed_factors = [0.9, 1.1] }\n";
    assert_eq!(remarks(heading), ["airspace.mvp.vertical_factor", "airspace.mvp.speed_factors"]);
    assert_eq!(remarks("orca = { look_ahead_s = 20.0 }\n"), ["airspace.orca"]);
    assert_eq!(remarks("bands = { look_ahead_s = 20.0 }\n"), ["airspace.bands"]);
    assert_eq!(remarks("look_every_s = 5.0\n"), ["airspace.look_every_s"]);
    assert_eq!(remarks("method = \"none\"\nlook_every_s = 5.0\n"), [""; 0]);
}

#[test]
fn resolutions_by_levels_under_a_rule_without_any_are_named() {
    let vertical = "method = \"mvp\"\nmvp = { resolution = \"vertical\" }\n";
    for (rule, named) in [
        ("cruising-first", &[][..]),
        ("cruising-first-horizontal", &["airspace.mvp.resolution"]),
        ("climbing-first-horizontal", &["airspace.mvp.resolution"]),
    ] {
        assert_eq!(remarks(&format!("{vertical}right_of_way = {rule:?}\n")), named, "{rule}");
    }
}

#[test]
fn settings_of_levels_under_a_rule_without_any_are_named() {
    let settings = "vertical_factor = 1.1, vertical_lead_s = 5.0";
    let mvp = |resolution: &str, rule: &str| {
        format!(
            "method = \"mvp\"\nmvp = {{ resolution = \"{resolution}\", {settings} }}\nright_of_way = \"{rule}\"\n"
        )
    };
    let named = ["airspace.mvp.vertical_factor", "airspace.mvp.vertical_lead_s"];
    for rule in ["cruising-first-horizontal", "climbing-first-horizontal"] {
        assert_eq!(remarks(&mvp("heading-speed-vertical", rule)), named, "{rule}");
        let by_levels_alone = remarks(&mvp("vertical", rule));
        assert_eq!(by_levels_alone[..1], ["airspace.mvp.resolution"], "{rule}");
        assert_eq!(by_levels_alone[1..], named, "{rule}");
    }
    assert_eq!(remarks(&mvp("heading-speed-vertical", "cruising-first")), [""; 0]);
    let horizontal = mvp("heading-speed-vertical", "cruising-first-horizontal");
    let later = "changes = [{ at_s = 50.0, right_of_way = \"cruising-first\" }]\n";
    assert_eq!(remarks(&format!("{horizontal}{later}")), [""; 0]);
}

#[test]
fn right_of_way_that_nobody_minds_is_named() {
    let rule = "right_of_way = \"rules-of-the-air\"\n";
    for (method, is_named) in [
        ("none", true),
        ("external", true),
        ("pc", false),
        ("mvp", false),
        ("orca", false),
        ("bands", false),
    ] {
        let found = remarks(&format!("method = \"{method}\"\n{rule}"));
        assert_eq!(found == ["airspace.right_of_way"], is_named, "{method}: {found:?}");
        assert!(is_named || found.is_empty(), "{method}: {found:?}");
    }
    let none = "method = \"none\"\n";
    let changed = |keys: &str| format!("{none}changes = [{{ at_s = 50.0, {keys} }}]\n");
    let to_mvp = changed("method = \"mvp\"");
    assert_eq!(remarks(&format!("{to_mvp}{rule}")), [""; 0]);
    let to_mvp_alone = changed("method = \"mvp\", right_of_way = \"none\"");
    assert_eq!(remarks(&format!("{to_mvp_alone}{rule}")), ["airspace.right_of_way"]);
    let later = changed("right_of_way = \"cruising-first\"");
    assert_eq!(remarks(&later), ["airspace.changes.right_of_way"]);
    let both = "legs = { turns_s = [20.0], until_s = [80.0] }\nlook_every_s = 5.0\n";
    assert_eq!(remarks(&format!("{none}{both}{rule}")), [""; 0], "for methods of both kinds");
}

#[test]
fn actions_have_an_effect_with_every_method() {
    let actions = "holds_s = [2.0]\nlegs = { turns_s = [20.0], until_s = [80.0] }\n";
    for method in ["pc", "none", "mvp", "orca", "bands", "external"] {
        assert_eq!(remarks(&format!("method = \"{method}\"\n{actions}")), [""; 0], "{method}");
    }
}

#[test]
fn a_margin_of_predictions_has_no_effect_beside_methods_with_margins_of_their_own() {
    for (method, is_named) in
        [("none", false), ("external", false), ("mvp", true), ("orca", true), ("bands", true)]
    {
        let found = remarks(&format!("method = \"{method}\"\ninflation = 1.3\n"));
        assert_eq!(found == ["airspace.inflation"], is_named, "{method}: {found:?}");
    }
}

#[test]
fn nobody_is_told_of_keys_that_an_import_has_written() {
    let flights = "00:00:00>CRE A1,B744,0,-0.4,90,FL200,250\n00:00:00>DEST A1 0,0.4\n";
    for settings in [
        "",
        "00:00:00>RESO MVP\n",
        "00:00:00>RESO OFF\n",
        "00:00:00>RESO OFF\n00:00:00>PRIORULES ON FF2\n",
        "00:00:00>DTLOOK 60\n",
    ] {
        let file = sidestep_import::bluesky::parse(&"r.scn", &format!("{settings}{flights}"));
        let text = crate::traffic::from_bluesky("r", &file).expect("it has aircraft");
        let compiled = CompiledAirspace::new(&Source::new("r", text, "")).expect("a scenario");
        let found = effectless_remarks(&compiled);
        assert!(found.is_empty(), "{settings}: {found:?}");
    }
}

#[test]
fn a_scenario_for_methods_of_both_kinds_is_no_mistake() {
    let both = "legs = { turns_s = [20.0], until_s = [80.0] }\nlook_every_s = 5.0\n";
    assert_eq!(remarks(both), [""; 0]);
    assert_eq!(remarks(&format!("method = \"mvp\"\n{both}")), [""; 0]);
}

#[test]
fn settings_of_a_method_that_comes_later_have_an_effect() {
    let changes = "changes = [{ at_s = 50.0, method = \"mvp\" }]\nmvp = { margin = 1.3 }\n";
    assert_eq!(remarks(&format!("method = \"none\"\n{changes}")), [""; 0]);
}

#[test]
fn limits_that_no_airplane_comes_near_are_named() {
    let named = |airplane: &str, orders: &str| -> Vec<String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airplane]\n{airplane}\n[[airplanes]]\nat_m = [0, 0]\n\
             heading_deg = 0\nway_points_m = [[9000, 0]]\n{orders}\n"
        );
        let compiled = CompiledAirspace::new(&Source::new("l", text, "")).expect("a scenario");
        effectless_remarks(&compiled).into_iter().map(|remark| remark.key).collect()
    };
    let limits = "acceleration_m_s2 = 1.0\nclimb_max_m_s = 9.0\ndescent_max_m_s = 9.0\n\
                  bank_max_deg = 5.0\nomega_max_deg_s = 4.0";
    let all = ["omega_max_deg_s", "acceleration_m_s2", "climb_max_m_s", "descent_max_m_s"];
    assert_eq!(named(limits, ""), all.map(|key| format!("airplane.{key}")));
    let orders = "orders = [{ speed_m_s = 9.0 }, { altitude_m = 9.0 }]";
    assert_eq!(named(limits, orders), [""; 0], "the turn rate limits it when it is slow");
}

#[test]
fn tables_of_types_that_no_airplane_names_are_named() {
    assert_eq!(remarks("openap_folder = \"data\"\n"), ["airspace.openap_folder"]);
}

#[test]
fn settings_of_measures_that_are_not_taken_are_named() {
    let settings = "well_clear = { standard = \"do-365\" }\nnmac = { vertical_m = 20.0 }\n";
    assert_eq!(remarks(settings), [""; 0]);
    let off = "measures = { pairs = \"off\", look_ahead_s = 30.0 }\n";
    assert_eq!(
        remarks(&format!("{off}{settings}")),
        ["airspace.measures.look_ahead_s", "airspace.well_clear", "airspace.nmac"]
    );
    let off = "measures = { flights = \"off\", lift_to_drag = 12.0 }\n";
    assert_eq!(remarks(off), ["airspace.measures.lift_to_drag"]);
}

#[test]
fn a_safe_altitude_below_which_nobody_is_held_is_named() {
    let named = ["airspace.safe_altitude_m"];
    assert_eq!(remarks("safe_altitude_m = 100.0\n"), [""; 0], "all fly at 0 m");
    assert_eq!(remarks("safe_altitude_m = -5.0\n"), named);
    assert_eq!(remarks("safe_altitude_m = 100.0\nshield = \"off\"\n"), named);
}

#[test]
fn surveillance_by_which_nobody_is_seen_is_named() {
    let keys = "surveillance = { latency_s = 1.0 }\n";
    assert_eq!(remarks(keys), ["airspace.surveillance"]);
    for method in ["mvp", "orca", "bands", "external"] {
        assert_eq!(remarks(&format!("method = \"{method}\"\n{keys}")), [""; 0], "{method}");
    }
    let team = "method = \"mvp\"\ndeployment = \"team\"\n";
    assert_eq!(remarks(&format!("{team}{keys}")), ["airspace.surveillance"]);
    let later = "changes = [{ at_s = 50.0, airplanes = [1], non_cooperative = true }]\n";
    assert_eq!(remarks(&format!("{later}{keys}")), [""; 0]);
    let coast = "method = \"mvp\"\nsurveillance = { coast_s = 20.0 }\n";
    assert_eq!(remarks(coast), ["airspace.surveillance.coast_s"]);
    let missed = coast.replace("coast_s", "reception_probability = 0.5, coast_s");
    assert_eq!(remarks(&missed), [""; 0]);
    let velocity = "method = \"mvp\"\n[airplane]\nnac_v = 2\n";
    assert_eq!(remarks(velocity), ["airplane.nac_v"]);
    assert_eq!(remarks(&format!("{keys}{velocity}")), [""; 0]);
    let noise = "method = \"mvp\"\nerror_sigmas = 3.0\nsurveillance = { position_noise_m = 9.0 }\n";
    assert_eq!(remarks(noise), ["airspace.error_sigmas"], "no airplane is non-cooperative");
    assert_eq!(remarks(&format!("{later}{noise}")), [""; 0]);
}

#[test]
fn a_bound_on_errors_without_errors_is_named() {
    assert_eq!(remarks("error_sigmas = 3.0\n"), ["airspace.error_sigmas"]);
    assert_eq!(remarks("error_sigmas = 3.0\nposition_noise_m = 2.0\n"), [""; 0]);
}
