//! Rules that change on the way: another method, other separations, another wind from a time on.
//!
//! The shield can be switched off, but not on: its promise needs fallbacks from the start. Where it flies on under
//! other rules, each pair has to be apart anew, as if all had just come in.

use super::compile::Compiler;
use super::optimizer::{MvpSection, OnOffSwitch};
use super::winds::WindLayerSection;
use crate::flight::segments_after_orders;
use crate::settings::{BuiltInMethod, Deployment, LevelGap, RightOfWayRule, SeparationM};
use crate::world::AirspaceWorld;
use schemars::JsonSchema;
use serde::Deserialize;
use sidestep_kernel::geometry::norm;
use sidestep_kernel::{Cycle, InputError};
use sidestep_scenario::{Closed, Number, Point, Spanned};
use std::sync::Arc;

/// Largest number of changes: each is a world of its own.
const MAX_CHANGES: usize = 1000;

/// Rules that hold from a time on; those that are left out stay.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub(super) struct RuleChangeSection {
    /// Time from which they hold.
    at_s: Option<Number<Closed<0, 1_000_000_000>>>,
    /// Airplanes, by number, for which separation_m or non_cooperative holds; all if left out.
    airplanes: Option<Vec<usize>>,
    method: Option<BuiltInMethod>,
    /// Only "off": the shield cannot be switched on.
    shield: Option<OnOffSwitch>,
    mvp: Option<MvpSection>,
    /// The rule by which airplanes of one priority give way to each other.
    right_of_way: Option<RightOfWayRule>,
    /// Distance that the airplanes keep; without airplanes, those that have none of their own.
    separation_m: Option<SeparationM>,
    vertical_m: Option<Number<LevelGap>>,
    /// A wind that is the same everywhere.
    wind_m_s: Option<Point<2>>,
    /// Winds by altitude.
    winds: Vec<Spanned<WindLayerSection>>,
    /// Whether the airplanes avoid nobody.
    non_cooperative: Option<bool>,
}

impl RuleChangeSection {
    pub(super) fn method(&self) -> Option<BuiltInMethod> {
        self.method
    }

    pub(super) fn mvp(&self) -> Option<&MvpSection> {
        self.mvp.as_ref()
    }

    fn is_for_all(&self) -> bool {
        self.method.is_some()
            || self.shield.is_some()
            || self.mvp.is_some()
            || self.right_of_way.is_some()
            || self.vertical_m.is_some()
            || self.wind_m_s.is_some()
            || !self.winds.is_empty()
    }

    fn is_for_airplanes(&self) -> bool {
        self.separation_m.is_some() || self.non_cooperative.is_some()
    }
}

