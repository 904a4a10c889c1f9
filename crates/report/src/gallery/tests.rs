//! The page of the runs of a sweep.

use super::*;

fn value(number: f64, mark: Option<bool>) -> GalleryValue {
    let words = "5 ranges beyond the quartiles <of its variant>".to_string();
    let mark = mark.map(|is_high| GalleryMark { is_high, words, distance: number.abs() });
    GalleryValue { text: number.to_string(), number: Some(number), mark }
}

fn run(variant: usize, seed: u64, hops: GalleryValue) -> GalleryRun {
    GalleryRun { variant, seed, values: vec![hops, value(0.0, None)], ..GalleryRun::default() }
}

/// Two variants with two seeds, one of which failed; the second run is an outlier with a replay.
fn gallery() -> Gallery {
    let metric = |label: &str| GalleryMetric { label: label.into(), meaning: "counted".into() };
    let outlier = GalleryRun {
        page: Some("runs/000001.html".into()),
        picture: Some("data:image/png;base64,AA==".into()),
        ..run(0, 8, value(90.0, Some(true)))
    };
    let failed =
        GalleryRun { variant: 1, seed: 8, failure: "no <start>".into(), ..GalleryRun::default() };
    Gallery {
        title: "</title><script>alert(1)</script>".into(),
        lead: Text::from("4 runs"),
        rule: "far from the others".into(),
        metrics: vec![metric("hops"), metric("losses & \"lows\"")],
        variants: vec!["n=1".into(), "<img src=x onerror=alert(2)>".into()],
        runs: vec![run(0, 7, value(1.0, None)), outlier, run(1, 7, value(4.5, None)), failed],
        ..Gallery::default()
    }
}

#[test]
fn every_run_is_in_the_matrix_and_in_the_table_and_those_with_a_replay_open_it() {
    let page = gallery_page(&gallery());
    let matrix = &page[page.find("<table>").expect("a matrix")..];
    let matrix = &matrix[..matrix.find("</table>").expect("its end")];
    assert_eq!(matrix.matches("<td").count(), 4);
    assert_eq!(matrix.matches("data-run=").count(), 3);
    assert!(matrix.contains("<a href=\"runs/000001.html\">90</a>"), "{matrix}");
    assert!(matrix.contains(">failed<") && matrix.contains("\u{25b2}"), "{matrix}");
    let rows = &page[page.find("class=\"sortable\"").expect("a table")..];
    assert_eq!(
        rows.matches("<tr data-").count() + rows.matches("<tr><th scope=\"row\"").count(),
        4
    );
    assert_eq!(rows.matches("<tr data-outlier data-replay>").count(), 1);
    assert_eq!(page.matches("runs/000001.html").count(), 3, "matrix, picture and table");
}

#[test]
fn names_are_text_and_the_policy_lets_nothing_out() {
    let page = gallery_page(&gallery());
    assert!(!page.contains("<script>alert") && !page.contains("<img src=x"));
    assert!(page.contains("&lt;img src=x onerror=alert(2)&gt;"));
    assert!(page.contains("default-src 'none'") && !page.contains("http://"));
    assert!(!page.contains("https://"));
}

#[test]
fn levels_are_places_between_the_smallest_and_the_largest_value() {
    let page = gallery_page(&gallery());
    assert!(page.contains("style=\"--level:0\"") && page.contains("style=\"--level:1\""));
    assert!(page.contains("--level:0.039"), "(4.5 - 1) / (90 - 1)");
}

#[test]
fn what_has_no_room_is_counted() {
    let runs = (0..70).map(|seed| run(0, seed, value(1.0, None))).collect();
    let page = gallery_page(&Gallery { runs, ..gallery() });
    assert!(page.contains("10 more seeds are not in this matrix."));
    let runs = (0..5100).map(|seed| run(0, seed, value(1.0, None))).collect::<Vec<_>>();
    let many = Gallery { runs: [runs, gallery().runs[1..2].to_vec()].concat(), ..gallery() };
    let page = gallery_page(&many);
    assert!(page.contains("101 more runs are not listed here"));
    assert!(page.contains("<tr data-outlier data-replay>"), "outliers are listed first of all");
}
