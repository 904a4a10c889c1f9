//! What can be typed.

use crate::commands::Command;
use clap::Parser;

/// Behind the options that are a command's own.
const LAST: usize = 900;

/// Simulate and compare decentralized multi-agent motion, with sensors that lie and wheels that slip.
#[derive(Debug, Parser)]
#[command(name = "sidestep", version = sidestep::BUILD, after_help = EXAMPLES, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print one JSON object on standard output and nothing else
    #[arg(long, global = true, display_order = LAST)]
    pub(crate) json: bool,

    /// Show no progress, and of a run nothing but its digest
    #[arg(long, short, global = true, display_order = LAST)]
    pub(crate) quiet: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
Begin with:
  sidestep new robots first.toml      write a commented scenario
  sidestep check first.toml           see what it describes
  sidestep run first.toml --out runs/first

Exit codes: 0 done, 1 the command failed or the answer is no, 2 the input is wrong,
130 interrupted.";
