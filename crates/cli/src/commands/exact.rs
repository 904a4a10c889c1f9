//! `sidestep exact`: the Markov chain of one robot, computed instead of simulated.

use crate::console::{Console, align_pairs, group_thousands};
use crate::exit::{ExitCode, Failure};
use crate::scenario_args::{ScenarioArgs, downcast_scenario};
use clap::Args;
use sidestep::exact::{
    Beam, Comparison, MarkovModel, POLICIES, PomdpOptions, PomdpSize, Summary, policy,
};
use sidestep::kernel::InputError;
use sidestep::scenario::Source;
use sidestep::worlds::robots::exact::{compare, markov_model};
use sidestep::worlds::robots::scenario::Compiled;
use sidestep_session::write_atomically;
use std::io::Write;
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  sidestep exact scenarios/robots/one-robot.toml
  sidestep exact office.toml --set robots.count=1 --policy bounce --json
  sidestep exact one-robot.toml --runs 2000 --cycles 50  compare the simulator
  sidestep exact one-robot.toml --pomdp model.pomdp --goal 5,3 --beam sonar-8:0

The scenario has one robot; doors stay closed, and nothing else moves. The policy replaces the \
robot's behavior: `uniform` takes each standard action with the same probability, `forward` goes \
ahead, `bounce` goes ahead and turns after a contact. A simulator that disagrees ends with exit \
code 1, and so do too few runs for a verdict.";

/// Compute the exact Markov chain of a scenario with one robot.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct ExactArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Policy: how the robot chooses its actions
    #[arg(long, value_name = "P", value_parser = POLICIES, default_value = "uniform")]
    policy: String,

    /// List this many of the boxes where the robot is most often
    #[arg(long, value_name = "N", default_value_t = 10)]
    top: usize,

    /// Compare with this many simulated runs, each as long as the scenario or --cycles says
    #[arg(long, value_name = "R")]
    runs: Option<u32>,

    #[command(flatten)]
    export: ExportArgs,
}

/// Options of the model that is exported for planners.
#[derive(Debug, Args)]
struct ExportArgs {
    /// Write the model with its observations to this file, in Cassandra's POMDP format
    #[arg(long, value_name = "OUT.pomdp")]
    pomdp: Option<PathBuf>,

    /// Goal of the planner: column and row of the robot's lower-left box
    #[arg(long, value_name = "COL,ROW", value_parser = parse_goal, requires = "pomdp")]
    goal: Option<(u32, u32)>,

    /// Discount factor per action
    #[arg(long, value_name = "D", requires = "pomdp")]
    #[arg(default_value_t = PomdpOptions::default().discount)]
    discount: f64,

    /// Beam to observe, counted from 0; repeatable [default: the one ahead]
    #[arg(long, value_name = "SENSOR:N", value_parser = parse_beam, requires = "pomdp")]
    beam: Vec<Beam>,

    /// Leave contacts out of the observations, which makes the model smaller
    #[arg(long, requires = "pomdp")]
    no_contacts: bool,
}

fn parse_goal(text: &str) -> Result<(u32, u32), String> {
    let parsed = text
        .split_once(',')
        .and_then(|(col, row)| Some((col.trim().parse().ok()?, row.trim().parse().ok()?)));
    parsed.ok_or_else(|| "write column and row, e.g. 5,3".into())
}

fn parse_beam(text: &str) -> Result<Beam, String> {
    let parsed = text.rsplit_once(':').and_then(|(sensor, index)| {
        Some(Beam { sensor: sensor.into(), index: index.parse().ok()? })
    });
    parsed.ok_or_else(|| "write a sensor and the number of a beam, e.g. sonar-8:0".into())
}

impl ExportArgs {
    fn options(&self) -> PomdpOptions {
        PomdpOptions {
            discount: self.discount,
            goal: self.goal,
            contacts: !self.no_contacts,
            beams: (!self.beam.is_empty()).then(|| self.beam.clone()),
        }
    }
}

