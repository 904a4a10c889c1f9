//! Promise: the parameters with which ranges were drawn come back within their intervals, which have their coverage.

use super::*;
use crate::sensor::readings::{Distance, LabeledReading};
use sidestep_error_models::beam::BEAMS_PER_DRAW;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Purpose, Streams};

const RANGE_M: f64 = 6.0;
const BEAM: BeamModel = BeamModel {
    hit: 0.8,
    short: 0.08,
    max: 0.07,
    random: 0.05,
    sigma_hit_m: 0.06,
    lambda_short_per_m: 0.9,
};

fn at(range_m: f64) -> Distance {
    Distance { class: 0, range_m: Some(range_m) }
}

/// Draws ranges of scans with ten beams; every seventh beam has nothing in range.
fn drawn(beam: &BeamModel, seed: u64, n: u32) -> Vec<LabeledReading> {
    let streams = Streams::new(Seed(seed));
    let reading = |k: u32| {
        let place = streams.block(k, 1, Purpose(1), 0)[0];
        let somewhere_m = 0.05 + 5.9 * f64::from(place) / f64::from(u32::MAX);
        let true_m = (!k.is_multiple_of(7)).then_some(somewhere_m);
        let words = |draw: u16| streams.block(k, 2, Purpose(16), draw * BEAMS_PER_DRAW);
        let reported_m = beam.sample(true_m, RANGE_M, words);
        LabeledReading {
            robot: 0,
            scan: k / 10,
            truth: usize::from(true_m.is_some()),
            reported: usize::from(reported_m.is_some()),
            true_at: true_m.map(at),
            reported_at: reported_m.map(at),
        }
    };
    (0..n).map(reading).collect()
}

fn truth(beam: &BeamModel) -> [f64; 6] {
    let [hit, short, max, random] = beam.weights();
    [hit, short, max, random, beam.sigma_hit_m, beam.lambda_short_per_m]
}

fn fitted(beam: &BeamModel, seed: u64, n: u32) -> BeamFit {
    BeamFit::from_readings(&drawn(beam, seed, n), [0.0, RANGE_M]).expect("enough readings")
}

#[test]
fn the_parameters_come_back() {
    let fit = fitted(&BEAM, 1, 20_000);
    assert!(fit.has_converged && fit.largest_deviation < 0.02, "{fit}");
    for (parameter, true_value) in fit.parameters.iter().zip(truth(&BEAM)) {
        let interval = parameter.interval.expect("there are many readings");
        // Twice the interval: of six parameters one may lie outside by chance.
        let off = (parameter.value - true_value).abs();
        assert!(off < 2.0 * interval.half_width(), "{parameter:?} for {true_value}");
        assert!(interval.half_width() < 0.2 * true_value, "{parameter:?}");
    }
    assert_eq!(fit.warnings(), Vec::<String>::new());
}

#[test]
fn intervals_hold_the_truth_in_95_of_100_logs() {
    let logs = 60;
    let mut inside = [0; 6];
    for seed in 0..logs {
        let fit = fitted(&BEAM, 100 + seed, 1000);
        for (k, (parameter, true_value)) in fit.parameters.iter().zip(truth(&BEAM)).enumerate() {
            inside[k] += u32::from(parameter.interval.expect("given").contains(true_value));
        }
    }
    // Of 60 logs 57 are expected; fewer than 51 come by chance once in a hundred times for one parameter. All six
    // together: 342 of 360, fewer than 325 by chance less than once in a thousand times if they were independent.
    assert!(inside.iter().all(|&n| n >= 51), "{inside:?}");
    assert!(inside.iter().sum::<u32>() >= 325, "{inside:?}");
}

#[test]
fn noise_that_the_range_cuts_and_a_rate_near_nothing_are_no_bias() {
    let wide = BeamModel { sigma_hit_m: 1.5, lambda_short_per_m: 0.2, ..BEAM };
    let fit = fitted(&wide, 5, 8000);
    let sigma = &fit.parameters[4];
    assert!((sigma.value - 1.5).abs() < 2.0 * sigma.interval.unwrap().half_width(), "{sigma:?}");
    assert!((sigma.value - 1.5).abs() < 0.1, "{sigma:?}");
}

#[test]
fn a_part_that_is_not_there_has_an_interval_from_nothing_on() {
    let clean = BeamModel { hit: 0.93, short: 0.0, max: 0.07, random: 0.0, ..BEAM };
    let fit = fitted(&clean, 2, 3000);
    let short = fit.parameters[1].interval.unwrap();
    assert!(short.low < 1e-9 && short.high < 0.01, "{fit}");
    assert_eq!(
        fit.parameters[5].interval, None,
        "without short ranges nothing is known of their rate"
    );
    assert!(fit.parameters[0].interval.unwrap().contains(0.93), "{fit}");
}

#[test]
fn a_part_that_is_not_there_beside_one_much_like_it_is_found_in_few_steps() {
    // Ranges at random are told from short ones of a low rate by little.
    let echo =
        BeamModel { hit: 0.93, short: 0.0, max: 0.06, random: 0.01, sigma_hit_m: 0.01, ..BEAM };
    let fit = fitted(&echo, 4, 40_000);
    assert!(fit.has_converged && fit.steps < 200, "{fit}");
    assert_eq!(fit.warnings(), Vec::<String>::new());
    let short = fit.parameters[1].interval.unwrap();
    assert!(short.low < 1e-9 && short.high < 0.005, "{fit}");
    let random = &fit.parameters[3];
    // Twice the interval, as above.
    let half_width = random.interval.unwrap().half_width();
    assert!((random.value - 0.01).abs() < 2.0 * half_width, "{fit}");
}

#[test]
fn ranges_of_another_kind_are_warned_of_and_few_are_refused() {
    let mut biased = drawn(&BEAM, 3, 3000);
    for reading in &mut biased {
        if let (Some(true_at), true) = (reading.true_at, reading.reported_at.is_some()) {
            let half_m = true_at.range_m.map(|m| 0.5 * m + 0.01);
            reading.reported_at = Some(Distance { class: 0, range_m: half_m });
        }
    }
    let fit = BeamFit::from_readings(&biased, [0.0, RANGE_M]).unwrap();
    assert!(fit.warnings().iter().any(|words| words.contains("does not describe")), "{fit}");
    assert_eq!(BeamFit::from_readings(&biased[..50].to_vec(), [0.0, RANGE_M]), None);
}

#[test]
fn very_many_readings_are_thinned_evenly() {
    let nothing = |k: u32| LabeledReading {
        robot: 0,
        scan: k,
        truth: 0,
        reported: 0,
        true_at: None,
        reported_at: None,
    };
    let all: Vec<LabeledReading> = (0..1_000_000).map(nothing).collect();
    let kept = thinned_pairs(&all, [0.0, RANGE_M], all.len());
    assert!((90_000..=110_000).contains(&kept.len()), "{}", kept.len());
    let of_one_beam = kept.iter().filter(|pair| pair.scan % 360 == 7).count();
    assert!((200..360).contains(&of_one_beam), "{of_one_beam}");
}
