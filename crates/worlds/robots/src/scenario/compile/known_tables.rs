//! The sensors and effectors that a scenario may name: the presets, those of its profiles, its own.

use super::*;

/// A table of a profile that a later one of the same name replaces.
pub(super) struct Shadowed {
    /// Number of the profile among those of the scenario.
    pub(super) profile: usize,
    /// `sensor` or `effector`.
    pub(super) what: &'static str,
    pub(super) name: String,
    /// The text that has the later one.
    pub(super) by: String,
}

/// The sensors and effectors that a scenario may name.
#[derive(Default)]
pub(super) struct KnownTables {
    pub(super) sensors: Sensors,
    pub(super) effectors: Effectors,
    pub(super) shadowed: Vec<Shadowed>,
}

/// Name of the presets in errors.
pub(super) const PRESETS: &str = "presets";

/// Returns the sensors and effectors that a scenario may name: ours, those of its profiles, its own.
pub(super) fn known_tables(
    source: &Arc<Source>,
    file: &RobotsFile,
) -> Result<KnownTables, InputError> {
    let mut known = KnownTables::default();
    // Later ones replace earlier ones of the same name, so the scenario's own come last.
    let presets = Source::new(PRESETS, include_str!("../../presets.toml"), "");
    known.add_profile(Arc::new(presets))?;
    let mut profiles: Vec<String> = Vec::new();
    for named in &file.profiles {
        let profile = Source::read(&source.path(named.get_ref()), &[]);
        let before = known.places();
        let added = profile.and_then(|profile| {
            profiles.push(profile.place.clone());
            known.add_profile(Arc::new(profile))
        });
        added.map_err(|error| source.with_key_at(named.span(), error))?;
        known.note_shadowed(&before, &profiles);
    }
    let before = known.places();
    add_all(source, &file.sensors, &mut known.sensors);
    add_all(source, &file.effectors, &mut known.effectors);
    known.note_shadowed(&before, &profiles);
    Ok(known)
}

/// The text that has a table, by what it is and its name.
type TablePlaces = BTreeMap<(&'static str, String), String>;

impl KnownTables {
    fn add_profile(&mut self, source: Arc<Source>) -> Result<(), InputError> {
        let file: ProfileFile = source.parse()?;
        if *file.format.get_ref() != sidestep_scenario::FORMAT {
            let cause = format!("profile format {} is not known", file.format.get_ref());
            let remedy = "learn the profile again, or write `format = 1`";
            return Err(source.error(file.format.span(), cause, remedy));
        }
        add_all(&source, &file.sensors, &mut self.sensors);
        add_all(&source, &file.effectors, &mut self.effectors);
        Ok(())
    }

    fn places(&self) -> TablePlaces {
        let sensors = self
            .sensors
            .iter()
            .map(|(name, at)| (("sensor", name.clone()), at.source.place.clone()));
        let effectors = self.effectors.iter();
        let effectors =
            effectors.map(|(name, at)| (("effector", name.clone()), at.source.place.clone()));
        sensors.chain(effectors).collect()
    }

    /// Notes the tables of profiles that were replaced since `before`.
    fn note_shadowed(&mut self, before: &TablePlaces, profiles: &[String]) {
        for ((what, name), by) in self.places() {
            let Some(place) = before.get(&(what, name.clone())).filter(|place| **place != by)
            else {
                continue;
            };
            if let Some(profile) = profiles.iter().position(|known| known == place) {
                self.shadowed.push(Shadowed { profile, what, name, by });
            }
        }
    }
}

fn add_all<T: Clone>(
    source: &Arc<Source>,
    from: &BTreeMap<String, Spanned<T>>,
    into: &mut BTreeMap<String, LocatedSection<T>>,
) {
    for (name, section) in from {
        let located = LocatedSection { section: section.clone(), source: Arc::clone(source) };
        into.insert(name.clone(), located);
    }
}
