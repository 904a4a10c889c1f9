//! D1 for robots that talk: identical bits for 1, 2 and 3 workers and from every checkpoint, for any
//! periods of the senders. And the use of talking.

use crate::common::{simulation, source};
use sidestep::scenario::Source;
use sidestep_kernel::Simulation;

const RADIO: &str = include_str!("../../../../scenarios/robots/radio.toml");
const CYCLES: u64 = 60;

fn scenario(period: u64, more: &[&str]) -> Source {
    let period = format!("robots.period={period}");
    source(RADIO, &[&[period.as_str()], more].concat())
}

#[test]
fn robots_that_talk_give_the_same_bits_for_every_period_worker_and_checkpoint() {
    for period in [1, 2, 3, 5] {
        let source = scenario(period, &[]);
        let mut whole = simulation(&source, 1);
        let mut checkpoints = Vec::new();
        for _ in 0..CYCLES {
            checkpoints.push(whole.checkpoint());
            whole.advance(1);
        }
        for workers in [2, 3] {
            let mut team = simulation(&source, workers);
            team.advance(CYCLES);
            assert_eq!(team.digest(), whole.digest(), "{workers} workers, period {period}");
        }
        for (stop, saved) in (0..).zip(&checkpoints) {
            let mut resumed = simulation(&source, 1);
            resumed.restore(saved).expect("its own checkpoint");
            resumed.advance(CYCLES - stop);
            assert_eq!(resumed.digest(), whole.digest(), "resumed at {stop}, period {period}");
        }
        let mut deaf = simulation(&scenario(period, &["radio.loss=1"]), 1);
        deaf.advance(CYCLES);
        assert_ne!(deaf.digest(), whole.digest(), "what is heard matters, period {period}");
    }
}

/// Sums over 10 fixed seeds, with and without the radio.
#[test]
fn robots_that_hear_each_other_touch_each_other_less_than_half_as_often() {
    let contacts = |loss: &str| -> u64 {
        let one = |seed: u32| {
            let mut run = simulation(&scenario(1, &[loss, &format!("seed={seed}")]), 1);
            run.advance(1000);
            run.metrics().total.contacts_by_kind["robot"]
        };
        (1..=10).map(one).sum()
    };
    let (heard, deaf) = (contacts("radio.loss=0.05"), contacts("radio.loss=1"));
    assert!(2 * heard < deaf, "{heard} contacts, {deaf} without hearing");
}
