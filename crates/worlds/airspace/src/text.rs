//! Texts for people: a scenario's contents, a run's outcome, and the pose of every airplane.

use super::areas::{Area, AreaKind};
use super::decide::DecisionStrategy;
use super::flight::Surface;
use super::metrics::{AreaExemption, ErrorBoundViolation, Metrics, UnprotectedPair};
use super::scenario::CompiledAirspace;
use super::state::Snapshot;
use super::world::AirspaceWorld;
use serde_json::{Value, json};
use sidestep_kernel::Cycle;
use sidestep_kernel::text::{
    JsonTextReport, KeyValues, align_pairs, group_thousands, key_value_pair,
};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::sync::Arc;

/// Returns what is known of a scenario before it runs.
pub(super) fn describe_scenario(compiled: &CompiledAirspace) -> JsonTextReport {
    let world = &*compiled.world;
    let shield = if world.shield { "on" } else { "off" };
    let recorded = world.airplanes.iter().filter(|a| a.track.is_some()).count() as u64;
    // JSON has no infinity, so a time that is never reached is null.
    let until_s = match world.replay_cycles {
        Cycle::MAX => f64::INFINITY,
        cycles => world.cycle_start_s(cycles),
    };
    let non_cooperative = world.airplanes.iter().filter(|a| a.is_non_cooperative).count() as u64;
    let json = json!({
        "airplanes": world.airplanes.len(),
        "intruders": non_cooperative,
        "method": world.method.name(),
        "deployment": world.deployment.name(),
        "shield": shield,
        "dt_s": world.timing.dt_s,
        "look_every_s": world.timing.dtau_s,
        "rule_changes_s": rule_change_times_s(world),
        "horizon_s": world.timing.horizon_s(),
        "cycles": compiled.cycles,
        "seed": compiled.seed,
        "too_close": compiled.too_close,
        "areas": world.areas.len(),
        "origin_deg": world.origin_deg,
        "surface": match world.surface {
            Surface::Plane => "plane",
            Surface::Earth => "earth",
        },
        "curvature_margin_m": (world.surface == Surface::Earth && world.shield)
            .then_some(2.0 * world.curvature_m),
        "start_utc_s": world.start_utc_s,
        "recorded": recorded,
        "replay_until_s": (recorded > 0).then_some(until_s),
    });
    let mut lines =
        vec![key_value_pair("airplanes", group_thousands(world.airplanes.len() as u64))];
    if non_cooperative > 0 {
        lines.push(key_value_pair("intruders", group_thousands(non_cooperative)));
    }
    lines.extend(abilities_text(world));
    if recorded > 0 {
        let until = if until_s.is_finite() { format!("until {until_s} s") } else { "all".into() };
        lines.push(key_value_pair(
            "recorded",
            format!("{}, replayed {until}", group_thousands(recorded)),
        ));
    }
    lines.extend(scenario_timing_text(compiled));
    lines.extend(geographic_origin_text(world));
    lines.extend(surface_text(world));
    lines.extend(areas_text(world));
    lines.extend(too_close_warning(world, &compiled.too_close));
    JsonTextReport { json, text: align_pairs(&lines) }
}

/// Returns the times at which rules change.
fn rule_change_times_s(world: &AirspaceWorld) -> Vec<f64> {
    world.later_rules.iter().map(|(from, _)| world.cycle_start_s(*from)).collect()
}

/// Returns how often the airplanes decide, and for how long they fly.
fn scenario_timing_text(compiled: &CompiledAirspace) -> KeyValues {
    let dt_s = compiled.world.timing.dt_s;
    let cycles = group_thousands(compiled.cycles);
    let duration_s = compiled.cycles as f64 * dt_s;
    let look_ahead_s = compiled.world.reactive_settings().look_ahead_s;
    vec![
        key_value_pair(
            "time",
            format!(
                "decides every {dt_s} s, looks {look_ahead_s} s ahead{}",
                look_interval(compiled)
            ),
        ),
        key_value_pair(
            "run",
            format!("at most {cycles} cycles ({duration_s} s), seed {}", compiled.seed),
        ),
    ]
}

/// Returns how often methods look that look anew in each step, and not only when they decide.
fn look_interval(compiled: &CompiledAirspace) -> String {
    let looks_each_step = compiled.world.all_rules().any(DecisionStrategy::is_reactive);
    if looks_each_step {
        format!(", anew every {} s", compiled.world.timing.dtau_s)
    } else {
        String::new()
    }
}

