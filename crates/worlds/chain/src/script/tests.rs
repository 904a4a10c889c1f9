use proptest::prelude::*;

use super::*;

fn end_of(text: &str) -> Turtle {
    let script = Script::parse("s", text).expect("a script");
    let mut motions = script.motions(Turtle::default());
    for motion in motions.by_ref() {
        motion.expect("a motion");
    }
    *motions.turtle()
}

fn assert_at(turtle: Turtle, expected: [f64; 3]) {
    let far = turtle.position_m.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-12);
    assert!(!far, "{turtle:?} is not at {expected:?}");
}

fn error_of(text: &str) -> InputError {
    match Script::parse("s", text) {
        Err(error) => error,
        Ok(script) => script.motions(Turtle::default()).find_map(Result::err).expect("an error"),
    }
}

#[test]
fn the_turtle_walks_in_the_plane_and_in_space() {
    assert_at(end_of("forward 1 turn 90 forward 2"), [1.0, 2.0, 0.0]);
    assert_at(end_of("pitch 90 forward 1 turn 90 forward 2"), [0.0, 2.0, 1.0]);
    assert_at(end_of("turn 90 pitch 90 forward -1"), [0.0, 0.0, -1.0]);
    assert_at(end_of("goto 1, 2, 3 forward 1 goto 5, -6"), [5.0, -6.0, 3.0]);
    assert_at(end_of("repeat 4 [ forward 1 turn 90 ]"), [0.0; 3]);
    assert_at(end_of("  # nothing\n"), [0.0; 3]);
}

#[test]
fn values_bind_as_in_arithmetic() {
    assert_at(end_of("forward 1 + 2 * 3 - 4 / 2"), [5.0, 0.0, 0.0]);
    assert_at(end_of("forward -(1 - .5) * 1e1"), [-5.0, 0.0, 0.0]);
    assert_at(end_of("forward 8 / 2 / 2 - 1 - 1"), [0.0; 3]);
}

#[test]
fn procedures_have_parameters_and_may_call_themselves() {
    let text = "to line :a :b # two pieces\n forward :a forward :b end\n line 1, 2 * 3 line 1, -1";
    assert_at(end_of(text), [7.0, 0.0, 0.0]);
    let spiral = "to down :n forward 1 repeat :n [ hop :n - 1 ] end
        to hop :n forward 10 end
        down 3";
    assert_at(end_of(spiral), [31.0, 0.0, 0.0]);
    let recursive = "to walk :n :again forward :n repeat :again [ walk :n - 1, 0 ] end walk 5, 1";
    assert_at(end_of(recursive), [9.0, 0.0, 0.0]);
}

#[test]
fn motions_come_one_by_one() {
    let script = Script::parse("s", "forward 1 wait 0.5 turn 180").expect("a script");
    let motions: Vec<ScriptMotion> =
        script.motions(Turtle::default()).map(|m| m.expect("ok")).collect();
    assert_eq!(motions[0], ScriptMotion::MoveTo { position_m: [1.0, 0.0, 0.0] });
    assert_eq!(motions[1], ScriptMotion::Wait { duration_s: 0.5 });
    assert!(matches!(motions[2], ScriptMotion::Face { ahead } if (ahead[0] + 1.0).abs() < 1e-12));
}

#[test]
fn syntax_errors_have_a_place_and_say_what_was_expected() {
    for (text, position, cause) in [
        ("forward 1\nturn", (2, 5), "the end of the script where a value"),
        ("forward turn 1", (1, 9), "`turn` where a value"),
        ("repeat 4 forward 1", (1, 10), "`forward` where `[`"),
        ("repeat 4 [ forward 1", (1, 21), "the end of the script where a statement or `]`"),
        ("repeat 4 [ forward 1 )", (1, 22), "`)` where a statement or `]`"),
        ("goto 1 2", (1, 8), "`2` where `,`"),
        ("goto 1,", (1, 8), "a value"),
        ("forward 1 + * 2", (1, 13), "`*` where a value"),
        ("forward (1 + 2", (1, 15), "`)`"),
        ("to repeat end", (1, 4), "`repeat` where a name"),
        ("to a forward 1", (1, 15), "a statement or `end`"),
        ("to a to b end end", (1, 6), "`to` where a statement or `end`"),
        ("forward 1 ]", (1, 11), "`]` where a statement"),
        ("forward 1 end", (1, 11), "`end` where a statement"),
        ("forward :", (1, 10), "a parameter's name"),
        ("§", (1, 1), "where a statement"),
    ] {
        let error = error_of(text);
        assert_eq!(error.line_and_column(), Some(position), "{error}");
        assert!(error.cause().contains(cause), "{error}");
    }
}

