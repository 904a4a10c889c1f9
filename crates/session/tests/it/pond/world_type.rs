//! Scenarios of ponds.

use super::PondWorld;
use super::world_impl::Collector;
use serde::Deserialize;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::text::{Description, align_pairs, key_value};
use sidestep_kernel::{InputError, Run, RunConfig, RunStart, Seed, Simulation};
use sidestep_scenario::{CompiledScenario, ResolvedScenario, Source, WorldType};
use std::any::Any;
use std::sync::Arc;

/// The world of frogs on lily pads, an entry of the list of worlds.
pub(crate) struct Pond;

/// The sections of a scenario file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "format")]
    _format: u32,
    #[serde(rename = "world")]
    _world: String,
    #[serde(default)]
    name: String,
    #[serde(default)]
    seed: u64,
    cycles: u64,
    pond: Section,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    frogs: u32,
    width: u32,
    height: u32,
    #[serde(default)]
    checkpoint_every: u64,
}

struct CompiledPond {
    world: Arc<PondWorld>,
    plan: RunConfig,
}

impl WorldType for Pond {
    fn name(&self) -> &'static str {
        "pond"
    }

    fn agent(&self) -> &'static str {
        "frog"
    }

    fn about(&self) -> &'static str {
        "Frogs on lily pads"
    }

    fn default_scenario(&self) -> &'static str {
        "format = 1\nworld = \"pond\"\nname = \"evening\"\nseed = 1\ncycles = 6000\n\
         [pond]\nfrogs = 12\nwidth = 8\nheight = 6\ncheckpoint_every = 500\n"
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError> {
        let File { name, seed, cycles, pond, .. } = source.parse()?;
        let Section { frogs, width, height, checkpoint_every } = pond;
        if 2 * frogs > width * height {
            return Err(source.error(None, "there are too few pads", "give two pads a frog"));
        }
        let streams = Streams::new(Seed(seed));
        let world = Arc::new(PondWorld { frogs, width, height, streams });
        Ok(Box::new(CompiledPond {
            world,
            plan: RunConfig { name, seed, cycles, checkpoint_every },
        }))
    }
}

impl CompiledScenario for CompiledPond {
    fn world(&self) -> &'static str {
        Pond.name()
    }

    fn plan(&self) -> RunConfig {
        self.plan.clone()
    }

    fn body_count(&self) -> usize {
        self.world.frogs as usize
    }

    fn contents(&self, _: &Source) -> Description {
        let frogs = self.world.frogs;
        let text = align_pairs(&[key_value("frogs", frogs.to_string())]);
        Description { json: serde_json::json!({ "frogs": frogs }), text }
    }

    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError> {
        Ok(ResolvedScenario { text: source.heading() + &source.text, files: Vec::new() })
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        let start = RunStart {
            config: self.plan.clone(),
            state: self.world.start(),
            collector: Collector::default(),
        };
        let mut run = Run::new(self.world.clone(), start, &source.text, workers);
        // A pond this small would be left to one worker.
        run.force_parallel();
        Box::new(run)
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
