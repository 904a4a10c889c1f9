//! Scenarios of ponds.

use super::world_impl::Collector;
use super::{PondWorld, external};
use serde::Deserialize;
use sidestep_kernel::stream::Streams;
use sidestep_kernel::text::{JsonTextReport, align_pairs, key_value_pair};
use sidestep_kernel::view::BodyKind;
use sidestep_kernel::{InputError, Run, RunConfig, RunInputs, Seed, Simulation};
use sidestep_scenario::{
    CompiledScenario, Editing, ResolvedScenario, Source, WorldFacts, WorldType,
};
use std::any::Any;
use std::sync::Arc;

/// The world of frogs on lily pads, an entry of the list of worlds.
#[derive(Debug, Clone, Copy)]
pub struct Pond;

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
    #[serde(default)]
    reeds: Vec<ReedSection>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Section {
    frogs: u32,
    width: u32,
    height: u32,
    #[serde(default)]
    checkpoint_every: u64,
    /// Whether frogs take orders instead of deciding themselves.
    #[serde(default)]
    external: bool,
}

/// A pad overgrown with reeds.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct ReedSection {
    /// A point on the pad.
    at_m: [f64; 2],
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

    fn chart_metrics(&self) -> &'static [&'static str] {
        &["hops"]
    }

    fn kinds(&self) -> &'static [BodyKind] {
        super::kinds::ALL
    }

    fn facts(&self) -> WorldFacts {
        super::facts::FACTS
    }

    fn editing(&self) -> Editing {
        super::facts::editing()
    }

    fn compile(&self, source: &Source) -> Result<Box<dyn CompiledScenario>, InputError> {
        let File { name, seed, cycles, pond, reeds, .. } = source.parse()?;
        let Section { frogs, width, height, checkpoint_every, external } = pond;
        if 2 * frogs > width * height {
            return Err(source.error(None, "there are too few pads", "give two pads a frog"));
        }
        let world = Arc::new(PondWorld {
            frogs,
            width,
            height,
            reeds: reeds.iter().filter_map(|reed| pad_at(reed.at_m, width, height)).collect(),
            streams: Streams::new(Seed(seed)),
            teams: Arc::new(external::teams(frogs, width * height, external)),
        });
        Ok(Box::new(CompiledPond {
            world,
            plan: RunConfig { name, seed, cycles, checkpoint_every, series_every: None },
        }))
    }
}

/// Returns the pad at a point, if one is there.
fn pad_at([x_m, y_m]: [f64; 2], width: u32, height: u32) -> Option<u32> {
    let is_inside =
        (0.0..f64::from(width)).contains(&x_m) && (0.0..f64::from(height)).contains(&y_m);
    is_inside.then(|| y_m as u32 * width + x_m as u32)
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

    fn contents(&self, _: &Source) -> JsonTextReport {
        let frogs = self.world.frogs;
        let text = align_pairs(&[key_value_pair("frogs", frogs.to_string())]);
        JsonTextReport { json: serde_json::json!({ "frogs": frogs }), text }
    }

    fn resolve(&self, source: &Source) -> Result<ResolvedScenario, InputError> {
        Ok(ResolvedScenario { text: source.heading() + &source.text, files: Vec::new() })
    }

    fn start(&self, source: &Source, workers: usize) -> Box<dyn Simulation> {
        let start = RunInputs {
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
