//! What was typed -> a sweep.

use crate::plan::ChangeArgs;
use clap::Args;
use sidestep::experiment::sweep::file::MAX_RUNS;
use sidestep::experiment::sweep::{Factor, Setting, Sweep, Until};
use sidestep::kernel::InputError;
use std::path::Path;

/// What makes many runs of one.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Many runs")]
pub(crate) struct ManyArgs {
    /// Run every variant this often, with the seeds S, S+1, ... [default of a sweep: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) replicate: Option<u32>,

    /// Run with each of these values; given often: with every combination
    #[arg(long, value_name = "KEY=V,V,...")]
    pub(crate) vary: Vec<String>,

    /// Run each variant until 95 % intervals of means are so narrow: ci=0.05 (half a width, of the
    /// mean) or abs=2.5 (in the metric's unit)
    #[arg(long, value_name = "PRECISION", conflicts_with = "replicate")]
    pub(crate) until: Option<Until>,

    /// Runs of each variant at most, where a precision ends them: with --until, or where the file
    /// has `[until]` [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) max: Option<u32>,

    /// Report these metrics, and apply --until to them [default: all that vary]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) metrics: Vec<String>,

    /// Compare every variant with the one of these values, seed by seed
    #[arg(long, value_name = "KEY=V")]
    pub(crate) baseline: Vec<String>,

    /// Record every run to a folder of its own, in DIR/runs
    #[arg(long)]
    pub(crate) record_runs: bool,
}

impl ManyArgs {
    /// Whether many runs are asked for.
    pub(crate) fn is_asked(&self) -> bool {
        self.replicate.is_some() || !self.vary.is_empty() || self.until.is_some()
    }

    /// Refuses options that say something of many runs where one is asked for.
    ///
    /// # Errors
    /// Names the first such option.
    pub(crate) fn check_one_run(&self) -> Result<(), InputError> {
        let given = [
            (!self.metrics.is_empty(), "--metrics"),
            (!self.baseline.is_empty(), "--baseline"),
            (self.record_runs, "--record-runs"),
            (self.max.is_some(), "--max"),
        ];
        let Some((_, option)) = given.into_iter().find(|(is_given, _)| *is_given) else {
            return Ok(());
        };
        let remedy = "give --replicate N or --vary KEY=V,V as well, or leave it out";
        Err(InputError::new(option, "it is about many runs, and this is one", remedy))
    }

    /// The sweep that the file asks for, with what the options change in it.
    ///
    /// # Errors
    /// When the file or an option is wrong.
    pub(crate) fn sweep(&self, file: &Path, changes: &ChangeArgs) -> Result<Sweep, InputError> {
        let mut sweep = Sweep::read(file)?;
        sweep.fixed.extend(settings(&changes.settings())?);
        for text in &self.vary {
            sweep.design.factors.push(Factor::parse(text)?);
        }
        if let Some(until) = &self.until {
            // What else the file says of it stays.
            let metrics = sweep.until.take().map(|of_file| of_file.metrics);
            sweep.replicates = if metrics.is_some() { sweep.replicates } else { MAX_RUNS };
            sweep.until = Some(Until { metrics: metrics.unwrap_or_default(), ..until.clone() });
        }
        if let Some(n) = self.replicate {
            (sweep.until, sweep.replicates) = (None, n);
        }
        if let Some(max) = self.max {
            if sweep.until.is_none() {
                let cause = "it bounds the runs of a sweep that goes on until it is precise";
                return Err(InputError::new("--max", cause, "give --until ci=0.05 as well"));
            }
            sweep.replicates = max;
        }
        if !self.metrics.is_empty() {
            sweep.metrics.clone_from(&self.metrics);
        }
        let applies_to = |until: &Until| until.metrics.is_empty() || !self.metrics.is_empty();
        if let Some(until) = sweep.until.as_mut().filter(|until| applies_to(until)) {
            until.metrics.clone_from(&sweep.metrics);
        }
        if !self.baseline.is_empty() {
            sweep.baseline = settings(&self.baseline)?;
        }
        sweep.first_seed = changes.seed.or(sweep.first_seed);
        sweep.record |= self.record_runs;
        sweep.check()?;
        Ok(sweep)
    }
}

fn settings(texts: &[String]) -> Result<Vec<Setting>, InputError> {
    texts.iter().map(|text| Setting::parse(text)).collect()
}
