//! The command line: options of every command, and examples.

use crate::commands::Command;
use clap::Parser;

/// Display order of global options: after those of each command.
const LAST: usize = 900;

/// Simulate and compare decentralized multi-agent motion, with noisy sensors and slipping wheels.
#[derive(Debug, Parser)]
#[command(name = "sidestep", version = sidestep::BUILD, after_help = EXAMPLES, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print one JSON object to standard output and nothing else
    #[arg(long, global = true, display_order = LAST)]
    pub(crate) json: bool,

    /// Show no progress bar, and print only the digest of a run
    #[arg(long, short, global = true, display_order = LAST)]
    pub(crate) quiet: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
Get started:
  sidestep new robots first.toml      write a commented scenario
  sidestep check first.toml           see what it describes
  sidestep run first.toml --out runs/first

Exit codes: 0 done, 1 the command failed or the answer is no, 2 the input is wrong,
130 interrupted.";