/// Returns the position of the origin on earth, if it has one.
fn geographic_origin_text(world: &AirspaceWorld) -> Option<(String, String)> {
    let [lat, lon] = world.origin_deg?;
    Some(key_value_pair("origin", format!("latitude {lat:.5}, longitude {lon:.5}")))
}

/// Returns that a scenario is geographic, and how much the shield keeps for the roundness of the earth.
fn surface_text(world: &AirspaceWorld) -> Option<(String, String)> {
    if world.surface == Surface::Plane {
        return None;
    }
    let margin = if world.shield {
        format!("; the shield keeps {:.1} m more for its roundness", 2.0 * world.curvature_m)
    } else {
        String::new()
    };
    Some(key_value_pair(
        "earth",
        format!("WGS84 ellipsoid, each pair in a plane of its own{margin}"),
    ))
}

/// Returns the first areas, and the number of others.
fn areas_text(world: &AirspaceWorld) -> Option<(String, String)> {
    let numbered: Vec<(usize, &Arc<Area>)> = world.areas.iter().enumerate().collect();
    let names = first_names(&numbered, |(number, area)| {
        let kind = match area.kind {
            AreaKind::Out => "out of",
            AreaKind::In => "inside of",
        };
        let moves = if area.is_moving() { ", which moves" } else { "" };
        format!("{kind} {}{moves}", area.display_name(*number))
    })?;
    Some(key_value_pair("areas", format!("stay {names}")))
}

/// Returns the separations, speeds and turn rates of the airplanes, and how they decide.
fn abilities_text(world: &AirspaceWorld) -> KeyValues {
    let models = || world.airplanes.iter().map(|airplane| &airplane.model);
    let height_m = world.vertical_m.round();
    let method = world.method.name();
    let deployment = world.deployment.name();
    let shield = if world.shield { "on" } else { "off" };
    vec![
        key_value_pair(
            "separation",
            format!(
                "{} m, or {height_m} m of height",
                range_text(models().map(|m| m.separation_m))
            ),
        ),
        key_value_pair("speed", format!("{} m/s", range_text(models().map(|m| m.v_m_s)))),
        key_value_pair(
            "turn rate",
            format!("{} deg/s", range_text(models().map(|m| m.omega_max_rad_s.to_degrees()))),
        ),
        key_value_pair("method", format!("{method}, {deployment}, shield {shield}")),
    ]
    .into_iter()
    .chain(types_text(world))
    .chain(rule_changes_text(world))
    .collect()
}

/// Returns the types of the airplanes, with their numbers.
fn types_text(world: &AirspaceWorld) -> Option<(String, String)> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for airplane in &*world.airplanes {
        if let Some(name) = &airplane.performance.type_name {
            *counts.entry(name).or_default() += 1;
        }
    }
    let counts: Vec<(&str, usize)> = counts.into_iter().collect();
    let names = first_names(&counts, |(name, count)| format!("{count} {name}"))?;
    Some(key_value_pair("types", names))
}

/// Returns the first changes of rules, and the number of others.
fn rule_changes_text(world: &AirspaceWorld) -> Option<(String, String)> {
    let names = first_names(&world.later_rules, |(from, rules)| {
        let shield = if rules.shield { "on" } else { "off" };
        let at_s = world.cycle_start_s(*from);
        format!("{}, shield {shield} at {at_s} s", rules.method.name())
    })?;
    Some(key_value_pair("rules change", names))
}

/// Returns a number that all have, or the smallest and the largest, to a tenth.
fn range_text(numbers: impl Iterator<Item = f64>) -> String {
    let mut min = f64::INFINITY;
    let mut max: f64 = 0.0;
    for number in numbers {
        min = min.min(number);
        max = max.max(number);
    }
    let min = round_to_tenth(min).to_string();
    let max = round_to_tenth(max).to_string();
    if min == max { min } else { format!("{min} to {max}") }
}

fn round_to_tenth(number: f64) -> f64 {
    (number * 10.0).round() / 10.0
}

