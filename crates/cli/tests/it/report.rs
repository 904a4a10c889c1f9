//! `report`: a run folder of any world becomes a self-contained page, and Markdown.

use crate::browser::{assert_sound, chromium};
use crate::support::{TestFolder, names};
use serde_json::Value;

const SIX: &str = "format = 1\nworld = \"airspace\"\nname = \"Six </script> **of** them\"\n\
                   cycles = 150\n[airspace]\ndeployment = \"team\"\n\
                   [airspace.generator]\nkind = \"superconflict\"\nn = 6\n";

const CHAIN: &str = "format = 1\nworld = \"chain\"\nname = \"Wanderer\"\nseed = 5\ncycles = 400\n\
                     [[obstacles]]\nat_m = [1.5, 0.3]\nradius_m = 0.2\n\
                     [[obstacles]]\nat_m = [-1.5, 0.3]\nradius_m = 0.2\n\
                     [[chains]]\nconnectors = 12\nat_m = [0.0, 0.0]\nrod_m = 0.3\n\
                     radius_m = 0.05\n\
                     [[chains.tasks]]\nkind = \"wander\"\nspeed_m_s = 0.6\n";

/// Largest size of a page in bytes that is fit to be sent around; half of it are drawings of metrics over time.
const MAX_PAGE_BYTES: usize = 800_000;

/// Returns a place with a recorded run of each world and its report.
fn reported(scenario: &str) -> TestFolder {
    let place = TestFolder::new();
    place.write("x.toml", scenario);
    place.json(&["run", "x.toml", "--out", "r"]);
    let told = place.json(&["report", "r"]);
    assert_eq!(told["html"], "r/report.html");
    place
}

#[test]
fn a_run_of_every_world_becomes_a_page_and_its_twin() {
    for (scenario, name) in [(crate::support::SCENARIO, "small"), (SIX, "Six"), (CHAIN, "Wanderer")]
    {
        let place = reported(scenario);
        let text = place.read("r/report.md");
        assert!(text.starts_with(&format!("# {name}")), "{text}");
        for words in ["n = 1", "sidestep run r/scenario.toml", "sidestep replay r", "## Results"] {
            assert!(text.contains(words), "{words}: {text}");
        }
        let order =
            ["## Where everybody went", "## Results", "## What happened", "## What was run"];
        let places = order.map(|head| text.find(head).unwrap_or_else(|| panic!("{head}: {text}")));
        assert!(places.is_sorted(), "the picture first, then numbers: {places:?}");
        assert!(!text.contains("not complete") && !text.contains("NaN"), "{text}");
        assert!(place.read("r/report.html").len() < MAX_PAGE_BYTES, "{name}");
        let pictures = names(&place.path("r/report-figures"));
        for picture in &pictures {
            assert!(text.contains(&format!("(report-figures/{picture})")), "{picture}");
        }
        let Some(browser) = chromium() else { continue };
        let found = assert_sound(&browser, &place.path("r/report.html"));
        let is_drawn = |width: &Value| width.as_u64().is_some_and(|px| px > 100);
        assert!(
            found["pictures"]
                .as_array()
                .is_some_and(|all| all.len() == 1 && all.iter().all(is_drawn))
        );
        let captions = found["captions"].to_string();
        for caption in ["Metrics", "Metrics of every agent", "Columns"] {
            assert!(captions.contains(caption), "{captions}");
        }
        assert!(found["heads"].to_string().contains("Results"));
    }
}

#[test]
fn metrics_are_told_in_words_with_their_unit_and_meaning() {
    let text = reported(SIX).read("r/report.md");
    let row = "| m | closest approach of any two; none if no two came near each other | \
               min_separation_m |";
    assert!(text.contains("| Closest approach | ") && text.contains(row), "{text}");
    assert!(text.contains("### Metrics that stayed 0") && text.contains("| flight alone (s) |"));
}

