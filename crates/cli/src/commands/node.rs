//! `sidestep node`: one airplane of a fleet, as a process of its own.

use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use crate::link::{LinkArgs, run};
use crate::plan::ScenarioArgs;
use clap::Args;
use serde_json::json;
use sidestep::kernel::EntityId;
use sidestep_session::fleet::{Job, NodeJob};

const EXAMPLES: &str = "\
Examples:
  sidestep node ring.toml --airplane 3 --connect tcp/10.0.0.1:7600 \\
      --listen tcp/10.0.0.4:0
  sidestep node ring.toml --airplane 3 --connect tcp/10.0.0.1:7600
                                   for a fleet with --topology star

Give it the scenario, --set, --seed and --cycles of the fleet. It flies its airplane until the \
fleet ends, and ends when it has not heard the server for the time of --lease.";

/// Fly one airplane of a fleet from this machine.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct NodeArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,

    /// Id of the airplane, from 0 on
    #[arg(long, value_name = "ID")]
    airplane: EntityId,

    /// Endpoint of the server, e.g. tcp/10.0.0.1:7600; repeatable, if it may be at several
    #[arg(long, value_name = "ENDPOINT", required = true)]
    connect: Vec<String>,

    /// Endpoint at which the other nodes reach this one, in a mesh; port 0 for any free one
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,

    /// Seconds to wait for the server
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    patience: f64,

    #[command(flatten)]
    link: LinkArgs,
}

/// Runs the command.
///
/// # Errors
/// When anything is wrong with its input, or the server is not there.
pub(crate) fn node(args: &NodeArgs, console: Console) -> Result<ExitCode, Failure> {
    let job = NodeJob {
        common: args.link.common(args.scenario.file.clone(), args.scenario.all_overrides()),
        airplane: args.airplane,
        connect: args.connect.clone(),
        listen: args.listen.clone(),
        patience_s: args.patience.clamp(0.1, 86_400.0),
    };
    run(&Job::Node(job), |_| {})?;
    let airplane = args.airplane;
    let words = || format!("The fleet has ended; airplane {airplane} has landed its node.\n");
    console.result_or_short(&json!({ "airplane": airplane }), String::new, words);
    Ok(ExitCode::Done)
}
