//! The program `sidestep-link`: reads a job, reports in lines of JSON. `sidestep fleet` and `sidestep node` start it.

fn main() -> std::process::ExitCode {
    sidestep_link::program::main()
}
