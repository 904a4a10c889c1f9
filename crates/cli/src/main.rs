//! The `sidestep` command.

fn main() -> std::process::ExitCode {
    sidestep_cli::main()
}