/// Returns the outcome of a run; parts of which there is nothing to say have no line.
pub(super) fn outcome(metrics: &Metrics) -> KeyValues {
    let mut lines = flight_metrics_text(metrics);
    lines.extend(area_entries_text(metrics));
    lines.extend(not_appeared_warning(metrics));
    lines.extend(network(metrics));
    lines.extend(surveillance_text(metrics));
    lines.extend(orders_and_tracks_text(metrics));
    lines.extend(unprotected_pairs_warning(&metrics.too_close));
    lines.extend(exempt_areas_warning(&metrics.exempt_areas));
    lines.extend(beyond_bound_warning(&metrics.beyond_bound));
    lines
}

/// Returns the pose of every airplane, by entity id.
pub(super) fn poses(surface: Surface, snapshot: &Snapshot) -> JsonTextReport {
    let json = serde_json::to_value(&snapshot.airplanes).unwrap_or_default();
    if surface == Surface::Earth {
        return poses_on_earth(json, snapshot);
    }
    let mut text = "  airplane       x_m         y_m    heading_deg\n".to_string();
    for (id, airplane) in snapshot.airplanes.iter().enumerate() {
        let [x, y] = airplane.pose.at;
        let heading_deg = airplane.pose.heading_rad.to_degrees();
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {id:<8} {x:>10.1}  {y:>10.1}  {heading_deg:>13.1}");
    }
    JsonTextReport { json, text }
}

/// Returns the same with latitudes and longitudes.
fn poses_on_earth(mut json: Value, snapshot: &Snapshot) -> JsonTextReport {
    let mut text = "  airplane     latitude     longitude    heading_deg\n".to_string();
    for (id, airplane) in snapshot.airplanes.iter().enumerate() {
        let [longitude_deg, latitude_deg] = airplane.pose.at.map(f64::to_degrees);
        let heading_deg = airplane.pose.heading_rad.to_degrees();
        json[id]["latitude_deg"] = latitude_deg.into();
        json[id]["longitude_deg"] = longitude_deg.into();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "  {id:<8} {latitude_deg:>12.6}  {longitude_deg:>12.6}  {heading_deg:>13.1}"
        );
    }
    JsonTextReport { json, text }
}

/// Returns the first pairs with first fallbacks that are not apart, and the number of others.
fn too_close_warning(world: &AirspaceWorld, pairs: &[(u32, u32)]) -> Option<(String, String)> {
    let names = first_names(pairs, |&(a, b)| {
        format!("{} and {}", world.display_name(a), world.display_name(b))
    })?;
    Some(key_value_pair("warning", format!("start too close for the shield: {names}")))
}

/// Returns the traffic on the network, and its faults.
fn network(m: &Metrics) -> KeyValues {
    let mut lines = KeyValues::new();
    if m.beacons > 0 {
        let sent =
            format!("{}, {} bytes", group_thousands(m.beacons), group_thousands(m.beacon_bytes));
        lines.push(key_value_pair("beacons", sent));
    }
    if m.messages > 0 {
        let sent = format!("{}, {} bytes", group_thousands(m.messages), group_thousands(m.bytes));
        let took = m.network_s.map_or(String::new(), |s| format!(", {s:.1} s on the network"));
        lines.push(key_value_pair("messages", sent + &took));
    }
    let counts = [
        (m.budget_deferred, "messages deferred by the radio's budget"),
        (m.budget_dropped, "messages dropped by the radio's budget"),
        (m.contacts_lost, "contacts lost"),
        (m.deadlines_missed, "agents out of time"),
        (m.shield_held_back, "plans held back"),
        (m.groups_too_large, "groups too large to optimize"),
    ];
    let faults: Vec<String> = counts
        .iter()
        .filter(|(n, _)| *n > 0)
        .map(|(n, what)| format!("{} {what}", group_thousands(*n)))
        .collect();
    if !faults.is_empty() {
        lines.push(key_value_pair("trouble", faults.join(", ")));
    }
    lines
}

/// Returns the line on tracks; none where all see all.
fn surveillance_text(m: &Metrics) -> Option<(String, String)> {
    let share_percent = round_to_tenth(100.0 * m.track_availability?);
    let mut words = format!("a track in {share_percent} % of the observations");
    if let Some(age_s) = m.mean_track_age_s {
        words += &format!(", {age_s:.2} s old");
    }
    let drops = m.tracks_dropped.unwrap_or(0);
    if drops > 0 {
        words += &format!(", dropped {} times", group_thousands(drops));
    }
    Some(key_value_pair("surveillance", words))
}

