//! Whether a hemmed-in snake reacts in real time, always: the windows of 100 cycles that take most processor time.
//!
//! `cargo bench -p sidestep-chain --bench real_time [-- SEEDS [REPEATS]]` runs `scenarios/chain/hemmed-in.toml` with one
//! worker for each seed from 1 on, or for the one of `11..11`, and prints the greatest ratio of processor time to
//! simulated time of any window. All repeats do the same work, so the least time of a cycle among them counts: the
//! machine may be noisy.

use sidestep_chain::chain_run;
use sidestep_kernel::ports::{Clock, SystemClock};
use sidestep_scenario::Source;
use std::path::Path;

/// Duration of a cycle of the scenario, s.
const DT_S: f64 = 0.02;
/// Cycles of a window, as long as someone who watches waits at most: 2 s.
const WINDOW: usize = 100;

/// Returns the processor time of each cycle of a run, s.
fn cycle_times_s(seed: u64, clock: &SystemClock) -> Vec<f64> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../scenarios/chain/hemmed-in.toml");
    let overrides = [format!("seed={seed}")];
    let source = Source::read(Path::new(path), &overrides).expect("a shipped scenario");
    let mut run = chain_run(&source, 1).expect("a valid scenario");
    let mut times_s = Vec::new();
    while run.cycle() < run.config().cycles && !run.is_over() {
        let began_ns = clock.thread_cpu_ns();
        // One worker is the thread that calls.
        run.advance(1);
        times_s.push(1e-9 * (clock.thread_cpu_ns() - began_ns) as f64);
    }
    times_s
}

/// Returns the first cycle of the slowest window, and the ratio of its processor time to simulated time.
fn slowest_window(times_s: &[f64]) -> (usize, f64) {
    let windows = times_s.windows(WINDOW).map(|window| window.iter().sum::<f64>());
    let slowest = windows.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    let (first, time_s) = slowest.expect("a run longer than a window");
    (first, time_s / (WINDOW as f64 * DT_S))
}

/// Returns the seeds of an argument: `20` stands for 1 to 20, and `11..12` for these two.
fn seeds(argument: Option<&str>) -> std::ops::RangeInclusive<u64> {
    let text = argument.unwrap_or("20");
    let (first, last) = text.split_once("..").unwrap_or(("1", text));
    let number = |text: &str| text.parse().expect("SEEDS is a number, or two as in 3..5");
    number(first)..=number(last)
}

fn main() {
    // Cargo adds an option of its own.
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let repeats = arguments.get(1).map_or(3, |n| n.parse().expect("REPEATS is a number"));
    let clock = SystemClock::default();
    println!(
        "seed | processor time / simulated time: of the slowest 100 cycles, their first; of the run"
    );
    let mut worst = 0.0_f64;
    for seed in seeds(arguments.first().map(String::as_str)) {
        let mut best_s = cycle_times_s(seed, &clock);
        for _ in 1..repeats {
            let again_s = cycle_times_s(seed, &clock);
            assert_eq!(again_s.len(), best_s.len(), "all repeats do the same");
            for (best_s, again_s) in best_s.iter_mut().zip(again_s) {
                *best_s = best_s.min(again_s);
            }
        }
        let (first, ratio) = slowest_window(&best_s);
        worst = worst.max(ratio);
        let whole = best_s.iter().sum::<f64>() / (best_s.len() as f64 * DT_S);
        println!("{seed:>4} | {ratio:>6.3} {first:>6} {whole:>6.3}");
    }
    println!("slowest of all: {worst:.3}, and at most 1 is real time");
}
