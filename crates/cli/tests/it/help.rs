//! Help texts, and arguments that no command accepts.

use crate::support::TestFolder;

#[test]
fn every_command_has_help_with_examples() {
    let place = TestFolder::new();
    for command in [
        "run", "check", "new", "map", "learn", "exact", "fk", "ik", "resume", "replay", "export",
        "sweep", "report", "fleet", "node", "drive", "dispatch",
    ] {
        let help = place.run(&[command, "--help"]);
        assert_eq!(help.code(), 0);
        let examples = help.out().matches(&format!("sidestep {command} ")).count();
        assert!((2..=10).contains(&examples), "{command}: {}", help.out());
    }
    for words in [["learn", "sensor"], ["learn", "effector"], ["reproduce", "loria"]] {
        let help = place.run(&[words[0], words[1], "--help"]).out();
        assert!(help.contains("Examples:"), "{words:?}");
    }
}

/// The first line that is wider than 80 columns.
fn wide(text: &str) -> Option<&str> {
    text.lines().find(|line| line.chars().count() > 80)
}

#[test]
fn no_line_of_help_is_wider_than_80_columns_where_there_is_no_terminal() {
    let place = TestFolder::new();
    let all = "run check new map learn exact fk ik resume replay export sweep compare report schema \
               completions man reproduce studio fleet node drive dispatch";
    for command in all.split_whitespace() {
        let help = place.run(&[command, "--help"]).out();
        assert_eq!(wide(&help), None, "{command}");
    }
    assert_eq!(wide(&place.run(&["--help"]).out()), None);
    for words in [["learn", "sensor"], ["learn", "effector"], ["reproduce", "loria"]] {
        assert_eq!(wide(&place.run(&[words[0], words[1], "--help"]).out()), None, "{words:?}");
    }
}

#[test]
fn warnings_verdicts_and_advice_fit_into_80_columns_and_nothing_has_the_sign_of_zero() {
    let place = TestFolder::new();
    let arm = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/chain/arm.urdf");
    place.write("arm.urdf", std::fs::read_to_string(arm).expect("the arm"));
    let moves = "forward,1,0,0,no\n".repeat(9) + "forward,0,0,0,yes\nleft,0,0,89.9,no\n";
    place.write("m.csv", format!("action,ahead_boxes,left_boxes,turn_deg,contact\n{moves}"));
    for words in [
        &["learn", "effector", "--csv", "m.csv"][..],
        &["ik", "arm.urdf", "--target", "2,0,0"],
        &["ik", "arm.urdf", "--target", "0.4,0.1,0.6", "--rpy", "3.1416,0,0", "--free", "rz"],
        &["new", "airspace", "a-scenario-with-a-long-name.toml"],
    ] {
        let told = place.run(words).out();
        assert_eq!(wide(&told), None, "{words:?}");
        let is_odd = |word: &&str| match word.parse::<f64>() {
            Ok(number) => (number == 0.0 && word.starts_with('-')) || word.contains("e-"),
            Err(_) => false,
        };
        assert_eq!(told.split_whitespace().find(is_odd), None, "{told}");
    }
}

#[test]
fn the_help_names_the_exit_codes_and_the_version_is_told() {
    let place = TestFolder::new();
    assert!(place.run(&["--help"]).out().contains("130 interrupted"));
    assert_eq!(place.run(&["--version"]).out(), format!("sidestep {}\n", sidestep::BUILD));
}

#[test]
fn wrong_words_are_wrong_input() {
    let place = TestFolder::new();
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

/// Returns every command, and every step of one, as its words: the help lists them.
fn all(place: &TestFolder) -> Vec<Vec<String>> {
    let mut found = vec![Vec::new()];
    let mut next = 0;
    while let Some(words) = found.get(next).cloned() {
        let args: Vec<&str> = words.iter().map(String::as_str).chain(["--help"]).collect();
        let help = at_width(place, &args, "200");
        let listed = help.lines().take_while(|line| !["Options:", "Arguments:"].contains(line));
        // Names stand two columns to the right, and `help` has no steps of its own.
        let names = listed.filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next());
        let names = names.filter(|name| name.starts_with(|c: char| c.is_ascii_lowercase()));
        let steps = names.filter(|name| !["help", "sidestep"].contains(name));
        found.extend(steps.map(|name| words.iter().cloned().chain([name.to_owned()]).collect()));
        next += 1;
    }
    found
}

/// Returns the output of a command on a terminal of this many columns.
fn at_width(place: &TestFolder, args: &[&str], columns: &str) -> String {
    let output = place.command(args).env("COLUMNS", columns).output().expect("the binary starts");
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn help_fits_80_columns_and_no_example_is_broken() {
    let place = TestFolder::new();
    let all = all(&place);
    assert!(all.contains(&vec!["reproduce".into(), "agentfly".into()]), "{all:?}");
    for words in all {
        let args: Vec<&str> = words.iter().map(String::as_str).chain(["--help"]).collect();
        let help = at_width(&place, &args, "80");
        for line in help.lines() {
            assert!(line.chars().count() <= 80, "{words:?}: {line}");
        }
        // In wider help an example that does not fit is whole.
        let wide = at_width(&place, &args, "100");
        for example in wide.lines().filter(|line| line.starts_with("  sidestep ")) {
            assert!(help.contains(example), "{words:?}: {example}");
        }
    }
}

#[test]
fn help_of_help_is_help() {
    let place = TestFolder::new();
    for args in [&["help", "--help"][..], &["help", "-h"], &["help"]] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out()), (0, place.run(&["--help"]).out()), "{args:?}");
    }
}

#[test]
fn commands_are_listed_by_what_people_do() {
    let help = TestFolder::new().run(&["--help"]).out();
    let places: Vec<usize> = [
        "Prepare:",
        "Run and look at it:",
        "Fly on a network:",
        "Study:",
        "Robot arms:",
        "Options:",
    ]
    .iter()
    .map(|group| help.find(group).unwrap_or_else(|| panic!("{group} in {help}")))
    .collect();
    assert!(places.is_sorted(), "{help}");
    assert!(!help.contains('\u{1b}'), "no colors where nobody asks for them");
}

#[test]
fn options_of_one_run_are_not_listed_under_many_runs() {
    let help = TestFolder::new().run(&["run", "--help"]).out();
    let many = help.find("Many runs:").expect("a heading");
    for option in ["--out <", "--mcap <", "--workers <", "--replace"] {
        assert!(help.find(option).expect(option) < many, "{option}");
    }
}

#[test]
fn shells_complete_the_commands_and_manual_pages_are_written() {
    let place = TestFolder::new();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = place.run(&["completions", shell]);
        assert_eq!(script.code(), 0);
        assert!(script.out().contains("reproduce"));
    }
    let told = place.run(&["man", "pages"]);
    assert_eq!(told.code(), 0, "{}", told.err());
    let page = std::fs::read_to_string(place.path("pages/sidestep-run.1")).expect("a page");
    assert!(page.contains("recorded run") && page.contains(".TH"), "{page}");
    std::fs::write(place.path("file"), "").expect("a file");
    let told = place.run(&["man", "file"]);
    assert_eq!(told.code(), 2);
    assert!(told.err().contains("a folder where you may write"), "{}", told.err());
}
