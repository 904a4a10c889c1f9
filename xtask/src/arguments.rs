//! Words of the command line -> the things to count and to print.

use std::path::PathBuf;

pub(crate) const HELP: &str = "\
Usage: cargo xtask test [ARGUMENTS OF THE TEST RUNNER]
       cargo xtask shape [OPTIONS]

The first runs all tests, or those chosen. The second counts the sources of every workspace
member but xtask, per crate and in total.

Options:
      --root DIR     Workspace to count, an old checkout for example [default: this one]
      --json         Print JSON
      --before FILE  Print an earlier --json output and today's counts side by side
      --circles      List circles of imports, in the format of xtask/circles.txt
      --clones       List equal pieces of code of six lines or more
      --long         List functions over 40 lines
      --tuples       List parameters that are tuples
";

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Print {
    Help,
    Shape,
    Circles,
    Clones,
    Long,
    Tuples,
}

#[derive(Debug)]
pub(crate) struct Arguments {
    pub(crate) print: Print,
    pub(crate) root: PathBuf,
    pub(crate) json: bool,
    pub(crate) before: Option<PathBuf>,
}

/// Parses the words after `cargo xtask`.
pub(crate) fn parse(mut words: impl Iterator<Item = String>) -> Result<Arguments, String> {
    let mut arguments = Arguments { print: Print::Shape, root: house(), json: false, before: None };
    match words.next().as_deref() {
        Some("shape") => {}
        None | Some("help" | "-h" | "--help") => arguments.print = Print::Help,
        Some(other) => return Err(format!("no task `{other}`; there are: shape, test")),
    }
    while let Some(word) = words.next() {
        let mut path = || {
            words.next().map(PathBuf::from).ok_or_else(|| format!("{word} needs a path after it"))
        };
        match word.as_str() {
            "--root" => arguments.root = path()?,
            "--before" => arguments.before = Some(path()?),
            "--json" => arguments.json = true,
            "--circles" => arguments.print = Print::Circles,
            "--clones" => arguments.print = Print::Clones,
            "--long" => arguments.print = Print::Long,
            "--tuples" => arguments.print = Print::Tuples,
            "-h" | "--help" => arguments.print = Print::Help,
            _ => return Err(format!("no option `{word}`\n\n{HELP}")),
        }
    }
    Ok(arguments)
}

/// Returns the folder of the workspace that this program was built in.
pub(crate) fn house() -> PathBuf {
    PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/.."))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(text: &str) -> Result<Arguments, String> {
        parse(text.split_whitespace().map(String::from))
    }

    #[test]
    fn options_are_read_and_wrong_ones_are_named() {
        let read = parsed("shape --root old --before b.json --long").unwrap();
        assert_eq!((read.root, read.before), ("old".into(), Some("b.json".into())));
        assert_eq!(read.print, Print::Long);
        assert_eq!(parsed("").unwrap().print, Print::Help);
        assert!(parsed("shape --root").unwrap_err().contains("--root needs a path"));
        assert!(parsed("shape --speed").unwrap_err().contains("no option `--speed`"));
        assert!(parsed("form").unwrap_err().contains("no task `form`"));
    }
}