/// Returns the warning that a run was too short for some airplanes to be seen at all: they count among those
/// that have not arrived.
fn not_appeared_warning(m: &Metrics) -> Option<(String, String)> {
    let many = match m.not_appeared {
        0 => return None,
        1 => "1 airplane has".into(),
        n => format!("{} airplanes have", group_thousands(n)),
    };
    Some(key_value_pair(
        "WARNING",
        format!("{many} not appeared by now: more cycles would show them"),
    ))
}

/// Returns lines on recorded tracks, orders and removals; none where there were none.
fn orders_and_tracks_text(m: &Metrics) -> KeyValues {
    let mut lines = Vec::new();
    if m.replayed > 0 {
        lines.push(key_value_pair(
            "replayed",
            format!("{} to the end of their tracks", group_thousands(m.replayed)),
        ));
    }
    if m.left > 0 {
        lines.push(key_value_pair(
            "left",
            format!("{} before they had arrived", group_thousands(m.left)),
        ));
    }
    if m.orders + m.orders_delayed > 0 {
        let done = group_thousands(m.orders);
        let waits = group_thousands(m.orders_delayed);
        let mut words = format!("{done} carried out, delayed {waits} times by one dt");
        if m.shield_level_offs > 0 {
            let level_offs = group_thousands(m.shield_level_offs);
            words += &format!(", and {level_offs} times held on the way to a level");
        }
        lines.push(key_value_pair("orders", words));
    }
    lines.extend(dangerous_holds_warning(m));
    lines
}

/// Returns the warning of holds below the safe altitude, and of flights longer than the fuel; none where there were none.
fn dangerous_holds_warning(m: &Metrics) -> Option<(String, String)> {
    let counts = [
        (m.low_holds, "holds below the safe altitude"),
        (m.endurance_exceedances, "airplanes in the air for longer than their endurance"),
    ];
    let words: Vec<String> = counts
        .into_iter()
        .filter_map(|(count, what)| Some((count.filter(|count| *count > 0)?, what)))
        .map(|(count, what)| format!("{} {what}", group_thousands(count)))
        .collect();
    (!words.is_empty()).then(|| key_value_pair("WARNING", words.join(", ")))
}

/// Largest number of pairs or airplanes that a warning lists.
const MAX_NAMES: usize = 5;

/// Returns the first of many in words, and the number of others; `None` without any.
fn first_names<T>(all: &[T], words: impl Fn(&T) -> String) -> Option<String> {
    let mut names: Vec<String> = all.iter().take(MAX_NAMES).map(words).collect();
    if all.len() > MAX_NAMES {
        names.push(format!("and {} more", group_thousands((all.len() - MAX_NAMES) as u64)));
    }
    (!names.is_empty()).then(|| names.join(", "))
}

/// Returns the first airplanes with errors beyond the shield's bounds, and the number of others.
fn beyond_bound_warning(all: &[ErrorBoundViolation]) -> Option<(String, String)> {
    let names = first_names(all, |one| {
        let name = one.callsign.clone().unwrap_or_else(|| one.airplane.to_string());
        format!("{name} at {} s", one.at_s)
    })?;
    Some(key_value_pair("WARNING", format!("errors beyond the bound: {names}")))
}

/// Returns the first airplanes that the shield does not keep clear of an area, and the number of others.
fn exempt_areas_warning(all: &[AreaExemption]) -> Option<(String, String)> {
    let names = first_names(all, |AreaExemption { at_s, airplane, callsign, area }| {
        let name = callsign.clone().unwrap_or_else(|| airplane.to_string());
        let since = if *at_s > 0.0 { format!(" at {at_s} s") } else { String::new() };
        format!("{name} of {area}{since}")
    })?;
    Some(key_value_pair("WARNING", format!("not kept clear by the shield: {names}")))
}

/// Returns how often airplanes came to where areas do not permit them to be; none without areas.
fn area_entries_text(m: &Metrics) -> Option<(String, String)> {
    let words = match m.area_entries? {
        0 => "none entered".into(),
        entries => {
            let reported = group_thousands(m.area_entries_reported.unwrap_or(0));
            let seconds = m.area_s.unwrap_or(0.0);
            format!(
                "entered {} times ({reported} reported), {seconds:.1} s in all",
                group_thousands(entries)
            )
        }
    };
    Some(key_value_pair("areas", words))
}

