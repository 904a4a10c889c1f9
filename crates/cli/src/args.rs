//! What can be typed.

use crate::commands::Command;
use clap::Parser;

/// Simulate, compare and deploy decentralised multi-agent motion.
#[derive(Debug, Parser)]
#[command(name = "sidestep", version, about, after_help = EXAMPLES)]
#[command(propagate_version = false, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print one JSON object on standard output and nothing else
    #[arg(long, global = true)]
    pub(crate) json: bool,

    /// Show no progress, and of a run only its digest
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
Begin with:
  sidestep new robots first.toml      write a commented scenario
  sidestep check first.toml           see what it describes
  sidestep run first.toml --out runs/first

Exit codes: 0 done, 1 the command failed, 2 the input is wrong, 130 interrupted.";
