//! Remarks on keys that are given and change nothing: settings of a method that no airplane uses at any time.
//!
//! They are no errors, because sweeps and `compare` fly one scenario by several methods.

use super::{AirspaceSection, CompiledAirspace};
use crate::method::MethodKind;
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
        // The look-ahead and the margin of all methods but these two are those of the predictions.
        let has_own_margin =
            |method: &MethodKind| matches!(method, MethodKind::Mvp | MethodKind::Orca);
        let mut rules = compiled.world.all_rules();
        if section.inflation.is_some() && rules.all(|rules| has_own_margin(&rules.method)) {
            note("inflation", "all airplanes avoid others by method mvp or orca");
        }
    }
    let is_for_both = section.look_every_s.is_some() && section.legs.is_some();
    if !is_for_both && section.mvp.is_given() && !uses(|method| matches!(method, MethodKind::Mvp)) {
        note("mvp", "no airplane avoids others by method mvp");
    }
    if !is_for_both && section.orca.is_given() && !uses(|method| matches!(method, MethodKind::Orca))
    {
        note("orca", "no airplane avoids others by method orca");
    }
    if section.look_every_s.is_some() && section.legs.is_none() && !looks_anew(compiled) {
        note("look_every_s", "it is for scenarios that fly by mvp, orca or none alone");
    }
    if section.error_sigmas.is_some() && has_no_errors(section) {
        note("error_sigmas", "position_noise_m and heading_noise_deg are 0");
    }
    remarks
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

/// Returns whether all methods of a scenario look anew each time, and plan nothing.
fn looks_anew(compiled: &CompiledAirspace) -> bool {
    let mut rules = compiled.world.all_rules();
    rules.all(|rules| matches!(rules.method, MethodKind::Mvp | MethodKind::Orca | MethodKind::None))
}

fn has_no_errors(section: &AirspaceSection) -> bool {
    let is_zero = |noise: Option<f64>| noise.is_none_or(|noise| noise == 0.0);
    is_zero(section.position_noise_m.map(f64::from))
        && is_zero(section.heading_noise_deg.map(f64::from))
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
    fn settings_of_a_method_that_nobody_uses_are_named() {
        let optimizer = "alpha = 0.1\ncooling = 0.5\nmax_rounds = 3\n";
        assert_eq!(remarks(optimizer), [""; 0]);
        let keys = ["alpha", "cooling", "max_rounds"].map(|key| format!("airspace.{key}"));
        for method in ["none", "mvp", "orca", "external"] {
            assert_eq!(remarks(&format!("method = \"{method}\"\n{optimizer}")), keys, "{method}");
        }
        let mvp = "mvp = { margin = 1.3 }\n";
        assert_eq!(remarks(mvp), ["airspace.mvp"]);
        assert_eq!(remarks(&format!("method = \"mvp\"\n{mvp}")), [""; 0]);
        assert_eq!(remarks("orca = { look_ahead_s = 20.0 }\n"), ["airspace.orca"]);
        assert_eq!(remarks("look_every_s = 5.0\n"), ["airspace.look_every_s"]);
        assert_eq!(remarks("method = \"none\"\nlook_every_s = 5.0\n"), [""; 0]);
    }

    #[test]
    fn actions_have_an_effect_with_every_method() {
        let actions = "holds_s = [2.0]\nlegs = { turns_s = [20.0], until_s = [80.0] }\n";
        for method in ["pc", "none", "mvp", "orca", "external"] {
            assert_eq!(remarks(&format!("method = \"{method}\"\n{actions}")), [""; 0], "{method}");
        }
    }

    #[test]
    fn a_margin_of_predictions_has_no_effect_beside_methods_with_margins_of_their_own() {
        for (method, is_named) in
            [("none", false), ("external", false), ("mvp", true), ("orca", true)]
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
    fn a_bound_on_errors_without_errors_is_named() {
        assert_eq!(remarks("error_sigmas = 3.0\n"), ["airspace.error_sigmas"]);
        assert_eq!(remarks("error_sigmas = 3.0\nposition_noise_m = 2.0\n"), [""; 0]);
    }
}
