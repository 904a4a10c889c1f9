//! Remarks on keys that are given and change nothing: settings of a method that no airplane uses at any time.
//!
//! They are no errors, because sweeps and `compare` fly one scenario by several methods.

use super::{AirspaceSection, CompiledAirspace, ModelSection};
use crate::flight::{AirplaneStart, FlightTask, TurnLimit};
use crate::method::MethodKind;
use crate::settings::{Combinations, Resolution};
use crate::surveillance::each_decides_by_tracks;
use sidestep_kernel::distr::Bernoulli;
use sidestep_scenario::Remark;

/// Returns the remarks on a scenario, in the order of its keys.
pub(super) fn effectless_remarks(compiled: &CompiledAirspace) -> Vec<Remark> {
    let section = &compiled.recipe.file.airspace;
    let uses = |is_used: fn(&MethodKind) -> bool| {
        let mut rules = compiled.world.all_rules();
        // Nobody knows what a method of a program's own reads.
        rules.any(|rules| is_used(&rules.method) || matches!(rules.method, MethodKind::Own(_)))
    };
    let mut remarks = Vec::new();
    let mut note = |key: &str, because: &str| {
        let words = format!("has no effect: {because}");
        remarks.push(Remark::note(format!("airspace.{key}"), words));
    };
    if !uses(|method| matches!(method, MethodKind::Pc)) {
        for key in optimizer_keys(section) {
            note(key, "no airplane avoids others by method pc");
        }
        // The look-ahead and the margin of all methods but these three are those of the predictions.
        let has_own_margin = |method: &MethodKind| {
            matches!(method, MethodKind::Mvp | MethodKind::Orca | MethodKind::Bands)
        };
        let mut rules = compiled.world.all_rules();
        if section.inflation.is_some() && rules.all(|rules| has_own_margin(&rules.method)) {
            note("inflation", "all airplanes avoid others by method mvp, orca or bands");
        }
    }
    let is_for_both = section.look_every_s.is_some() && section.legs.is_some();
    if !is_for_both && section.mvp.is_given() && !uses(|method| matches!(method, MethodKind::Mvp)) {
        note("mvp", "no airplane avoids others by method mvp");
    }
    for key in section.mvp.effectless_keys(compiled.world.mvp_resolution.resolution) {
        let because = "airspace.mvp.resolution leaves that as filed";
        if section.changes.is_empty() {
            note(&format!("mvp.{key}"), because);
        }
    }
    if has_no_vertical_resolution(compiled) {
        let because = "right_of_way resolves conflicts in the horizontal alone";
        note("mvp.resolution", because);
    }
    if !is_for_both && section.orca.is_given() && !uses(|method| matches!(method, MethodKind::Orca))
    {
        note("orca", "no airplane avoids others by method orca");
    }
    if !is_for_both
        && section.bands.is_given()
        && !uses(|method| matches!(method, MethodKind::Bands))
    {
        note("bands", "no airplane avoids others by method bands");
    }
    if section.look_every_s.is_some() && section.legs.is_none() && !looks_anew(compiled) {
        note("look_every_s", "it is for scenarios that fly by mvp, orca, bands or none alone");
    }
    for (key, because) in effectless_changes(compiled) {
        note(key, because);
    }
    for key in keys_of_pairs(section) {
        note(key, "measures.pairs is \"off\"");
    }
    if section.measures.lift_to_drag.is_some() && !section.measures.flights.0 {
        note("measures.lift_to_drag", "measures.flights is \"off\"");
    }
    if section.error_sigmas.is_some() && has_no_errors(compiled) {
        note("error_sigmas", "no position and no heading has errors for which it counts");
    }
    if section.surveillance.is_some() && !is_anybody_observed(compiled) {
        note(
            "surveillance",
            "airplanes tell each other where they are, and none is non-cooperative",
        );
    }
    if let Some(because) = effectless_coast(compiled) {
        note("surveillance.coast_s", because);
    }
    if let Some(safe_m) = compiled.world.safe_altitude_m {
        if compiled.world.all_rules().all(|rules| !rules.shield) {
            note("safe_altitude_m", "without the shield no airplane is held");
        } else if compiled.world.airplanes.iter().all(|one| min_altitude_m(one) >= safe_m) {
            note("safe_altitude_m", "no airplane comes below it");
        }
    }
    if compiled.recipe.types.is_empty() {
        let files = [
            ("types_file", section.types_file.is_some()),
            ("openap_folder", section.openap_folder.is_some()),
        ];
        for (key, _) in files.into_iter().filter(|(_, is_given)| *is_given) {
            note(key, "no airplane has a type");
        }
    }
    remarks.extend(effectless_limits(compiled));
    remarks
}