#[test]
fn figures_for_print_have_a_size_and_words_of_their_own_and_no_title() {
    let place = reported(SIX);
    let told = place.json(&[
        "report",
        "r",
        "--figure",
        "svg,png",
        "--figure-size",
        "127x63.5",
        "--label",
        "cycle=Time in cycles",
    ]);
    assert_eq!(told["figures"], "r/report-print");
    let files = names(&place.path("r/report-print"));
    assert!(files.iter().any(|name| name.ends_with(".png")), "{files:?}");
    // The first one is that of the tracks, which has no such words.
    let mut drawings = files.iter().filter(|name| name.ends_with(".svg"));
    let svg = drawings.nth(1).expect("a figure");
    let svg = place.read(&format!("r/report-print/{svg}"));
    assert!(svg.contains("width=\"480\"") && svg.contains("Time in cycles"), "{svg}");
    assert!(!svg.contains("Events over time</text>"), "no title");
    for (option, value, says) in [
        ("--figure-size", "9x9", "30 to 500 mm"),
        ("--figure-font", "99", "4 to 40"),
        ("--label", "none such=x", "no figure has the words"),
        ("--label", "=x", "has no label text"),
    ] {
        let ended = place.run(&["report", "r", "--figure", "svg", option, value]);
        assert_eq!(ended.code(), 2, "{option} {value}");
        assert!(ended.err().contains(says), "{}", ended.err());
    }
    let ended = place.run(&["report", "r", "--figure", "svg", "--label", "none such=x"]);
    assert!(ended.err().contains("write one of `"), "{}", ended.err());
    let ended = place.run(&["report", "r", "--figure", "svg", "--figure-family", "none.ttf"]);
    assert!(ended.err().contains("there is no such file"), "{}", ended.err());
    let ended = place.run(&["report", "r", "--figure", "svg", "--figure-family", "No Such Font"]);
    assert!(ended.err().contains("path of a .ttf or .otf file"), "{}", ended.err());
    place.json(&["report", "r", "--figure", "pdf", "--figure-style", "dark", "--figure-data"]);
    let files = names(&place.path("r/report-print"));
    let with_ending = |ending: &str| files.iter().filter(|name| name.ends_with(ending)).count();
    // Those of the first report, in other formats, are still there.
    let figures = with_ending(".svg");
    assert_eq!((with_ending(".pdf"), with_ending(".csv")), (figures, figures));
    let pdf = files.iter().find(|name| name.ends_with(".pdf")).expect("a figure");
    let bytes = std::fs::read(place.path(&format!("r/report-print/{pdf}"))).expect("read");
    assert!(bytes.starts_with(b"%PDF-"));
}

#[test]
fn the_tracks_of_a_run_are_its_first_figure_for_print() {
    let place = reported(crate::support::SCENARIO);
    let size = ["--figure-size", "85x60", "--figure-dpi", "150"];
    place.json(&[&["report", "r", "--figure", "svg,png,pdf", "--figure-data"][..], &size].concat());
    let stem = "r/report-print/01-trajectories-and-where-everybody-is-at-the-end";
    let svg = place.read(&format!("{stem}.svg"));
    assert!(svg.contains("width=\"321\"") && svg.contains("class=\"trail\""), "{svg}");
    assert!(svg.contains("scale-bar") && !svg.contains("sidestep 0."), "no small print: {svg}");
    let rows = place.read(&format!("{stem}.csv"));
    assert!(rows.starts_with("body,cycle,x_m,y_m,z_m\nrobot/0,"), "{rows}");
    let png = image::open(place.path(&format!("{stem}.png"))).expect("a picture").to_rgb8();
    assert_eq!(png.width(), 502, "85 mm at 150 pixels an inch");
    assert!(png.pixels().any(|pixel| pixel.0 == [0x3C; 3]), "there are walls");
    let large = ["--figure-size", "500x500", "--figure-dpi", "1200"];
    let ended = place.run(&[&["report", "r", "--figure", "png"][..], &large].concat());
    assert!(ended.err().contains("give --figure-dpi 416"), "{}", ended.err());
    let small = ["--figure-style", "talk", "--figure-size", "30x60"];
    let ended = place.run(&[&["report", "r", "--figure", "svg"][..], &small].concat());
    assert!(ended.err().contains("give --figure-size 48x60"), "{}", ended.err());
}

#[test]
fn a_hypercube_is_drawn_as_points_in_its_box_and_has_no_baseline() {
    let place = TestFolder::new();
    let sweep = "format = 1\nscenario = \"c.toml\"\nname = \"cube\"\nreplicates = 1\n\
                 metrics = [\"rotations\"]\n[set]\ncycles = 40\n\
                 [latin_hypercube]\nsamples = 12\nseed = 1\n[latin_hypercube.range]\n\
                 chain.dt_s = { low = 0.01, high = 0.02 }\n\
                 chains.connectors = { low = 8, high = 12, integer = true }\n";
    place.write("c.toml", CHAIN);
    place.write("cube.toml", sweep);
    place.json(&["sweep", "cube.toml", "--out", "d"]);
    place.json(&["report", "d"]);
    let text = place.read("d/report.md");
    assert!(text.contains("### What the metrics depend on") && !text.contains("against"), "{text}");
    assert_eq!(text.matches("where the samples are](").count(), 1, "{text}");
}

#[test]
fn a_picture_of_thousands_of_balls_stays_small() {
    let place = TestFolder::new();
    let scenario = "format = 1\nworld = \"chain\"\ncycles = 4\n[chain]\ndimensions = 3\n\
                    [[fields]]\nlo_m = [-9.0, -9.0, -9.0]\nhi_m = [9.0, 9.0, 9.0]\npart = 0.1\n\
                    radius_m = 0.3\n[[chains]]\nconnectors = 12\nat_m = [0.0, 0.0, 0.0]\nrod_m = 0.3\n\
                    [[chains.tasks]]\nkind = \"wander\"\n";
    place.write("balls.toml", scenario);
    place.json(&["run", "balls.toml", "--out", "r"]);
    place.json(&["report", "r"]);
    assert!(place.read("r/report.html").len() < MAX_PAGE_BYTES);
}

