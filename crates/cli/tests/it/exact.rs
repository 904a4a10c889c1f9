//! `exact`: the Markov chain of one robot, the comparison with the simulator, and the file for
//! planners.

use crate::support::TestFolder;

const ONE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/robots/one-robot.toml");

#[test]
fn the_chain_is_told_and_the_simulator_agrees_with_it() {
    let exact = TestFolder::new().json(&["exact", ONE, "--runs", "1000", "--policy", "bounce"]);
    assert!(exact["poses"].as_u64() > Some(100));
    assert_eq!(exact["comparison"]["agrees"], true);
    assert_eq!(exact["comparison"]["cycles"], 50);
    assert_eq!(exact["most_visited"].as_array().map(Vec::len), Some(10));
}

#[test]
fn runs_that_are_too_few_to_disagree_confirm_nothing() {
    let place = TestFolder::new();
    let compare = |runs: &str| place.run(&["exact", ONE, "--runs", runs, "--cycles", "50"]);
    let few = compare("40");
    let told = few.out();
    assert_eq!(few.code(), 1, "{told}");
    assert!(!told.contains("agrees") && told.contains("too few runs for a verdict"), "{told}");
    let enough = told.split_once("--runs ").expect("a number of runs").1;
    let enough = enough.split(' ').next().expect("a number");
    let told = compare(enough);
    assert_eq!(told.code(), 0, "{}", told.out());
    assert!(told.out().contains("agrees"), "{}", told.out());
    let less = (enough.parse::<u32>().expect("a number") - 1).to_string();
    assert_eq!(compare(&less).code(), 1);
}

#[test]
fn a_pomdp_is_exported_whole() {
    let place = TestFolder::new();
    let args = ["exact", ONE, "--pomdp", "m.pomdp", "--goal", "14,6", "--beam", "sonar-8:0"];
    let exact = place.json(&args);
    let text = place.read("m.pomdp");
    assert!(text.contains("\ndiscount: 0.95\n") && text.contains("\nT: forward : "));
    let states = text.lines().find(|l| l.starts_with("states:")).expect("states");
    let count = states.split_whitespace().count() - 1;
    assert_eq!(exact["pomdp"]["states"], count);
    assert_eq!(place.names(), ["m.pomdp", "s.toml"]);
}

#[test]
fn what_is_no_chain_is_refused_and_nothing_is_written() {
    let place = TestFolder::new();
    for (args, reason) in [
        (vec!["exact", "s.toml"], "moves by itself"),
        (vec!["exact", ONE, "--set", "robots.count=2"], "count"),
        (vec!["exact", ONE, "--pomdp", "m.pomdp", "--goal", "0,0"], "--goal"),
        (vec!["exact", ONE, "--pomdp", "m.pomdp", "--goal", "x"], "column and row"),
        (vec!["exact", ONE, "--pomdp", "m.pomdp", "--beam", "sonar-9:0"], "--beam"),
        (vec!["exact", ONE, "--pomdp", "m.pomdp", "--discount", "2"], "--discount"),
        (vec!["exact", ONE, "--policy", "dance"], "uniform"),
        (vec!["exact", ONE, "--runs", "0"], "--runs"),
    ] {
        let ended = place.run(&args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{}", ended.err());
        assert!(ended.err().contains(reason), "{}", ended.err());
    }
    assert_eq!(place.names(), ["s.toml"]);
}