/// Returns whether MVP is to change levels alone, under a rule by which it never does.
fn has_no_vertical_resolution(compiled: &CompiledAirspace) -> bool {
    let mut rules = compiled
        .world
        .all_rules()
        .filter(|rules| matches!(rules.method, MethodKind::Mvp))
        .peekable();
    rules.peek().is_some()
        && rules.all(|rules| {
            let is_vertical = rules.mvp_resolution.resolution == Resolution::Vertical;
            is_vertical && rules.right_of_way.is_horizontal()
        })
}

/// Returns why the time for which tracks coast has no effect, if it is given and has none.
fn effectless_coast(compiled: &CompiledAirspace) -> Option<&'static str> {
    let section = compiled.recipe.file.airspace.surveillance.as_ref()?;
    let settings = compiled.world.surveillance?;
    let receives_all = settings.reception == Bernoulli::new(1.0) && settings.range_m.is_infinite();
    (section.get_ref().has_coast() && receives_all).then_some("every report is received")
}

/// Returns whether any airplane is seen by reports under some of the rules.
fn is_anybody_observed(compiled: &CompiledAirspace) -> bool {
    let airplanes = compiled.world.airplanes.len();
    compiled.world.all_rules().any(|rules| {
        // One on a recorded track is non-cooperative for a while.
        let is_tracked = |i: usize| rules.airplanes[i].track.is_some() && rules.replay_cycles > 0;
        each_decides_by_tracks(rules)
            || (0..airplanes).any(|i| !rules.is_controlled(i) || is_tracked(i))
    })
}

/// Returns the lowest altitude in meters that an airplane has by its start and its orders.
fn min_altitude_m(airplane: &AirplaneStart) -> f64 {
    airplane.orders.iter().fold(airplane.altitude_m, |low_m, order| match order.task {
        FlightTask::Altitude { altitude_m, .. } => low_m.min(altitude_m),
        _ => low_m,
    })
}

/// Returns the keys of changes of level and speed that nobody chooses among, and why.
fn effectless_changes(compiled: &CompiledAirspace) -> Vec<(&'static str, &'static str)> {
    let section = &compiled.recipe.file.airspace;
    let world = &compiled.world;
    if !world.changes.is_none() {
        return Vec::new();
    }
    let has_changes = world.airplanes.iter().any(|airplane| !airplane.changes.is_empty());
    let because = if has_changes {
        "no airplane avoids others by method pc"
    } else {
        "no airplane has level_changes_m or speed_changes_m_s"
    };
    let given = [
        ("combinations", section.combinations == Combinations::All),
        ("level_weight", section.level_weight.is_some()),
        ("speed_weight", section.speed_weight.is_some()),
    ];
    let keys = given.into_iter().filter(|(_, is_given)| *is_given);
    keys.map(|(key, _)| (key, because)).collect()
}

/// Returns the remarks on limits for all airplanes that no airplane comes near.
fn effectless_limits(compiled: &CompiledAirspace) -> Vec<Remark> {
    let world = &compiled.world;
    let airplanes = &world.airplanes;
    let keys = compiled.recipe.file.airplane.as_ref().map(ModelSection::abilities);
    let keys = keys.unwrap_or_default();
    let orders = || airplanes.iter().flat_map(|airplane| &airplane.orders);
    let rules = || compiled.world.all_rules();
    let commands_speeds = rules().any(|rules| rules.command_kinds().speeds.is_some());
    let commands_levels = rules().any(|rules| rules.command_kinds().levels);
    let changes_speed = commands_speeds || orders().any(|order| order.task.speed_m_s().is_some());
    let changes_level =
        commands_levels || orders().any(|order| matches!(order.task, FlightTask::Altitude { .. }));
    let bank_holds = airplanes.iter().all(|airplane| {
        let TurnLimit { omega_max_rad_s, lateral_m_s2 } = airplane.performance.turn;
        airplane.planned_speeds_m_s().all(|v_m_s| lateral_m_s2 / v_m_s < omega_max_rad_s)
    });
    let no_choice = "no airplane avoids others by method pc";
    let no_speed = "no airplane is ordered to another speed";
    let no_level = "no airplane is ordered to another level";
    let all = [
        (
            "omega_max_deg_s",
            keys.omega_max_deg_s.is_some() && bank_holds,
            "the bank limits all turns more",
        ),
        (
            "level_changes_m",
            world.changes.is_none() && airplanes.iter().any(|a| !a.changes.levels_m.is_empty()),
            no_choice,
        ),
        (
            "speed_changes_m_s",
            world.changes.is_none() && airplanes.iter().any(|a| !a.changes.speeds_m_s.is_empty()),
            no_choice,
        ),
        (
            "nac_v",
            world.surveillance.is_none() && world.velocity_noise_m_s.iter().any(|m_s| *m_s > 0.0),
            "without [airspace.surveillance] nobody takes velocities from reports",
        ),
        ("acceleration_m_s2", keys.acceleration_m_s2.is_some() && !changes_speed, no_speed),
        ("climb_max_m_s", keys.climb_max_m_s.is_some() && !changes_level, no_level),
        ("descent_max_m_s", keys.descent_max_m_s.is_some() && !changes_level, no_level),
        (
            "endurance_s",
            keys.endurance_s.is_some()
                && (0..airplanes.len()).all(|i| !compiled.world.is_controlled(i)),
            "no method flies any airplane",
        ),
    ];
    let effectless = all.into_iter().filter(|(_, has_no_effect, _)| *has_no_effect);
    effectless
        .map(|(key, _, because)| {
            Remark::note(format!("airplane.{key}"), format!("has no effect: {because}"))
        })
        .collect()
}