#[test]
fn the_same_run_gives_the_same_report_and_leaves_no_half_file() {
    let place = reported(SIX);
    let first = (place.read("r/report.html"), place.read("r/report.md"));
    place.json(&["report", "r"]);
    assert_eq!((place.read("r/report.html"), place.read("r/report.md")), first);
    let left = names(&place.path("r"));
    assert!(!left.iter().any(|name| name.ends_with(".partial")), "{left:?}");
    // The run can still be read, replayed and checked.
    assert_eq!(place.run(&["replay", "r", "--cycle", "20"]).code(), 0);
}

#[test]
fn a_run_that_was_stopped_is_marked_and_says_how_to_go_on() {
    let place = TestFolder::new();
    place.json(&["run", "s.toml", "--out", "r"]);
    let whole = place.read("r/run.json");
    let running = whole.replace("\"complete\"", "\"running\"");
    place.write("r/run.json", sidestep_record::seal_again(&running));
    place.json(&["report", "r", "--out", "page.html"]);
    let text = place.read("page.md");
    assert!(text.contains("> **This run is not complete.**"), "{text}");
    assert!(text.contains("`sidestep resume r`"), "{text}");
    assert!(place.path("page-figures").is_dir() && !place.path("r/report.html").exists());
}

#[test]
fn a_sweep_becomes_a_page_with_intervals_figures_and_pictures() {
    let place = crate::sweep::place();
    place.json(&["sweep", "sweep.toml", "--out", "d"]);
    place.json(&["report", "d"]);
    let text = place.read("d/report.md");
    let wanted = [
        "# crowds",
        "18 runs of 6 variants",
        "## Results",
        "## Share of the floor covered",
        "| metric | variant | mean | difference | p (Holm) | n |",
        "## How the numbers were made",
    ];
    assert!(text.find("## Results") < text.find("## What was run"), "results come first");
    let footnote = "by Student's t and by the bootstrap";
    assert_eq!(text.matches(footnote).count(), 1, "a footnote stands once");
    for words in wanted {
        assert!(text.to_lowercase().contains(&words.to_lowercase()), "{words}: {text}");
    }
    assert!(text.contains("sidestep run d/variants/0000/scenario.toml --seed 5"), "{text}");
    assert!(place.read("d/report.html").len() < MAX_PAGE_BYTES);
    let Some(browser) = chromium() else { return };
    let found = assert_sound(&browser, &place.path("d/report.html"));
    assert_eq!(
        found["pictures"].as_array().map(Vec::len),
        Some(4),
        "a run of each of four variants"
    );
    let captions = found["captions"].to_string();
    assert!(captions.contains("Variants") && captions.contains("against"), "{captions}");
}

#[test]
fn a_sweep_that_is_not_done_is_marked() {
    let place = crate::sweep::place();
    place.json(&["sweep", "plan", "sweep.toml", "--out", "d"]);
    assert_eq!(place.run(&["report", "d"]).code(), 2, "there is nothing to report yet");
    place.json(&["sweep", "run", "d", "--shard", "0/3"]);
    place.json(&["report", "d"]);
    let text = place.read("d/report.md");
    assert!(text.contains("**This sweep is not done.** 6 of at most 18 runs"), "{text}");
}

#[test]
fn figures_for_print_that_cannot_be_made_leave_no_page() {
    let place = reported(SIX);
    std::fs::remove_file(place.path("r/report.html")).expect("it was there");
    for (wrong, told) in [
        (["--label", "nope=x"], "no figure has the words `nope`"),
        (["--figure-size", "60xfoox60"], "`60xfoox60` is no size"),
        (["--figure-size", "60x60x"], "`60x60x` is no size"),
    ] {
        let ended = place.run(&[&["report", "r", "--figure", "svg"][..], &wrong].concat());
        assert_eq!(ended.code(), 2, "{wrong:?}");
        assert!(ended.err().contains(told), "{}", ended.err());
        assert!(!place.path("r/report.html").exists(), "{wrong:?}");
    }
}

#[test]
fn what_is_no_run_or_no_page_is_refused_and_nothing_is_written() {
    let place = TestFolder::new();
    for args in [
        &["report", "."][..],
        &["report", "nowhere"],
        &["report", ".", "--out", "report.md"],
        &["report", "s.toml"],
    ] {
        let ended = place.run(args);
        assert_eq!((ended.code(), ended.out().as_str()), (2, ""), "{args:?}: {}", ended.err());
    }
    let broken = reported(SIX);
    broken.write("r/summary.json", "{ \"metrics\": ");
    let ended = broken.run(&["report", "r", "--out", "x.html"]);
    assert_eq!(ended.code(), 2);
    assert!(ended.err().contains("summary.json"), "{}", ended.err());
    assert!(!broken.path("x.html").exists());
}
