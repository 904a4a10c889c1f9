//! The kinds of a scenario: the observation that each designates, and the kinds that a sensor can meet.

use super::located_section::LocatedSection;
use super::{RobotsFile, SensorSection};
use sidestep_kernel::InputError;
use sidestep_scenario::{Source, Spanned, suggestion};
use std::ops::Range;
use std::sync::Arc;

/// Names by number: those that are built in, before the scenario's own.
pub(super) const BUILT_IN: [&str; 5] = ["free", "wall", "door", "person", "robot"];
/// Number of the kind `wall`, the first that a body or a beam can meet.
const WALL: usize = 1;
/// Largest number of kinds, because a contact keeps its kind in seven bits.
const MAX_KINDS: usize = 127;

/// The kinds by number, with what the sections of the scenario say of them.
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

impl Kind {
    /// Returns a kind that designates the observation of the same name.
    fn new(name: &str) -> Self {
        Self { name: name.into(), observation: name.into(), ..Self::default() }
    }
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
        let all = BUILT_IN.into_iter().map(Kind::new).collect();
        let mut kinds = Self { source: Arc::clone(source), all };
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
        if name.get_ref() == BUILT_IN[0] {
            let remedy = "choose another name for the kind";
            return Err(self.source.error(name.span(), "`free` is no kind", remedy));
        }
        if let Some(k) = self.all.iter().position(|kind| kind.name == *name.get_ref()) {
            return Ok(k);
        }
        if self.all.len() == MAX_KINDS {
            let cause = "more than 122 kinds of your own";
            return Err(self.source.error(name.span(), cause, "give several kinds one name"));
        }
        self.all.push(Kind::new(name.get_ref()));
        Ok(self.all.len() - 1)
    }

    /// Records the kinds that occur, and refuses own kinds that no section names.
    fn record_used(&mut self, file: &RobotsFile) -> Result<(), InputError> {
        let mut is_named = vec![false; self.all.len()];
        for bodies in body_sections(file) {
            let k = usize::from(self.number(bodies.kind)?);
            is_named[k] = true;
            let kind = &mut self.all[k];
            kind.is_met |= bodies.are_there;
            kind.span.get_or_insert(bodies.span);
        }
        let unused = (BUILT_IN.len()..self.all.len()).find(|k| !is_named[*k]);
        let Some(unused) = unused else { return Ok(()) };
        let Kind { name, span, .. } = &self.all[unused];
        let cause = format!("no body is of the kind `{name}`");
        let remedy = format!("{}; or name it by `kind`", suggestion(name, &BUILT_IN[WALL..]));
        Err(self.source.error(span.clone(), cause, remedy))
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

    /// By number, as the world keeps them.
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
        // `free` designates `nothing`, which is observation 0.
        let mut designated = vec![0];
        for kind in self.all.iter().skip(WALL) {
            match observation_index(at.section.get_ref(), kind) {
                Some(index) => designated.push(index as u8),
                None if kind.is_met && is_mounted => {
                    return Err(self.no_observation_for_kind(sensor, at, kind));
                }
                None => designated.push(0),
            }
        }
        Ok(designated)
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

/// Returns the index of the observation that a kind has for a sensor: by the sensor's own table, else by the
/// kind.
fn observation_index(sensor: &SensorSection, kind: &Kind) -> Option<usize> {
    let own = sensor.designates.iter().find(|(name, _)| *name.get_ref() == kind.name);
    let observation = own.map_or(&kind.observation, |(_, observation)| observation.get_ref());
    sensor.observations.get_ref().iter().position(|name| name == observation)
}

/// Returns whether a section with this count has bodies; without a count it lists places.
fn has_bodies(count: Option<&Spanned<u32>>) -> bool {
    count.is_none_or(|count| *count.get_ref() > 0)
}

/// Sections with a count of 0 are not there: no sensor meets their kind.
fn body_sections(file: &RobotsFile) -> impl Iterator<Item = BodySection<'_>> {
    let robots = file.robots.0.iter().map(|s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: has_bodies(s.get_ref().count.as_ref()),
    });
    let people = file.people.0.iter().map(|s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: has_bodies(s.get_ref().count.as_ref()),
    });
    let doors = file.doors.0.iter().map(|s| BodySection {
        kind: &s.get_ref().kind,
        span: s.span(),
        are_there: true,
    });
    robots.chain(people).chain(doors)
}