/// Returns the keys of the optimizer that are given. The actions, which `holds_s` and `legs` give, are none of them: those
/// of all methods are the shield's alternatives and the orders of an external method.
fn optimizer_keys(section: &AirspaceSection) -> Vec<&'static str> {
    let given = [
        ("alpha", section.alpha.is_some()),
        ("beta", section.beta.is_some()),
        ("estimator", section.estimator.is_some()),
        ("update", section.update.is_some()),
        ("order", section.order.is_some()),
        ("utility", section.utility.is_some()),
        ("cooling", section.cooling.is_some()),
        ("max_rounds", section.max_rounds.is_some()),
        ("choice", section.choice.is_some()),
        ("local_search", section.local_search.is_some()),
        ("random_starts", section.random_starts.is_some()),
        ("minimum_up_to", section.minimum_up_to.is_some()),
        ("group_memory_gib", section.group_memory_gib.is_some()),
    ];
    given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect()
}

/// Returns the keys of measures of pairs that are given, where none are taken.
fn keys_of_pairs(section: &AirspaceSection) -> Vec<&'static str> {
    if section.measures.pairs.0 {
        return Vec::new();
    }
    let given = [
        ("measures.look_ahead_s", section.measures.look_ahead_s.is_some()),
        ("well_clear", section.well_clear.is_some()),
        ("nmac", section.nmac.is_some()),
    ];
    given.into_iter().filter(|(_, is_given)| *is_given).map(|(key, _)| key).collect()
}

/// Returns whether all methods of a scenario look anew each time, and plan nothing.
fn looks_anew(compiled: &CompiledAirspace) -> bool {
    let mut rules = compiled.world.all_rules();
    rules.all(|rules| {
        matches!(
            rules.method,
            MethodKind::Mvp | MethodKind::Orca | MethodKind::Bands | MethodKind::None
        )
    })
}

fn has_no_errors(compiled: &CompiledAirspace) -> bool {
    let section = &compiled.recipe.file.airspace;
    let is_zero = |noise: Option<f64>| noise.is_none_or(|noise| noise == 0.0);
    let surveillance = section.surveillance.as_ref();
    is_zero(section.heading_noise_deg.map(f64::from))
        && !compiled.world.has_position_errors
        && !surveillance.is_some_and(|given| given.get_ref().has_position_noise())
}

#[cfg(test)]
mod tests {
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
        let heading =
            "method = \"mvp\"\nmvp = { vertical_factor = 1.1, speed_factors = [0.9, 1.1] }\n";
        assert_eq!(
            remarks(heading),
            ["airspace.mvp.vertical_factor", "airspace.mvp.speed_factors"]
        );
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
        for settings in ["", "00:00:00>RESO MVP\n", "00:00:00>RESO OFF\n", "00:00:00>DTLOOK 60\n"] {
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
        let noise =
            "method = \"mvp\"\nerror_sigmas = 3.0\nsurveillance = { position_noise_m = 9.0 }\n";
        assert_eq!(remarks(noise), [""; 0]);
    }

    #[test]
    fn a_bound_on_errors_without_errors_is_named() {
        assert_eq!(remarks("error_sigmas = 3.0\n"), ["airspace.error_sigmas"]);
        assert_eq!(remarks("error_sigmas = 3.0\nposition_noise_m = 2.0\n"), [""; 0]);
    }
}
