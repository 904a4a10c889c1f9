//! The program `sidestep-link`: a job in, lines about it out. `sidestep fleet` and `sidestep node` start it.

fn main() -> std::process::ExitCode {
    sidestep_link::program::main()
}
