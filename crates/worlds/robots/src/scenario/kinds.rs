//! The kinds of a scenario: the observation that each designates, and the kinds that a sensor can meet.

use super::located_section::LocatedSection;
use super::{RobotsFile, SensorSection};
use sidestep_kernel::InputError;
use sidestep_scenario::{Source, Spanned, suggestion};
use std::ops::Range;
use std::sync::Arc;

/// Names by number: those that are built in, before the scenario's own.
pub(super) const BUILT_IN: [&str; 5] = ["free", "wall", "door", "person", "robot"];
const WALL: usize = 1;

/// All kinds, by number.
pub(super) struct Kinds {
    source: Arc<Source>,
    all: Vec<Kind>,
}

#[derive(Debug, Default)]
struct Kind {
    name: String,
    observation: String,
    /// Whether the scenario itself says which observation it designates, and where it names the kind.
    is_mapped: bool,
    span: Option<Range<usize>>,
    is_met: bool,
}

/// A section of bodies of one kind.
struct BodySection<'f> {
    kind: &'f Spanned<String>,
    span: Range<usize>,
    are_there: bool,
}

impl Kinds {
    /// Gathers the kinds of a scenario.
    ///
    /// # Errors
    /// When a section names a kind that does not exist, or no section names an own kind.
    pub(super) fn new(source: &Arc<Source>, file: &RobotsFile) -> Result<Self, InputError> {
        let named =
            |name: &str| Kind { name: name.into(), observation: name.into(), ..Kind::default() };
        let mut kinds =
            Self { source: Arc::clone(source), all: BUILT_IN.into_iter().map(named).collect() };
        kinds.all[WALL].is_met = true;
        for (name, section) in &file.kinds {
            let k = kinds.own_index(name)?;
            let kind = &mut kinds.all[k];
            kind.span = Some(name.span());
            if let Some(observation) = &section.observation {
                kind.is_mapped = true;
                kind.observation.clone_from(observation.get_ref());
                kind.span = Some(observation.span());
            }
        }
        kinds.record_used(file)?;
        Ok(kinds)
    }

    /// Returns the number of a kind with a section of its own, which may be new.
    fn own_index(&mut self, name: &Spanned<String>) -> Result<usize, InputError> {
        let error = |cause: &str, remedy: &str| Err(self.source.error(name.span(), cause, remedy));
        if name.get_ref() == BUILT_IN[0] {
            return error("`free` is no kind", "choose another name for the kind");
        }
        if let Some(k) = self.all.iter().position(|kind| kind.name == *name.get_ref()) {
            return Ok(k);
        }
        if self.all.len() == 127 {
            return error("more than 122 kinds of your own", "give several kinds one name");
        }
        let (name, observation) = (name.get_ref().clone(), name.get_ref().clone());
        self.all.push(Kind { name, observation, ..Kind::default() });
        Ok(self.all.len() - 1)
    }

    /// Notes the kinds that occur, and refuses own kinds that no section names.
    fn record_used(&mut self, file: &RobotsFile) -> Result<(), InputError> {
        let mut is_named = vec![false; self.all.len()];
        for bodies in body_sections(file) {
            let k = usize::from(self.number(bodies.kind)?);
            is_named[k] = true;
            let kind = &mut self.all[k];
            kind.is_met |= bodies.are_there;
            kind.span.get_or_insert(bodies.span);
        }
        let idle = (BUILT_IN.len()..self.all.len()).find(|k| !is_named[*k]);
        idle.map_or(Ok(()), |k| {
            let Kind { name, span, .. } = &self.all[k];
            let cause = format!("no body is of the kind `{name}`");
            let remedy = format!("{}; or name it by `kind`", suggestion(name, &BUILT_IN[WALL..]));
            Err(self.source.error(span.clone(), cause, remedy))
        })
    }

    /// Returns the number of a kind.
    ///
    /// # Errors
    /// When there is no such kind.
    pub(super) fn number(&self, name: &Spanned<String>) -> Result<u8, InputError> {
        let mut others = self.all.iter().skip(WALL);
        if let Some(k) = others.position(|kind| kind.name == *name.get_ref()) {
            return Ok((k + WALL) as u8);
        }
        let known: Vec<&str> = self.all.iter().skip(WALL).map(|kind| kind.name.as_str()).collect();
        let cause = format!("unknown kind `{}`", name.get_ref());
        let remedy = suggestion(name.get_ref(), &known) + "; new kinds are made by [kinds.NAME]";
        Err(self.source.error(name.span(), cause, remedy))
    }

