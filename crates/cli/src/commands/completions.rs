//! `sidestep completions`: the words that a shell completes after `sidestep`.

use crate::args;
use crate::console::Console;
use crate::exit::{ExitCode, Failure};
use clap::Args;
use clap_complete::Shell;
use serde::Serialize;

const EXAMPLES: &str = "\
Examples:
  sidestep completions bash > ~/.bash_completion
  sidestep completions zsh > ~/.zfunc/_sidestep     with ~/.zfunc in fpath
  sidestep completions fish > ~/.config/fish/completions/sidestep.fish";

/// Print the completions of a shell.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct CompletionsArgs {
    /// Shell to complete in
    shell: Shell,
}

/// The result as JSON.
#[derive(Debug, Serialize)]
struct CompletionsOutput {
    shell: String,
    script: String,
}

/// # Errors
/// When they cannot be written.
pub(crate) fn completions(args: &CompletionsArgs, console: Console) -> Result<ExitCode, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut args::command(), "sidestep", &mut script);
    let script = String::from_utf8(script).expect("scripts are text");
    let output = CompletionsOutput { shell: args.shell.to_string(), script };
    console.print_result(&output, || output.script.clone())?;
    Ok(ExitCode::Done)
}
