//! Remarks on keys that are given and change nothing: settings of a method that no airplane uses at any time.
//!
//! They are no errors, because sweeps and `compare` fly one scenario by several methods.

use super::surveillance::SurveillanceSection;
use super::{AirspaceSection, CompiledAirspace, ModelSection};
use crate::flight::{AirplaneStart, FlightTask, TurnLimit};
use crate::method::MethodKind;
use crate::settings::{Combinations, Resolution, RightOfWayRule};
use crate::surveillance::each_decides_by_tracks;
use crate::world::AirspaceWorld;
use sidestep_kernel::distr::Bernoulli;
use sidestep_scenario::{Remark, Spanned};

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
    let is_horizontal = "right_of_way resolves conflicts in the horizontal alone";
    if has_no_vertical_resolution(compiled) {
        note("mvp.resolution", is_horizontal);
    }
    if never_changes_levels(compiled) {
        for key in section.mvp.vertical_keys() {
            note(&format!("mvp.{key}"), is_horizontal);
        }
    }
    if let Some(key) = effectless_right_of_way(compiled).filter(|_| !is_for_both) {
        note(key, "no airplane avoids others by any method while it holds");
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
        note(
            "error_sigmas",
            "no position and no heading has errors for which it counts; those of surveillance count for non-cooperative \
             airplanes alone",
        );
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

/// Returns whether MVP may change levels by its settings, and never does by the rules of right of way.
fn never_changes_levels(compiled: &CompiledAirspace) -> bool {
    let changes_level = |rules: &&AirspaceWorld| {
        matches!(rules.method, MethodKind::Mvp) && rules.mvp_resolution.resolution.changes_level()
    };
    let mut rules = compiled.world.all_rules().filter(changes_level).peekable();
    rules.peek().is_some() && rules.all(|rules| rules.right_of_way.is_horizontal())
}

/// Returns the key of a rule of right of way that is given, if none ever holds together with a method by which airplanes
/// avoid others: the shield goes by priorities alone.
fn effectless_right_of_way(compiled: &CompiledAirspace) -> Option<&'static str> {
    let mut rules = compiled
        .world
        .all_rules()
        .filter(|rules| rules.right_of_way != RightOfWayRule::None)
        .peekable();
    rules.peek()?;
    let is_given_at_start = compiled.world.right_of_way != RightOfWayRule::None;
    let key = if is_given_at_start { "right_of_way" } else { "changes.right_of_way" };
    let has_no_effect =
        rules.all(|rules| matches!(rules.method, MethodKind::None | MethodKind::External));
    has_no_effect.then_some(key)
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
    let is_observed = |rules| each_decides_by_tracks(rules) || has_non_cooperative(rules);
    compiled.world.all_rules().any(is_observed)
}

/// Returns whether any airplane is non-cooperative under some rules, for a while at least.
fn has_non_cooperative(rules: &AirspaceWorld) -> bool {
    // One on a recorded track is, until it is handed over.
    let is_tracked = |i: usize| rules.airplanes[i].track.is_some() && rules.replay_cycles > 0;
    (0..rules.airplanes.len()).any(|i| !rules.is_controlled(i) || is_tracked(i))
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

/// Returns whether nothing has errors that the shield bounds. Of the errors of sensors it bounds those with which
/// non-cooperative airplanes are seen.
fn has_no_errors(compiled: &CompiledAirspace) -> bool {
    let section = &compiled.recipe.file.airspace;
    let is_zero = |noise: Option<f64>| noise.is_none_or(|noise| noise == 0.0);
    let has_noise = |given: &Spanned<SurveillanceSection>| given.get_ref().has_position_noise();
    let has_sensor_errors = section.surveillance.as_ref().is_some_and(has_noise)
        && compiled.world.all_rules().any(has_non_cooperative);
    is_zero(section.heading_noise_deg.map(f64::from))
        && !compiled.world.has_position_errors
        && !has_sensor_errors
}

#[cfg(test)]
mod tests;