#[test]
fn names_that_are_not_there_and_wrong_values_are_errors() {
    for (text, position, cause, remedy) in [
        ("forwrd 1", (1, 1), "`forwrd`", "`forward`?"),
        ("to hop :a end hop", (1, 15), "1 values, not 0", "hop a"),
        ("to hop end hop 1", (1, 12), "0 values, not 1", "alone"),
        ("to hop :far forward :fra end hop 1", (1, 21), "`:fra`", "`far`?"),
        ("to a end to a end", (1, 10), "second", "own"),
        ("forward 1 / (1 - 1)", (1, 9), "inf", "zero"),
        ("wait 1 - 2", (1, 6), "-1 s", "from 0"),
        ("repeat 1.5 [ ]", (1, 8), "1.5 times", "whole"),
        ("repeat -1 [ ]", (1, 8), "-1 times", "whole"),
        ("forward 1e308 forward 1e308", (1, 15), "beyond", "less"),
    ] {
        let error = error_of(text);
        assert_eq!(error.line_and_column(), Some(position), "{error}");
        assert!(error.cause().contains(cause) && error.remedy().contains(remedy), "{error}");
    }
}

#[test]
fn what_never_ends_is_stopped() {
    let deep = error_of("to a a turn 1 end a");
    assert!(deep.cause().contains("1000 procedures"), "{deep}");
    let endless = error_of("to a a end a");
    assert!(endless.cause().contains("10000000 statements"), "{endless}");
    assert!(error_of("repeat 10000000 [ repeat 10000000 [ ] ]").cause().contains("statements"));
    let nested = "repeat 1 [".repeat(100_000);
    assert!(error_of(&nested).cause().contains("64 brackets"));
    assert!(error_of(&" ".repeat(MAX_BYTES + 1)).cause().contains("bytes"));
    // A long sum is not deep.
    assert_at(end_of(&format!("forward 0{}", " + 1".repeat(100_000))), [100_000.0, 0.0, 0.0]);
}

proptest! {
    #[test]
    fn no_text_panics(text in "(forward|turn|repeat|to|end|goto|wait|a|:a|[0-9.]{1,3}|[\\[\\](),*/+-]|#|\n| ){0,40}") {
        if let Ok(script) = Script::parse("s", &text) {
            let motions = script.motions(Turtle::default()).take(1000);
            for motion in motions.flatten() {
                if let ScriptMotion::MoveTo { position_m } = motion {
                    prop_assert!(position_m.iter().all(|x| x.is_finite()));
                }
            }
        }
    }

    #[test]
    fn turns_keep_the_turtle_straight(angles in prop::collection::vec((-720.0..720.0f64, -720.0..720.0f64), 0..30)) {
        let text: String = angles.iter().map(|(a, b)| format!("turn {a} pitch {b} ")).collect();
        let Turtle { ahead, left, .. } = end_of(&text);
        let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        prop_assert!((dot(ahead, ahead) - 1.0).abs() < 1e-12);
        prop_assert!((dot(left, left) - 1.0).abs() < 1e-12);
        prop_assert!(dot(ahead, left).abs() < 1e-12);
    }

    #[test]
    fn a_way_and_its_reverse_lead_home(steps in prop::collection::vec((-180.0..180.0f64, -2.0..2.0f64), 0..20)) {
        let there: String = steps.iter().map(|(a, d)| format!("turn {a} forward {d} ")).collect();
        let back: String = steps.iter().rev().map(|(a, d)| format!("forward -{d} turn -{a} ").replace("--", "")).collect();
        let end = end_of(&(there + &back));
        prop_assert!(end.position_m.iter().all(|x| x.abs() < 1e-9), "{:?}", end);
    }
}
