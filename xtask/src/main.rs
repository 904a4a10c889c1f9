//! Tools of the house, started by `cargo xtask`: `test` runs all tests, `shape` counts the sources.

mod arguments;
#[cfg(test)]
mod builds;
mod counts;
mod lines;
mod measures;
mod members;
mod modules;
mod paths;
#[cfg(test)]
mod rules;
mod source;
mod table;
mod test;

use std::process::ExitCode;

use arguments::{Arguments, Print};
use members::Member;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [task, chosen @ ..] = words.as_slice()
        && task == "test"
    {
        return test::run(chosen);
    }
    match run(words.into_iter()) {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::from(2)
        }
    }
}

/// Returns the text that the command prints.
fn run(words: impl Iterator<Item = String>) -> Result<String, String> {
    let arguments = arguments::parse(words)?;
    if arguments.print == Print::Help {
        return Ok(arguments::HELP.to_string());
    }
    let members = members::read(&arguments.root)?;
    Ok(match arguments.print {
        Print::Circles => {
            measures::circles::HEADER.to_string() + &measures::circles::listed(&members)
        }
        Print::Clones => measures::clones::listed(&members),
        Print::Long => measures::long::listed(&members),
        Print::Tuples => measures::tuples::listed(&members),
        Print::Help | Print::Shape => shape(&arguments, &members)?,
    })
}

/// Returns the counts of all crates as JSON, or as a table beside earlier ones.
fn shape(arguments: &Arguments, members: &[Member]) -> Result<String, String> {
    let now = counts::figures(&counts::of(members));
    if arguments.json {
        return Ok(table::json(&now));
    }
    match &arguments.before {
        None => Ok(table::plain(&now)),
        Some(path) => Ok(table::compared(&table::read(path)?, &now)),
    }
}
