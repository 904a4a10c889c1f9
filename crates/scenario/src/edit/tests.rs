//! Edits of small texts, with the resulting text.

use super::{CharEdit, Edit};
use crate::Source;
use serde_json::{Value, json};

mod random;

pub(super) fn set(key: &str, value: Value) -> Edit {
    Edit::Set { key: key.into(), value }
}

pub(super) fn insert(key: &str, at: Option<usize>, value: Value) -> Edit {
    Edit::Insert { key: key.into(), at, value }
}

pub(super) fn remove(key: &str) -> Edit {
    Edit::Remove { key: key.into() }
}

pub(super) fn relocate(key: &str, to: usize) -> Edit {
    Edit::Move { key: key.into(), to }
}

pub(super) fn rename(key: &str, to: &str) -> Edit {
    Edit::Rename { key: key.into(), to: to.into() }
}

fn paint(key: &str, cells: &[(usize, usize, char)]) -> Edit {
    let cell = |&(row, column, mark): &_| CharEdit { row, column, mark };
    Edit::Paint { key: key.into(), cells: cells.iter().map(cell).collect() }
}

fn edited(text: &str, edits: &[Edit]) -> String {
    let edited = Source::new("s.toml", text, "").edited(edits);
    edited.unwrap_or_else(|error| panic!("{edits:?}: {error}")).text
}

fn assert_edits(text: &str, edits: &[(Edit, &str)]) {
    for (edit, expected) in edits {
        assert_eq!(edited(text, std::slice::from_ref(edit)), *expected, "{edit:?} in\n{text}");
    }
}

const TEXT: &str = "# Head.\n\nseed = 1 # why\nat = [ 1.0,2.0 ]  # place\n\n# Robots.\n[[robots]]\ncount = 2\n\n\
                    [[robots]]\ncount = 3\n[robots.deep]\nx = 1\n\n# --- Others ---\n\n[map]\nbox_m = 0.5\n";

#[test]
fn a_value_is_set_where_it_stands() {
    assert_edits(
        TEXT,
        &[
            (set("seed", json!(7)), &TEXT.replace("seed = 1", "seed = 7")),
            (set("at", json!([3, 2])), &TEXT.replace("[ 1.0,2.0 ]", "[ 3.0,2.0 ]")),
            (set("at.1", json!(5)), &TEXT.replace("2.0 ]", "5.0 ]")),
            (set("at", json!([3])), &TEXT.replace("[ 1.0,2.0 ]", "[3.0]")),
            (set("map.0.box_m", json!(1)), &TEXT.replace("0.5", "1.0")),
            (set("map.box_m", json!(0.5)), TEXT),
            (set("robots.1.deep.x", json!("é\n")), &TEXT.replace("x = 1", "x = \"\"\"\né\n\"\"\"")),
        ],
    );
}

#[test]
fn keys_and_the_tables_on_the_way_are_made() {
    assert_edits(
        TEXT,
        &[
            (set("name", json!("n")), &TEXT.replace("# place\n", "# place\nname = \"n\"\n")),
            (set("map.file", json!("f")), &format!("{TEXT}file = \"f\"\n")),
            (set("a.\"b c\".d", json!(1)), &format!("{TEXT}\n[a.\"b c\"]\nd = 1\n")),
            (set("radio", json!({ "m": 5 })), &format!("{TEXT}\n[radio]\nm = 5\n")),
            (
                set("robots.0.radio.m", json!(5)),
                &TEXT.replace("count = 2\n", "count = 2\n\n[robots.radio]\nm = 5\n"),
            ),
            (set("robots.0.at", json!([1, 2])), &TEXT.replace("2\n\n[[", "2\nat = [1, 2]\n\n[[")),
            (insert("doors", None, json!({ "a": [] })), &format!("{TEXT}\n[[doors]]\na = []\n")),
            (insert("map.sides", Some(0), json!("n")), &format!("{TEXT}sides = [\"n\"]\n")),
        ],
    );
    assert_edits("a = 1\nc = 3\n", &[(set("0", json!({ "a": 1, "b": 2 })), "a = 1\nb = 2\n")]);
    assert_edits("", &[(set("a", json!(1)), "a = 1\n"), (set("a.b", json!(1)), "[a]\nb = 1\n")]);
    assert_edits("a.b = 1\nc = 2", &[(set("a.d.e", json!(1)), "a.b = 1\na.d.e = 1\nc = 2")]);
    assert_edits("t = {}\n", &[(set("t.a.b", json!(1)), "t = {a.b = 1}\n")]);
    assert_edits("t = { a.b = 1 }", &[(set("t.a.c", json!(1)), "t = { a.b = 1, a.c = 1 }")]);
    assert_edits("[a.b]\nc = 1\n", &[(set("a.d", json!(1)), "[a]\nd = 1\n\n[a.b]\nc = 1\n")]);
    assert_edits("a = 1\r\n", &[(set("b.c", json!(1)), "a = 1\r\n\r\n[b]\r\nc = 1\r\n")]);
}

