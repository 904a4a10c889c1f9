//! Flights without a server, one after the other for a given time, with random losses, kills and stops.
//!
//! `SIDESTEP_SOAK_S` and `PROPTEST_RNG_SEED` are as in `soak.rs`.

use crate::processes::{LinkProcess, folder, wait_until_gone};
use crate::soak::variable;
use crate::without_server::{check_recording, counted, recorder, ring};
use serde_json::Value;
use sidestep::kernel::Seed;
use sidestep::kernel::stream::{Purpose, Streams};
use sidestep_session::fleet::{FleetStatus, Job, LinkMessage};
use sidestep_testing::{ProcessFault, StoppedProcesses};
use std::time::{Duration, Instant};

/// Cycles of a flight: the airplanes meet in the middle of them, and have passed each other at the end.
const CYCLES: u64 = 40;

/// One flight, and what happens in it.
#[derive(Debug, Clone, PartialEq)]
struct FlightPlan {
    airplanes: u32,
    loss: f64,
    /// Times since the beginning, airplanes and faults, by rising time.
    faults: Vec<(Duration, u32, ProcessFault)>,
}

impl FlightPlan {
    fn new(seed: u64, round: u32) -> Self {
        let streams = Streams::new(Seed(seed));
        let [size, percent, count, _] = streams.block(round, 0, Purpose(1), 0);
        let airplanes = 3 + size % 4;
        let mut faults = Vec::new();
        let mut at = Duration::ZERO;
        for k in 0..u64::from(count % 6) {
            let [gap, who, what, how_long] = streams.block(round, k, Purpose(2), 0);
            at += Duration::from_millis(500 + u64::from(gap % 5_000));
            let fault = ProcessFault::random(what, how_long);
            faults.push((at, who % airplanes, fault));
            // Often two at the same time: they forget each other.
            if gap.is_multiple_of(3) {
                faults.push((at, (who + 1) % airplanes, fault));
            }
        }
        Self { airplanes, loss: f64::from(percent % 31) / 100.0, faults }
    }

    fn scenario(&self) -> String {
        let network = format!("loss = {}\nmax_delay_s = 0.02", self.loss);
        ring(self.airplanes as usize, CYCLES, &network)
    }
}

/// What the recorder tells.
enum News {
    Status(FleetStatus),
    End(Value, FleetStatus),
}

fn news(program: &LinkProcess) -> News {
    program.until("news of the flight", |message| match message {
        LinkMessage::Fleet(now) => Some(News::Status(now)),
        LinkMessage::Ended { summary, fleet, .. } => Some(News::End(summary, fleet)),
        LinkMessage::Failed(failed) => panic!("{failed:?}"),
        _ => None,
    })
}

/// Flies with the faults, and returns the summary and the state of the nodes at the end.
fn fly(program: &LinkProcess, plan: &FlightPlan) -> (Value, FleetStatus) {
    let mut faults = plan.faults.iter().peekable();
    let mut stopped = StoppedProcesses::default();
    let mut began = None;
    loop {
        let now = match news(program) {
            News::Status(now) => now,
            News::End(summary, fleet) => return (summary, fleet),
        };
        stopped.wake();
        // Nobody sets out without all others.
        if !now.has_begun {
            continue;
        }
        let began = *began.get_or_insert_with(Instant::now);
        while let Some(&(_, airplane, fault)) = faults.next_if(|(at, ..)| *at <= began.elapsed()) {
            if let Some(process) = now.nodes[airplane as usize].process {
                stopped.inflict(process, fault);
            }
        }
    }
}

#[test]
#[ignore = "a minute, or as long as SIDESTEP_SOAK_S says: see .ci/soak"]
fn flights_whose_nodes_are_killed_and_stopped_stay_apart_and_are_replayed() {
    let lasts = Duration::from_secs(variable("SIDESTEP_SOAK_S").unwrap_or(60));
    let seed = variable("PROPTEST_RNG_SEED").unwrap_or(1);
    let began = Instant::now();
    let mut sums = [0u64; 6];
    let mut rounds = 0;
    while began.elapsed() < lasts {
        let plan = FlightPlan::new(seed, rounds);
        println!("flight {rounds}: {plan:?}");
        let folder = folder(&plan.scenario());
        let program = LinkProcess::start(&Job::FlightRecorder(Box::new(recorder(folder.path()))));
        let (summary, fleet) = fly(&program, &plan);
        assert_eq!(summary["status"], "complete", "{summary}");
        assert_eq!(program.end(), (Some(0), None));
        wait_until_gone(&fleet, Duration::from_secs(60));
        if summary["metrics"]["losses_of_separation"] != 0 {
            println!("  {fleet:?}");
        }
        check_recording(folder.path(), &summary);
        let lives: u64 = fleet.nodes.iter().map(|node| node.lives).sum();
        let names = ["late-controls", "unheard-cycles", "handed-over"];
        let [late, unheard, handed_over] = names.map(|name| counted(&fleet, name));
        let flown: u64 = fleet.nodes.iter().map(|node| node.flown).sum();
        let differing: u64 = fleet.nodes.iter().map(|node| node.differing).sum();
        let all = [plan.faults.len() as u64, lives, flown, late, unheard, handed_over];
        println!("  {all:?}, {differing} differ");
        sums.iter_mut().zip(all).for_each(|(sum, one)| *sum += one);
        rounds += 1;
    }
    let [faults, lives, flown, late, unheard, handed_over] = sums;
    println!(
        "seed {seed}, {} s, {rounds} flights: {faults} faults, {lives} lives, {flown} controls, {late} of them late; \
         {unheard} cycles with reports missing, {handed_over} vehicles handed over; nobody lost separation",
        began.elapsed().as_secs()
    );
}
