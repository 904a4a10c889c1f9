//! Help texts, and arguments that no command accepts.

use crate::support::Place;

#[test]
fn every_command_has_help_with_examples() {
    let place = Place::new();
    for command in [
        "run", "check", "new", "map", "learn", "exact", "fk", "ik", "resume", "replay", "export",
        "sweep", "report",
    ] {
        let help = place.run(&[command, "--help"]);
        assert_eq!(help.code(), 0);
        let examples = help.out().matches(&format!("sidestep {command} ")).count();
        assert!((2..=9).contains(&examples), "{command}: {}", help.out());
    }
    for words in [["learn", "sensor"], ["learn", "effector"], ["reproduce", "loria"]] {
        let help = place.run(&[words[0], words[1], "--help"]).out();
        assert!(help.contains("Examples:"), "{words:?}");
    }
}

#[test]
fn the_help_names_the_exit_codes_and_the_version_is_told() {
    let place = Place::new();
    assert!(place.run(&["--help"]).out().contains("130 interrupted"));
    assert_eq!(place.run(&["--version"]).out(), format!("sidestep {}\n", sidestep::BUILD));
}

#[test]
fn wrong_words_are_wrong_input() {
    let place = Place::new();
    let wrong = [
        &["rnu", "s.toml"][..],
        &["run"],
        &[],
        &["run", "s.toml", "--regime", "perfect"],
        &["run", "s.toml", "--workers", "0"],
        &["run", "s.toml", "--seed", "-1"],
        &["run", "s.toml", "--cycles", "18446744073709551615"],
        &["run", "s.toml", "--replace"],
        &["new", "mars"],
        &["learn", "sensor"],
        &["replay", "r"],
        &["export", "r"],
        &["run", "s.toml", "--mcap-every", "2"],
    ];
    for args in wrong {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}");
        assert!(!ended.err().is_empty());
    }
}
