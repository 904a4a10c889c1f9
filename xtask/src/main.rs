//! Tools of this repository, started by `cargo xtask`: `test` runs all tests, `shape` shows the form of the code.

#[cfg(test)]
mod builds;
mod imports;
mod ratchets;
#[cfg(test)]
mod rules;
mod shape;
mod source;
mod test;
#[cfg(test)]
mod tests;
mod workspace;

use std::path::Path;
use std::process::ExitCode;

const HELP: &str = "\
Usage: cargo xtask test [ARGUMENTS OF THE TEST RUNNER]
       cargo xtask shape [OPTIONS]

The first runs all tests, or those chosen. The second shows the form of the code, per crate and in total.

Options:
      --root DIR     Workspace to read, an old checkout for example [default: this one]
      --json         Print the counts as JSON
      --before FILE  Show an earlier --json output and today's counts in one table
      --list FIGURE  List the places that a figure of the JSON counts
      --ratchet      Write counts that have shrunk to xtask/ratchets.toml
";

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let [task, chosen @ ..] = words.as_slice()
        && task == "test"
    {
        return test::run(chosen);
    }
    match run(words) {
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
fn run(mut words: Vec<String>) -> Result<String, String> {
    if words.is_empty() || words.iter().any(|word| matches!(word.as_str(), "-h" | "--help")) {
        return Ok(HELP.to_string());
    }
    let task = words.remove(0);
    if task != "shape" {
        return Err(format!("no task `{task}`; there are: shape, test"));
    }
    let folder = option(&mut words, "--root")?;
    let before = option(&mut words, "--before")?;
    let list = option(&mut words, "--list")?;
    if let Some(word) = words.iter().find(|word| !["--json", "--ratchet"].contains(&word.as_str()))
    {
        return Err(format!("no option `{word}`\n\n{HELP}"));
    }
    // Reading the workspace takes seconds: words that are wrong are told before.
    list.as_deref().map(shape::check_figure).transpose()?;
    let before = before.map(|file| shape::read(Path::new(&file))).transpose()?;
    let tree = shape::of(folder.as_deref().map_or(root(), Path::new))?;
    if let Some(figure) = list {
        Ok(shape::places(&tree, &figure))
    } else if words.iter().any(|word| word == "--ratchet") {
        ratchets::tighten(&tree.counts)
    } else if words.iter().any(|word| word == "--json") {
        Ok(shape::json(&tree.counts))
    } else {
        Ok(shape::table(before.as_ref(), &tree.counts))
    }
}

/// Takes an option and its value out of the words.
fn option(words: &mut Vec<String>, name: &str) -> Result<Option<String>, String> {
    let Some(at) = words.iter().position(|word| word == name) else {
        return Ok(None);
    };
    if at + 1 == words.len() {
        return Err(format!("{name} needs a value after it"));
    }
    words.remove(at);
    Ok(Some(words.remove(at)))
}

/// Returns the folder of the workspace that this program was built in.
fn root() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

#[test]
fn wrong_words_are_reported() {
    let error = |text: &str| run(text.split(' ').map(String::from).collect()).unwrap_err();
    assert_eq!(error("form"), "no task `form`; there are: shape, test");
    assert_eq!(error("shape --json --root"), "--root needs a value after it");
    assert!(error("shape --root . --speed").contains("no option `--speed`"));
    assert!(error("shape --list speed").contains("no figure `speed`; there are: code, tests"));
}
