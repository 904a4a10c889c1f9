//! Options of the command line -> a sweep.

use crate::scenario_args::ChangeArgs;
use clap::Args;
use sidestep::experiment::sweep::{
    BaselineSpec, Factor, Precision, Setting, Sweep, SweepOverrides,
};
use sidestep::kernel::InputError;
use std::path::Path;

/// The options that turn one run into many.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Many runs")]
pub(crate) struct ReplicationArgs {
    /// Number of runs per variant, with the seeds S, S+1, ... [default of a sweep: 10]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) replicate: Option<u32>,

    /// Run with each of these values; repeatable, for every combination (a grid)
    #[arg(long, value_name = "KEY=V,V,...")]
    pub(crate) vary: Vec<String>,

    /// Run each variant until the 95 % confidence intervals of means are this narrow: ci=0.05 (half
    /// width relative to the mean) or abs=2.5 (half width in the metric's unit)
    #[arg(long, value_name = "PRECISION", conflicts_with = "replicate")]
    pub(crate) until: Option<Precision>,

    /// Largest number of runs per variant, with --until or a file that has `[until]` [default: 1000]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    pub(crate) max: Option<u32>,

    /// Metrics to report, and to apply --until to [default: all that vary]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) metrics: Vec<String>,

    /// Baseline: compare every variant, seed by seed, with the one that has this value, or this
    /// name, and is equal in all else
    #[arg(long, value_name = "KEY=V")]
    pub(crate) baseline: Vec<String>,

    /// Metrics that runs keep over time, for means over seeds; `none` for no metric [default: those
    /// that the world is about]
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub(crate) series: Vec<String>,

    /// Record every run in a folder of its own, in DIR/runs
    #[arg(long)]
    pub(crate) record_runs: bool,
}

impl ReplicationArgs {
    pub(crate) fn is_requested(&self) -> bool {
        self.replicate.is_some() || !self.vary.is_empty() || self.until.is_some()
    }

    /// Refuses options that apply only to many runs, for a single run.
    ///
    /// # Errors
    /// When there is such an option; the error names the first.
    pub(crate) fn check_single_run(&self) -> Result<(), InputError> {
        let given = [
            (!self.metrics.is_empty(), "--metrics"),
            (!self.baseline.is_empty(), "--baseline"),
            (!self.series.is_empty(), "--series"),
            (self.record_runs, "--record-runs"),
            (self.max.is_some(), "--max"),
        ];
        let Some((_, option)) = given.into_iter().find(|(is_given, _)| *is_given) else {
            return Ok(());
        };
        let remedy = "give --replicate N or --vary KEY=V,V as well, or leave it out";
        Err(InputError::new(option, "it is about many runs, and this is one", remedy))
    }

    /// Returns the sweep that the file describes, with the changes of the options.
    ///
    /// # Errors
    /// When the file or an option is wrong.
    pub(crate) fn sweep(&self, file: &Path, changes: &ChangeArgs) -> Result<Sweep, InputError> {
        let sweep = Sweep::read(file)?;
        let baseline =
            (!self.baseline.is_empty()).then(|| parse_baseline(&self.baseline)).transpose()?;
        sweep.with_overrides(SweepOverrides {
            fixed: parse_settings(&changes.settings())?,
            factors: self.vary.iter().map(|text| Factor::parse(text)).collect::<Result<_, _>>()?,
            until: self.until.clone(),
            replicates: self.replicate,
            max_runs: self.max,
            metrics: self.metrics.clone(),
            baseline,
            first_seed: changes.seed,
            record: self.record_runs,
            series: parse_series(&self.series),
        })
    }
}

/// Returns the baseline: values, and the name of a variant where there is no `=`.
fn parse_baseline(texts: &[String]) -> Result<BaselineSpec, InputError> {
    let (values, names): (Vec<String>, Vec<String>) =
        texts.iter().cloned().partition(|text| text.contains('='));
    if let [first, second, ..] = &names[..] {
        let cause = format!("`{first}` and `{second}` are both variants");
        return Err(InputError::new("--baseline", cause, "give one name, or values as KEY=V"));
    }
    Ok(BaselineSpec { name: names.into_iter().next(), settings: parse_settings(&values)? })
}

/// Returns the metrics to keep over time; none where the option is not given.
fn parse_series(names: &[String]) -> Option<Vec<String>> {
    match names {
        [] => None,
        [none] if none == "none" => Some(Vec::new()),
        names => Some(names.to_vec()),
    }
}

fn parse_settings(texts: &[String]) -> Result<Vec<Setting>, InputError> {
    texts.iter().map(|text| Setting::parse(text)).collect()
}