/// # Errors
/// When the scenario is wrong or is not a Markov chain, or the export cannot be written.
pub(crate) fn exact(args: &ExactArgs, console: Console) -> Result<ExitCode, Failure> {
    let (source, compiled) = args.scenario.compile()?;
    let compiled: &Compiled = downcast_scenario(compiled.as_ref(), &source, "robots")?;
    // The model knows no file, so its error gets the place here.
    let model = markov_model(compiled)
        .map_err(|e| InputError::new(&source.place, e.cause(), e.remedy()))?;
    let policy = policy(&args.policy)?;
    let mut summary = model.summary(&args.policy, &policy, args.top)?;
    if let Some(runs) = args.runs {
        let cycles = compiled.cycles;
        summary.comparison = Some(compare(compiled, &source, &policy, cycles, runs)?);
    }
    summary.pomdp = export(&model, &args.export)?;
    console.print_result(&summary, || text(&summary, scenario_name(compiled, &source)))?;
    Ok(match summary.comparison {
        None | Some(Comparison { agrees: Some(true), .. }) => ExitCode::Done,
        // Too few runs confirm nothing, and a script that asked for the comparison must not take them for an agreement.
        Some(_) => ExitCode::Failed,
    })
}

fn scenario_name<'a>(compiled: &'a Compiled, source: &'a Source) -> &'a str {
    if compiled.name.is_empty() { &source.place } else { &compiled.name }
}

fn export(model: &MarkovModel, args: &ExportArgs) -> Result<Option<PomdpSize>, Failure> {
    let Some(path) = &args.pomdp else { return Ok(None) };
    let pomdp = model.pomdp(&args.options()).map_err(with_option_name)?;
    write_atomically(path, |file| write!(file, "{pomdp}"))?;
    Ok(Some(pomdp.size()))
}

/// Replaces the library's name of an option by `--beam`, which includes it here.
fn with_option_name(error: InputError) -> InputError {
    if error.place() == "--sensor" {
        return InputError::new("--beam", error.cause(), error.remedy());
    }
    error
}

fn text(summary: &Summary, name: &str) -> String {
    let mut lines = vec![
        key_value("poses", group_thousands(summary.poses as u64)),
        key_value("actions", summary.actions.join(", ")),
        key_value("outcomes", group_thousands(summary.outcomes as u64)),
        key_value("policy", summary.policy.clone()),
        key_value("chain", format!("{} states", group_thousands(summary.chain_states as u64))),
        key_value("most visited", visited_text(summary)),
    ];
    lines.extend(summary.pomdp.map(|size| key_value("POMDP", pomdp_text(size))));
    lines.extend(summary.comparison.map(|c| key_value("simulator", comparison_text(&c))));
    format!("Exact chain of {name}\n{}", align_pairs(&lines))
}

fn key_value(name: &str, value: String) -> (String, String) {
    (name.into(), value)
}

fn visited_text(summary: &Summary) -> String {
    let boxes = summary.most_visited.iter();
    let texts = boxes.map(|b| format!("[{}, {}] {:.2} %", b.col, b.row, 100.0 * b.share));
    texts.collect::<Vec<_>>().join(", ")
}

fn pomdp_text(size: PomdpSize) -> String {
    format!(
        "{} states, {} actions, {} observations",
        group_thousands(size.states as u64),
        size.actions,
        group_thousands(size.observations as u64)
    )
}

fn comparison_text(c: &Comparison) -> String {
    let verdict = match c.agrees {
        Some(true) => "agrees".to_string(),
        Some(false) => "DISAGREES".to_string(),
        None => {
            format!("too few runs for a verdict; --runs {} or more would suffice", c.runs_to_tell)
        }
    };
    format!(
        "{verdict}: total variation {:.4}, limit {:.4}, over {} runs of {} cycles",
        c.total_variation,
        c.limit,
        group_thousands(c.runs.into()),
        group_thousands(c.cycles)
    )
}