#[test]
fn tables_are_set_key_by_key() {
    let text = "[a]\n# On x.\nx = 1\n\n# On y.\ny = 2 # two\n[a.b]\nz = 3\n";
    let new = json!({ "y": 5, "s": {}, "w": [1], "b": { "z": 3 } });
    assert_edits(
        text,
        &[
            (set("a", new), "[a]\n\n# On y.\ny = 5 # two\nw = [1]\n[a.b]\nz = 3\n\n[a.s]\n"),
            (set("a", json!(1)), "a = 1\n"),
            (set("a.b", json!(1)), "[a]\n# On x.\nx = 1\n\n# On y.\ny = 2 # two\nb = 1\n"),
        ],
    );
    let lists = "[[r]]\nn = 1 # one\n\n[[r]]\nn = 2\n";
    assert_edits(
        lists,
        &[
            (set("r", json!([{ "n": 1 }])), "[[r]]\nn = 1 # one\n"),
            (
                set("r", json!([{ "n": 1 }, { "n": 4 }, { "n": 5 }])),
                "[[r]]\nn = 1 # one\n\n[[r]]\nn = 4\n\n[[r]]\nn = 5\n",
            ),
        ],
    );
}

#[test]
fn sections_are_inserted_removed_and_moved_with_their_comments() {
    let text = "[[r]] # a\nn = 1\n\n# On b.\n[[r]]\nn = 2\n[[r.t]]\nm = 1\n\n# --- End ---\n\n[map]\nx = 1\n";
    let (new, b) = ("[[r]]\nn = 9\n", "# On b.\n[[r]]\nn = 2\n[[r.t]]\nm = 1\n");
    let r = json!({ "n": 9 });
    assert_edits(
        text,
        &[
            (insert("r", Some(0), r.clone()), &format!("{new}\n{text}")),
            (insert("r", Some(1), r.clone()), &text.replace("# On b.", &format!("{new}\n# On b."))),
            (insert("r", None, r.clone()), &text.replace("m = 1\n", &format!("m = 1\n\n{new}"))),
            (remove("r.1"), &text.replace(&format!("\n{b}"), "")),
            (remove("r.1.t"), &text.replace("[[r.t]]\nm = 1\n", "")),
            (remove("map"), &text.replace("\n[map]\nx = 1\n", "")),
            (
                relocate("r.1", 0),
                &text.replace(
                    &format!("[[r]] # a\nn = 1\n\n{b}"),
                    &format!("{b}\n[[r]] # a\nn = 1\n"),
                ),
            ),
            (
                insert("map", None, json!({})),
                &text.replace("[map]\nx = 1\n", "[[map]]\nx = 1\n\n[[map]]\n"),
            ),
            (
                insert("map", Some(0), json!({})),
                &text.replace("[map]\nx = 1\n", "[[map]]\n\n[[map]]\nx = 1\n"),
            ),
        ],
    );
    let apart = "[[r]]\nn = 1\n[[r]]\nn = 2\n[m]\n[[r]]\nn = 3\n";
    assert_edits(apart, &[(relocate("r.2", 0), "[[r]]\nn = 3\n[[r]]\nn = 1\n[m]\n[[r]]\nn = 2\n")]);
}