impl Compiler<'_> {
    /// Returns the methods that the scenario changes to.
    pub(super) fn methods_of_changes(&self) -> impl Iterator<Item = BuiltInMethod> {
        self.file.airspace.changes.iter().filter_map(|change| change.get_ref().method)
    }

    /// Returns the world under the rules that hold from later cycles on, by rising cycle.
    pub(super) fn later_rules(
        &self,
        start: &AirspaceWorld,
    ) -> Result<Vec<(Cycle, AirspaceWorld)>, InputError> {
        let changes = &self.file.airspace.changes;
        let Some(first) = changes.first() else { return Ok(Vec::new()) };
        let error =
            |cause: String, remedy: &str| Err(self.source.error(Some(first.span()), cause, remedy));
        if start.deployment != Deployment::Direct || start.network.is_some() {
            let cause =
                "rules that change, and agents that would have to agree on when".to_string();
            return error(cause, "set deployment = \"direct\" and leave the network out");
        }
        if changes.len() > MAX_CHANGES {
            let cause = format!("{} changes of rules", changes.len());
            return error(cause, &format!("give up to {MAX_CHANGES}"));
        }
        let sections = self.file.airplanes.0.iter();
        let mut has_own: Vec<bool> = vec![false; start.airplanes.len()];
        let generated = start.airplanes.len().saturating_sub(sections.len());
        for (own, section) in has_own[generated..].iter_mut().zip(sections) {
            *own = section.get_ref().separation_m.is_some();
        }
        let mut later: Vec<(Cycle, AirspaceWorld)> = Vec::with_capacity(changes.len());
        let mut last_s = 0.0;
        for change in changes {
            let at_s = change.get_ref().at_s.map_or(0.0, f64::from);
            if at_s < last_s {
                let cause = "the change's time is before the one before";
                let remedy = "sort changes by at_s";
                return Err(self.source.error(Some(change.span()), cause, remedy));
            }
            last_s = at_s;
            let mut world = later.last().map_or(start, |(_, world)| world).clone();
            self.change_rules(&mut world, change, &mut has_own)?;
            world.curvature_m = world.curvature_error_m();
            let from = (at_s / start.timing.dt_s).ceil() as Cycle;
            world.rules_since = from;
            // Of changes in one cycle, the last world has all.
            if later.last().is_some_and(|(earlier, _)| *earlier == from) {
                later.pop();
            }
            later.push((from, world));
        }
        Ok(later)
    }

    /// Changes the rules of a world.
    fn change_rules(
        &self,
        world: &mut AirspaceWorld,
        change: &Spanned<RuleChangeSection>,
        has_own: &mut [bool],
    ) -> Result<(), InputError> {
        let section = change.get_ref();
        let error =
            |cause: &str, remedy: &str| Err(self.source.error(Some(change.span()), cause, remedy));
        if !section.is_for_all() && !section.is_for_airplanes() {
            let remedy = "give method, shield, mvp, right_of_way, separation_m, vertical_m, wind_m_s, winds or non_cooperative";
            return error("a change of nothing", remedy);
        }
        if section.airplanes.is_some() && (section.is_for_all() || !section.is_for_airplanes()) {
            let remedy = "with airplanes give separation_m or non_cooperative alone";
            return error("airplanes beside rules for all", remedy);
        }
        if section.shield.as_ref().is_some_and(|shield| shield.0 && !world.shield) {
            let remedy = "set shield = \"off\" here, or airspace.shield = \"on\" from the start";
            return error("a shield that is switched on", remedy);
        }
        if section.method == Some(BuiltInMethod::External) {
            let remedy = "give pc, orca, mvp, bands or none";
            return error("airplanes that begin to follow orders of a caller", remedy);
        }
        if let Some(method) = section.method {
            world.method = method.into();
        }
        world.shield &= section.shield.as_ref().is_none_or(|shield| shield.0);
        if let Some(mvp) = &section.mvp {
            world.mvp = mvp.or_default(world.mvp);
            world.mvp_resolution = mvp.resolution_or_default(world.mvp_resolution);
        }
        if let Some(right_of_way) = section.right_of_way {
            world.right_of_way = right_of_way;
            world.uses_right_of_way = world.may_have_right_of_way();
        }
        if let Some(vertical_m) = section.vertical_m {
            self.set_vertical_m(world, vertical_m.get());
        }
        if let Some(wind_m_s) = &section.wind_m_s {
            let speed_m_s = norm(wind_m_s.get());
            self.check_wind(speed_m_s, Some(change.span()), &world.airplanes)?;
            world.wind_m_s = wind_m_s.get();
            // From then on it is the same everywhere.
            world.wind_field = None;
        }
        if !section.winds.is_empty() {
            if section.wind_m_s.is_some() {
                let remedy = "give one of wind_m_s and winds";
                return error("a wind that is given in two ways", remedy);
            }
            let field = self.field_of_layers(&section.winds, world.surface)?;
            self.check_field_speed(&field, change.span(), &world.airplanes)?;
            world.wind_m_s = field.middle_m_s;
            world.wind_field = Some(Arc::new(field));
        }
        if section.is_for_airplanes() {
            self.change_airplanes(world, change, has_own)?;
        }
        Ok(())
    }

    /// Changes the separation of airplanes, and whether they avoid others.
    fn change_airplanes(
        &self,
        world: &mut AirspaceWorld,
        change: &Spanned<RuleChangeSection>,
        has_own: &mut [bool],
    ) -> Result<(), InputError> {
        let section = change.get_ref();
        let n = world.airplanes.len();
        let mut airplanes = (*world.airplanes).clone();
        let given = section.airplanes.as_deref();
        let slots: Vec<usize> = given.map_or_else(|| (0..n).collect(), <[usize]>::to_vec);
        for slot in slots {
            let Some(airplane) = airplanes.get_mut(slot) else {
                let cause = format!("airplane {slot} of {n}");
                let remedy = "count airplanes from 0, in the order of the file";
                return Err(self.source.error(Some(change.span()), cause, remedy));
            };
            if let Some(separation_m) = section.separation_m
                && (given.is_some() || !has_own[slot])
            {
                airplane.model.separation_m = separation_m.into();
                has_own[slot] = given.is_some();
            }
            if let Some(is_non_cooperative) = section.non_cooperative {
                airplane.is_non_cooperative = is_non_cooperative;
            }
        }
        world.later = Arc::new(airplanes.iter().map(segments_after_orders).collect());
        world.airplanes = Arc::new(airplanes);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use crate::scenario::CompiledAirspace;
    use sidestep_scenario::Source;

    fn compiled(airspace: &str) -> Result<CompiledAirspace, String> {
        let text = format!(
            "format = 1\nworld = \"airspace\"\n[airspace]\n{airspace}\n\
             [airspace.generator]\nkind = \"superconflict\"\nn = 3\n"
        );
        CompiledAirspace::new(&Source::new("c", text, "")).map_err(|error| error.to_string())
    }

    #[test]
    fn what_cannot_change_on_the_way_is_an_error_with_a_remedy() {
        for (airspace, cause) in [
            ("changes = [{ at_s = 5.0 }]", "a change of nothing"),
            (
                "changes = [{ at_s = 5.0, airplanes = [1], method = \"none\" }]",
                "beside rules for all",
            ),
            ("changes = [{ at_s = 5.0, airplanes = [3], separation_m = 1.0 }]", "airplane 3 of 3"),
            ("changes = [{ at_s = 5.0, method = \"external\" }]", "orders of a caller"),
            ("shield = \"off\"\nchanges = [{ at_s = 5.0, shield = \"on\" }]", "switched on"),
            (
                "changes = [{ at_s = 5.0, method = \"none\" }, { at_s = 4.0, method = \"pc\" }]",
                "before the one before",
            ),
            ("deployment = \"team\"\nchanges = [{ at_s = 5.0, method = \"none\" }]", "agents"),
            ("changes = [{ at_s = 5.0, wind_m_s = [99.0, 0.0] }]", "a wind of 99"),
        ] {
            let error = compiled(airspace).expect_err(airspace);
            assert!(error.contains(cause) && error.contains("help: "), "{airspace}: {error}");
        }
    }

    #[test]
    fn another_seed_flies_under_the_same_changes() {
        let compiled = compiled("method = \"mvp\"\nchanges = [{ at_s = 50.0, method = \"none\" }]")
            .expect("right");
        let other = compiled.reseeded(7).expect("right");
        assert_eq!(other.world.later_rules.len(), 1);
        assert_eq!(other.world.with_rules_of(10).method.name(), "none");
        assert_eq!(other.world.with_rules_of(9).method.name(), "mvp");
    }
}