/// Returns the first pairs whose separation the shield does not guarantee, and the number of others.
fn unprotected_pairs_warning(too_close: &[UnprotectedPair]) -> Option<(String, String)> {
    let names = first_names(too_close, |UnprotectedPair { at_s, airplanes, callsigns }| {
        let [a, b] = callsigns.clone().unwrap_or_else(|| airplanes.map(|id| id.to_string()));
        if *at_s > 0.0 { format!("{a} and {b} at {at_s} s") } else { format!("{a} and {b}") }
    })?;
    Some(key_value_pair("WARNING", format!("too close for the shield: {names}")))
}

fn flight_metrics_text(m: &Metrics) -> KeyValues {
    let nearest = m.min_separation_m.map_or("none came near".into(), |d| format!("{d:.1} m"));
    let lost = match m.losses_of_separation {
        0 => "none".into(),
        n => {
            let lost = format!("{}, {:.1} s in all", group_thousands(n), m.lost_s);
            lost + &phases_text(m) + &reported_text(m)
        }
    };
    let delay = m.mean_delay_percent.map_or("-".into(), |d| {
        format!("{d:.1} % on average{}{}", phase_delays_text(m), in_flight_text(m.in_flight))
    });
    let rounds = m.rounds_mean.map_or(String::new(), |r| format!(", {r:.1} rounds each"));
    let minima = minima_text(m);
    let mut lines = vec![
        key_value_pair(
            "arrived",
            format!("{} of {}", group_thousands(m.arrived), group_thousands(m.airplanes)),
        ),
        key_value_pair("nearest approach", nearest),
        key_value_pair("losses of separation", lost),
    ];
    lines.extend(conflicts_text(m));
    lines.push(key_value_pair("delay", delay));
    lines.extend(maneuvers_text(m));
    lines.extend([
        key_value_pair(
            "optimizations",
            format!("{}{rounds}{minima}", group_thousands(m.optimizations)),
        ),
        key_value_pair(
            "shield",
            format!(
                "{} decisions changed, {} of them to fallbacks",
                group_thousands(m.shield_overrides),
                group_thousands(m.shield_orbits)
            ),
        ),
    ]);
    lines
}

/// Returns how many conflicts there were, and how they ended; `None` where they are not counted.
fn conflicts_text(m: &Metrics) -> Option<(String, String)> {
    let mut text = group_thousands(m.conflicts?);
    if let Some(rate) = m.intrusion_prevention_rate {
        text += &format!(", {:.1} % without a loss", 100.0 * rate);
    }
    let counts = [
        (m.well_clear_violations, "violations of well clear"),
        (m.nmacs, "near mid-air collisions"),
    ];
    for (count, what) in counts {
        if let Some(count) = count.filter(|count| *count > 0) {
            text += &format!(", {} {what}", group_thousands(count));
        }
    }
    Some(key_value_pair("conflicts", text))
}

/// Returns how often airplanes left their flight plans, and how much farther they flew; `None` where that is not
/// measured, or nothing was flown.
fn maneuvers_text(m: &Metrics) -> Option<(String, String)> {
    let mut text = format!("{:.1} per flight hour", m.maneuvers_per_flight_hour?);
    if let Some(percent) = m.mean_extra_distance_percent {
        text += &format!(", {percent:.1} % farther than alone");
    }
    Some(key_value_pair("maneuvers", text))
}

/// Returns how many optimizations have found a minimum, as far as that is known.
fn minima_text(m: &Metrics) -> String {
    match (m.known_minima, m.proved_minima) {
        (0, 0) => String::new(),
        (0, proved) => format!(", {} of them proved to be a minimum", group_thousands(proved)),
        (known, _) => {
            let reached = group_thousands(m.reached_minima);
            format!(", {reached} of {} known minima reached", group_thousands(known))
        }
    }
}

/// Returns how many losses are in which phase of recorded flights, if any are known.
fn phases_text(m: &Metrics) -> String {
    let phases = [
        (m.losses_in_climb, "climb"),
        (m.losses_in_descent, "descent"),
        (m.losses_in_cruise, "cruise"),
    ];
    let known = phases.iter().filter_map(|(losses, phase)| {
        let losses = losses.filter(|losses| *losses > 0)?;
        Some(format!("{} in {phase}", group_thousands(losses)))
    });
    in_parentheses(&known.collect::<Vec<_>>())
}

