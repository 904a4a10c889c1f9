//! Tools of the house, started by `cargo xtask`: `test` runs every test of the workspace.

mod test;

use std::process::ExitCode;

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    match words.split_first() {
        Some((name, rest)) if name == "test" => test::run(rest),
        _ => {
            eprintln!("error: `cargo xtask` knows `test [ARGUMENTS OF THE TEST RUNNER]`");
            ExitCode::from(2)
        }
    }
}
