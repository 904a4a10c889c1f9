//! The command line: options of every command, and examples.

use crate::commands::{Command, GROUPS};
use crate::console::{Console, check_write, prose_columns};
use crate::exit::ExitCode;
use crate::worlds;
use clap::builder::Styles;
use clap::{CommandFactory, FromArgMatches, Parser};
use sidestep::kernel::terminal::escape_controls;
use std::ffi::{OsStr, OsString};
use std::fmt::Write;
use std::io::Write as _;

/// Display order of global options: after those of each command, which clap numbers from 0.
const GLOBAL_DISPLAY_ORDER: usize = 900;

/// Simulate and compare decentralized motion of many agents that must not collide.
#[derive(Debug, Parser)]
#[command(name = "sidestep", version = worlds().build(), after_help = EXAMPLES, arg_required_else_help = true)]
pub(crate) struct Cli {
    /// Print one JSON object to standard output and nothing else
    #[arg(long, global = true, display_order = GLOBAL_DISPLAY_ORDER)]
    pub(crate) json: bool,

    /// Show no progress bar, and print only the result: the digest of a run, the table of a sweep
    #[arg(long, short, global = true, display_order = GLOBAL_DISPLAY_ORDER)]
    pub(crate) quiet: bool,

    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXAMPLES: &str = "\
Get started:
  sidestep new robots first.toml      write a commented scenario
  sidestep check first.toml           see what it describes
  sidestep run first.toml --out runs/first

Exit codes: 0 done, 1 the command failed or the answer is no, \
2 the input is wrong, 130 interrupted.";

impl Cli {
    /// Returns the arguments of this process; ends it when they are wrong, or ask for help.
    pub(crate) fn parse_process_args() -> Self {
        let args = without_help_of_help(std::env::args_os());
        let matches = command()
            .try_get_matches_from(&args)
            .unwrap_or_else(|error| exit_with(&with_printable_args(error, &args)));
        Self::from_arg_matches(&matches).unwrap_or_else(|error| exit_with(&error))
    }
}

/// Ends the process with help or with the error in its arguments.
fn exit_with(error: &clap::Error) -> ! {
    let code = match check_write(error.print().and_then(|()| std::io::stdout().flush())) {
        Err(failure) if !error.use_stderr() => {
            Console::new(false, false).error(&failure);
            ExitCode::from(&failure) as i32
        }
        _ => error.exit_code(),
    };
    std::process::exit(code)
}

/// Returns an error in the arguments without what a terminal would execute: an argument may be the name of a file that
/// `*` found. The error itself has colors, so the arguments are escaped before it is made.
fn with_printable_args(error: clap::Error, args: &[OsString]) -> clap::Error {
    let printable: Vec<String> =
        args.iter().map(|arg| escape_controls(&arg.to_string_lossy()).into_owned()).collect();
    if args.iter().map(OsString::as_os_str).eq(printable.iter().map(OsStr::new)) {
        return error;
    }
    command().try_get_matches_from(printable).err().unwrap_or(error)
}

/// Returns the arguments with `help --help` as `help`: the command `help` has no options of its own.
fn without_help_of_help(args: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut args: Vec<OsString> = args.collect();
    if let [_, first, second] = args.as_slice()
        && first == "help"
        && (second == "--help" || second == "-h")
    {
        args.pop();
    }
    args
}

/// Returns the command line; its help lists the commands by their use.
pub(crate) fn command() -> clap::Command {
    // clap takes 100 columns where there is no terminal: help in a pipe would depend on it.
    let command = Cli::command().term_width(prose_columns().into());
    let listed = command_list(&command);
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{listed}{}\n{{options}}{{after-help}}",
        heading("Options")
    ))
}

fn heading(title: &str) -> String {
    let style = *Styles::styled().get_header();
    format!("{style}{title}:{style:#}")
}

fn command_list(command: &clap::Command) -> String {
    let style = *Styles::styled().get_literal();
    let mut text = String::new();
    for (group, names) in GROUPS {
        let _ = writeln!(text, "{}", heading(group));
        for name in *names {
            let about = command.find_subcommand(name).and_then(clap::Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {style}{name:<11}{style:#} {about}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_is_listed_once_in_80_columns() {
        let command = command();
        let mut listed: Vec<&str> = GROUPS.iter().flat_map(|(_, names)| *names).copied().collect();
        let mut all: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
        listed.sort_unstable();
        all.sort_unstable();
        assert_eq!(listed, all);
        for one in command.get_subcommands() {
            let about = one.get_about().expect("every command says what it does").to_string();
            assert!(about.len() <= 80 - 14, "{}: {} columns", one.get_name(), about.len());
        }
    }

    #[test]
    fn the_command_line_is_without_contradictions() {
        command().debug_assert();
    }
}
