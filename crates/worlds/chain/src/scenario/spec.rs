//! The sections that a scenario was compiled from, so that another seed reads no file again.

use super::{ChainScenario, ChainScenarioCompiler, ChainScenarioFile};
use crate::ground::GroundMap;
use crate::own_parts::CustomBehaviors;
use crate::world::ChainWorld;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::{InputError, Seed};
use sidestep_scenario::{Head, Remark, Source};
use std::sync::Arc;

/// The sections of a scenario, and the ground that they name.
#[derive(Debug)]
pub(crate) struct ScenarioSpec<const D: usize> {
    source: Source,
    head: Head,
    file: ChainScenarioFile<D>,
    site: Option<GroundMap>,
    /// What its author has to know of the file of the ground.
    pub(crate) ground_remarks: Vec<Remark>,
    /// Drivers and reactions beside the built-in ones.
    own: CustomBehaviors,
}

impl<const D: usize> ScenarioSpec<D> {
    /// Returns the recipe of a scenario that was read; loads its ground.
    ///
    /// # Errors
    /// When the ground cannot be loaded.
    pub(super) fn new(
        source: &Source,
        head: Head,
        file: ChainScenarioFile<D>,
        own: &CustomBehaviors,
    ) -> Result<Self, InputError> {
        let compiler = ChainScenarioCompiler {
            source,
            head: &head,
            file: &file,
            site: None,
            known: None,
            own,
        };
        let (site, ground_remarks) = compiler.compile_ground_map()?.unzip();
        let ground_remarks = ground_remarks.unwrap_or_default();
        Ok(Self { source: source.clone(), head, file, site, ground_remarks, own: own.clone() })
    }

    /// Returns whether the seed decides anything at the start: obstacles, or the place of a chain.
    pub(crate) fn is_start_random(&self) -> bool {
        !self.file.fields.0.is_empty() || self.file.has_random_start()
    }

    /// Returns the rules that are given, by their keys, and whether they have an effect only where obstacles move; the
    /// others have one only where connectors are held.
    pub(crate) fn given_rules(&self) -> impl Iterator<Item = (&'static str, bool)> + use<D> {
        let rules = &self.file.chain;
        let all = [
            ("joint_speed_m_s", rules.joint_speed_m_s.is_some(), false),
            ("escape_by", rules.escape_by.is_some(), true),
            ("escape_speed_m_s", rules.escape_speed_m_s.is_some(), true),
            ("escape_ahead_s", rules.escape_ahead_s.is_some(), true),
        ];
        all.into_iter().filter(|(_, is_given, _)| *is_given).map(|(key, _, moves)| (key, moves))
    }

    /// Compiles it; the result keeps it for further seeds.
    pub(super) fn compile(self) -> Result<ChainScenario<D>, InputError> {
        let compiled = self.compile_with(&self.head, None)?;
        Ok(ChainScenario { recipe: Some(Arc::new(self)), ..compiled })
    }

    fn compile_with(
        &self,
        head: &Head,
        known: Option<&ChainWorld<D>>,
    ) -> Result<ChainScenario<D>, InputError> {
        let Self { source, file, site, own, .. } = self;
        ChainScenarioCompiler { source, head, file, site: site.as_ref(), known, own }.compile()
    }
}

impl<const D: usize> ChainScenarioFile<D> {
    /// Returns whether the seed decides where a chain starts.
    pub(super) fn has_random_start(&self) -> bool {
        self.chains.0.iter().any(|section| section.get_ref().anywhere)
    }
}

impl<const D: usize> ChainScenario<D> {
    /// Returns the same scenario with another seed: the result of compiling it with that seed. Only the parts
    /// that the seed draws are made anew, random obstacles and chains that start anywhere; all else is shared.
    /// `None` where no scenario was read.
    ///
    /// # Errors
    /// When random obstacles or a chain find no place with this seed.
    pub fn reseeded(&self, seed: u64) -> Option<Result<Self, InputError>> {
        let recipe = self.recipe.as_ref()?;
        if !recipe.is_start_random() {
            let streams = Streams::new(Seed(seed));
            let world = Arc::new(ChainWorld { streams, ..(*self.world).clone() });
            return Some(Ok(Self { world, seed, ..self.clone() }));
        }
        let mut head = recipe.head.clone();
        head.seed = seed;
        let compiled = recipe.compile_with(&head, Some(&self.world));
        Some(compiled.map(|compiled| Self { recipe: self.recipe.clone(), ..compiled }))
    }
}