#[test]
fn elements_keep_the_layout_of_their_array() {
    let lines = "a = [\n  1, # one\n  2  # two\n]\n";
    assert_edits(
        lines,
        &[
            (insert("a", Some(1), json!(5)), "a = [\n  1, # one\n  5,\n  2  # two\n]\n"),
            (insert("a", None, json!(5)), "a = [\n  1, # one\n  2,  # two\n  5\n]\n"),
            (remove("a.0"), "a = [\n  2  # two\n]\n"),
            (remove("a.1"), "a = [\n  1 # one\n]\n"),
            (relocate("a.0", 1), "a = [\n  2,  # two\n  1 # one\n]\n"),
        ],
    );
    assert_edits(
        "a = [ 1,2, 3 ]\n",
        &[
            (insert("a", Some(0), json!(5)), "a = [ 5, 1,2, 3 ]\n"),
            (insert("a", Some(3), json!(5)), "a = [ 1,2, 3, 5 ]\n"),
            (remove("a.1"), "a = [ 1,3 ]\n"),
            (remove("a.2"), "a = [ 1,2 ]\n"),
            (relocate("a.2", 0), "a = [ 3,1, 2 ]\n"),
        ],
    );
    assert_edits("a = [1]", &[(remove("a.0"), "a = []"), (remove("a"), "")]);
    assert_edits("a = []", &[(insert("a", None, json!([1])), "a = [[1]]")]);
    assert_edits("a = { b = 1 }", &[(insert("a", None, json!({})), "a = [{ b = 1 }, {}]")]);
}

#[test]
fn keys_in_braces_and_dotted_keys_go_alone() {
    let text = "t = { a.x = 1, b = 2, a.y = 3, c = { d = 4 } } # why\nm.a = 1\nm.b = 2\n";
    assert_edits(
        text,
        &[
            (remove("t.a"), &text.replace("a.x = 1, b = 2, a.y = 3, c", "b = 2, c")),
            (remove("t.c"), &text.replace(", c = { d = 4 }", "")),
            (remove("t.c.d"), &text.replace("{ d = 4 }", "{ }")),
            (remove("t.a.y"), &text.replace("a.y = 3, ", "")),
            (remove("m"), &text.replace("m.a = 1\nm.b = 2\n", "")),
            (rename("t.a", "z z"), &text.replace("a.x", "\"z z\".x").replace("a.y", "\"z z\".y")),
            (rename("t.c.d", "e"), &text.replace("d = 4", "e = 4")),
            (rename("m", "n"), &text.replace("m.", "n.")),
        ],
    );
    assert_edits("a = { b = 1 }", &[(remove("a.b"), "a = { }")]);
}

#[test]
fn a_key_gets_its_new_name_wherever_it_is_written() {
    let text =
        "[s.lidar]\na = 1\n[s.lidar.b]\n[[c]]\n[[c.t]]\n[[c]]\n[[c.t]]\n[s.other]\nlidar = 1\n";
    assert_edits(
        text,
        &[
            (rename("s.lidar", "a.b"), &text.replace("s.lidar", "s.\"a.b\"")),
            (rename("s", "q"), &text.replace("[s.", "[q.")),
            (
                rename("c.1.t", "u"),
                "[s.lidar]\na = 1\n[s.lidar.b]\n[[c]]\n[[c.t]]\n[[c]]\n[[c.u]]\n[s.other]\nlidar = 1\n",
            ),
        ],
    );
}

#[test]
fn a_drawing_changes_in_its_characters() {
    let text =
        "[map]\nascii = \"\"\"\n..#\n...\n\"\"\" # drawn\nline = '...'\nescaped = \"\\n..\\n..\"\n";
    assert_edits(
        text,
        &[
            (
                paint("map.ascii", &[(0, 0, '#'), (1, 2, '?')]),
                &text.replace("..#\n...", "#.#\n..?"),
            ),
            (paint("map.line", &[(0, 1, 'é')]), &text.replace("'...'", "'.é.'")),
            (
                paint("map.escaped", &[(1, 1, '#')]),
                &text.replace("\"\\n..\\n..\"", "\"\"\"\n\n..\n.#\"\"\""),
            ),
        ],
    );
    for (row, column, mark) in
        [(2, 0, '#'), (0, 3, '#'), (0, 0, '\n'), (0, 0, '"'), (usize::MAX, 0, '#')]
    {
        let edit = paint("map.ascii", &[(0, 0, '#'), (row, column, mark)]);
        let error = Source::new("s.toml", text, "").edited(&[edit]).expect_err("outside");
        assert_eq!(error.place(), "s.toml (map.ascii)");
    }
}