/// Returns the mean delays of recorded flights in which phase, where there are several.
fn phase_delays_text(m: &Metrics) -> String {
    let phases = [
        (m.climb_delay_percent, "climb"),
        (m.descent_delay_percent, "descent"),
        (m.cruise_delay_percent, "cruise"),
    ];
    let known: Vec<String> = phases
        .iter()
        .filter_map(|(delay, phase)| delay.map(|percent| format!("{percent:.1} % in {phase}")))
        .collect();
    // Of one phase it is the mean of all.
    if known.len() > 1 { in_parentheses(&known) } else { String::new() }
}

fn in_parentheses(words: &[String]) -> String {
    if words.is_empty() { String::new() } else { format!(" ({})", words.join(", ")) }
}

/// Returns how many losses are of pairs that the shield reported, if there are any.
fn reported_text(m: &Metrics) -> String {
    match m.losses_of_reported_pairs {
        0 => String::new(),
        n => format!(", {} of pairs that the shield reported", group_thousands(n)),
    }
}

/// Returns how many flights a mean leaves out because they have not ended, if there are any.
fn in_flight_text(in_flight: u64) -> String {
    match in_flight {
        0 => String::new(),
        n => format!(", without {} still in the air", group_thousands(n)),
    }
}

#[cfg(test)]
mod tests {
    use super::describe_scenario;
    use crate::airspace_run;
    use crate::scenario::CompiledAirspace;
    use sidestep_kernel::{Simulation, WorldMetrics};
    use sidestep_scenario::Source;

    /// Many airplanes close together.
    fn heap(airspace: &str) -> Source {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\nmethod = \"none\"\n{airspace}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 40\nradius_m = 2000\n"
        );
        Source::new("heap", text, "")
    }

    #[test]
    fn check_names_the_first_pairs_without_a_promise_and_counts_the_others() {
        let compiled = CompiledAirspace::new(&heap("")).expect("a scenario");
        let pairs = compiled.too_close.len();
        assert!(pairs > 50, "{pairs}");
        let contents_text = describe_scenario(&compiled).text;
        let words = contents_text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(words.matches("too close for the shield").count(), 1, "{contents_text}");
        assert!(words.contains(&format!(", and {} more", pairs - 5)), "{contents_text}");
    }

    #[test]
    fn nothing_is_too_close_for_a_shield_that_is_not_there() {
        let source = heap("shield = \"off\"");
        let compiled = CompiledAirspace::new(&source).expect("a scenario");
        assert_eq!(compiled.too_close, []);
        assert!(!describe_scenario(&compiled).text.contains("too close"));
        let mut run = compiled.start(&source, 1);
        run.advance(3);
        assert_eq!(run.metrics().too_close, []);
        let lines = run.world().summary_lines(&run.metrics());
        assert!(lines.iter().all(|(_, words)| !words.contains("too close")), "{lines:?}");
    }

    #[test]
    fn a_run_that_ends_before_an_airplane_appears_says_so() {
        let one = |y: u32, appears_s: u32| {
            format!(
                "[[airplanes]]\nat_m = [0, {y}]\nheading_deg = 0\nway_points_m = [[700, {y}]]\n\
                 appears_s = {appears_s}\n"
            )
        };
        let head = "format = 1\nworld = \"airspace\"\ncycles = 20\n";
        let text = format!("{head}{}{}", one(0, 0), one(9000, 50));
        let mut run = airspace_run(&Source::new("n", text, ""), 1).expect("a scenario");
        let says_not_appeared = |run: &crate::AirspaceRun| {
            let lines = run.world().summary_lines(&run.metrics());
            lines.into_iter().any(|(_, words)| words.contains("1 airplane has not appeared"))
        };
        assert_eq!(run.metrics().not_appeared, 1, "the other one is there from the start");
        run.advance(10);
        assert_eq!(run.metrics().not_appeared, 1, "it enters with the next cycle");
        assert!(says_not_appeared(&run));
        run.advance(1);
        assert!(!says_not_appeared(&run) && run.metrics().not_appeared == 0);
    }
}