    /// Returns the names by number.
    pub(super) fn names(&self) -> Vec<String> {
        self.all.iter().map(|kind| kind.name.clone()).collect()
    }

    /// Returns a sensor's true observation of each kind. Only kinds that the sensor can meet must
    /// be among its observations; `is_mounted` says whether it meets any.
    ///
    /// # Errors
    /// When it can meet a kind that it does not know.
    pub(super) fn designations(
        &self,
        sensor: &str,
        at: &LocatedSection<SensorSection>,
        is_mounted: bool,
    ) -> Result<Vec<u8>, InputError> {
        let section = at.section.get_ref();
        let observations = section.observations.get_ref();
        let index = |kind: &Kind| {
            let own = section.designates.iter().find(|(name, _)| *name.get_ref() == kind.name);
            let observation = own.map_or(&kind.observation, |(_, o)| o.get_ref());
            observations.iter().position(|o| o == observation)
        };
        let designated = |kind: &Kind| match index(kind) {
            Some(index) => Ok(index as u8),
            None if kind.is_met && is_mounted => {
                Err(self.no_observation_for_kind(sensor, at, kind))
            }
            None => Ok(0),
        };
        let rest = self.all.iter().skip(WALL).map(designated);
        std::iter::once(Ok(0)).chain(rest).collect()
    }

    /// Returns the error for a kind that a sensor meets and does not know, at the key that names
    /// the wrong observation, or where one is missing.
    fn no_observation_for_kind(
        &self,
        sensor: &str,
        at: &LocatedSection<SensorSection>,
        kind: &Kind,
    ) -> InputError {
        let Kind { name, observation, .. } = kind;
        let list = &at.section.get_ref().observations;
        let known: Vec<&str> = list.get_ref().iter().map(String::as_str).collect();
        let cause =
            format!("sensor `{sensor}` has no observation `{observation}` for the kind `{name}`");
        let nearest = suggestion(observation, &known);
        // Presets and profiles serve many scenarios, so they are not the place to change.
        match (&kind.span, self.is_in_scenario(at) && !kind.is_mapped) {
            (Some(span), false) => {
                let remedy = format!(
                    "{nearest}; write [kinds.{name}] with one of them as `observation`: \
                     \"nothing\" where sensors do not see it"
                );
                self.source.error(span.clone(), cause, remedy)
            }
            _ => {
                let remedy = format!(
                    "{nearest}; add it, or say what the sensor takes it for: \
                     designates = {{ {name} = \"nothing\" }} where it does not see it"
                );
                at.error(list.span(), cause, &remedy)
            }
        }
    }

    /// Returns whether a table stands in the scenario itself.
    pub(super) fn is_in_scenario<T>(&self, at: &LocatedSection<T>) -> bool {
        Arc::ptr_eq(&at.source, &self.source)
    }

    /// Checks the kinds that a sensor's own table names.
    ///
    /// # Errors
    /// When there is no such kind.
    pub(super) fn check_designates(
        &self,
        at: &LocatedSection<SensorSection>,
    ) -> Result<(), InputError> {
        let known: Vec<&str> = self.all.iter().skip(WALL).map(|kind| kind.name.as_str()).collect();
        let own = at.section.get_ref().designates.keys();
        let unknown = own.into_iter().find(|kind| !known.contains(&kind.get_ref().as_str()));
        unknown.map_or(Ok(()), |kind| {
            let cause = format!("unknown kind `{}`", kind.get_ref());
            Err(at.error(kind.span(), cause, &suggestion(kind.get_ref(), &known)))
        })
    }
}

/// Returns the kinds of all sections of bodies.
fn body_sections(file: &RobotsFile) -> impl Iterator<Item = BodySection<'_>> {
    let some = |count: &Option<Spanned<u32>>| count.as_ref().is_none_or(|n| *n.get_ref() > 0);
    let robots = file.robots.0.iter().map(move |s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: some(&s.get_ref().count),
    });
    let people = file.people.0.iter().map(move |s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: some(&s.get_ref().count),
    });
    let doors = file.doors.0.iter().map(|s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: true,
    });
    robots.chain(people).chain(doors)
}