#[test]
fn comments_outlive_ten_edits() {
    let text = std::fs::read_to_string(super::tests::random::scenario("robots/default.toml"));
    let mut source = Source::new("s.toml", text.expect("a scenario"), "");
    let comments = |text: &str| {
        text.lines()
            .filter_map(|line| Some(line.split_once('#')?.1.to_string()))
            .collect::<Vec<_>>()
    };
    let before = comments(&source.text);
    for round in 0..10 {
        let edits = [
            set("seed", json!(round)),
            set("map.office.floors", json!(round + 2)),
            set("robots.0.count", json!(round + 1)),
            insert("robots", None, json!({ "count": round })),
            relocate("robots.1", 0),
            relocate("robots.0", 1),
        ];
        source = source.edited(&edits).expect("they fit");
    }
    assert_eq!(comments(&source.text), before);
    let count = source.value("robots").and_then(|robots| robots.as_array().map(Vec::len));
    let last = format!("robots.{}.count", count.expect("robots") - 1);
    assert_eq!(source.value(&last), Some(toml::Value::Integer(9)));
}

#[test]
fn an_edit_that_does_not_fit_says_so_and_changes_nothing() {
    let source = Source::new("s.toml", TEXT, "");
    let infinite = serde_json::Number::from_f64(f64::NAN).map_or(Value::Null, Value::Number);
    for (edit, cause, remedy) in [
        (set("robots.count", json!(1)), "is not in a table", "the number of an element"),
        (set("robots.7.count", json!(1)), "no element 7, as there are 2", "count from 0"),
        (set("seed.x", json!(1)), "is not in a table", "number"),
        (set("at.2", json!(1)), "no element 2", "count from 0"),
        (set("seed", Value::Null), "null", "leave the key out"),
        (set("seed", infinite), "null", "NaN"),
        (set("seed", json!(u64::MAX)), "larger", "at most"),
        (set("x.3.y", json!(1)), "no element 3", "count from 0"),
        (set("", json!(1)), "empty", "a.b.c"),
        (set("robots.0", json!(1)), "is a table", "give a table"),
        (insert("seed", None, json!(1)), "neither an array", "array"),
        (insert("at", Some(3), json!(1)), "no position 3", "count from 0"),
        (insert("robots", None, json!(1)), "is a table", "give a table"),
        (insert("robots.1", None, json!({})), "an element", "give the key of the array"),
        (remove("sede"), "no key `sede`", "`seed`"),
        (remove("robots.2"), "no element 2", "count from 0"),
        (relocate("robots.0", 2), "no position 2", "count from 0"),
        (relocate("map", 0), "no element", "robots.1"),
        (rename("seed", "at"), "`at` already", "another name"),
        (rename("seed", ""), "empty", "give a name"),
        (rename("robots.0", "x"), "no name", "give a key"),
        (paint("seed", &[]), "no map drawn in text", "map.ascii"),
    ] {
        let edits = [set("seed", json!(5)), edit.clone()];
        let error = source.edited(&edits).expect_err("it does not fit");
        assert!(error.cause().contains(cause), "{edit:?}: {error}");
        assert!(error.remedy().contains(remedy), "{edit:?}: {error}");
        assert_eq!(error.key(), Some(edit.key()));
    }
    let error = Source::new("s.toml", "a = = 1", "").edited(&[remove("a")]).expect_err("no TOML");
    assert_eq!((error.line_and_column(), error.remedy()), (Some((1, 5)), "write valid TOML"));
    let many = vec![set("seed", json!(1)); 1001];
    assert!(source.edited(&many).is_err());
    assert_eq!(source.edited(&[]).map(|s| s.text), Ok(TEXT.into()));
}

#[test]
fn keys_and_values_of_very_many_parts_end_nothing() {
    for text in [
        format!("{}a = 1\n", "a.".repeat(300_000)),
        format!("[{}a]\n", "a.".repeat(300_000)),
        format!("a = {}{}\n", "[".repeat(300_000), "]".repeat(300_000)),
        format!("a = {{{}a = 1}}\n", "a.".repeat(300_000)),
    ] {
        let source = Source::new("s.toml", text, "");
        let _ = source.edited(&[set("b", json!(1))]).map(|_| ());
    }
}
