//! Properties that both renderers guarantee for every document.

use super::*;
use sidestep_document::claim::{Claim, Verdict, verdict_summary};
use sidestep_document::document::{Picture, Text};
use sidestep_document::figure::{Point, RunLegend, Scale, SlotStats};
use sidestep_document::{Figure, FigureKind, Series, Table};

/// Text with the markup of each language.
const HOSTILE: &str = "</script><img src=x onerror=alert(1)> | `a` **b** [c](d) & \"e\"";

/// A document with every block, and [`HOSTILE`] words wherever there are words.
fn full_document() -> Document {
    let mut document = Document::new(HOSTILE, Text::from(HOSTILE));
    document.warning(Text::from_markup("**Mind** the `gap`."));
    document
        .section("Claims")
        .push(Block::Claims(vec![claim("C-1", Some("3 m")), claim("C-2", None)]));
    document.section(HOSTILE).paragraph(HOSTILE).commands("Again", "sidestep run a ``` b");
    document.push(Block::Facts(vec![("seed".into(), Text::code(HOSTILE))]));
    let mut table = Table::new(HOSTILE, "Note with `code`.", &["name", "value"]);
    table.push_row([HOSTILE.into(), "1.5".into()]);
    table.push_row(["short".into()]);
    document.section("Numbers").tables([table]).figures(all_figure_kinds());
    let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"9\" height=\"9\"></svg>".into();
    let (title, caption) = (HOSTILE.into(), "Small print.".into());
    document.section("Pictures").pictures([Picture { title, caption, svg }]);
    document
}

fn claim(id: &'static str, papers_figure: Option<&'static str>) -> Claim {
    Claim {
        id,
        paper: HOSTILE,
        papers_figure,
        ours: "2.9 [2.8, 3.1] n=4".into(),
        verdict: Verdict::Refuted,
        reason: "by the rule `r`".into(),
    }
}

fn all_figure_kinds() -> Vec<Figure> {
    let categories = vec![HOSTILE.to_string(), "b".into()];
    let kinds = [
        FigureKind::Lines,
        FigureKind::Bands,
        FigureKind::Points,
        FigureKind::Ways,
        FigureKind::Bars { categories: categories.clone() },
        FigureKind::Dots { categories: categories.clone() },
        FigureKind::Steps,
        FigureKind::Forest {
            rows: categories.clone(),
            texts: vec![categories.clone()],
            words: Default::default(),
        },
        FigureKind::Runs {
            slots: vec![SlotStats { mean: Some(2.0), ..SlotStats::default() }],
            is_joined: false,
            has_zero_line: false,
            has_bars: true,
            legend: RunLegend::default(),
        },
        FigureKind::Heat { columns: categories, value_label: HOSTILE.into() },
        FigureKind::Front { corners: vec![(0.0, 1.0), (1.0, 1.0)] },
    ];
    let point =
        |x: f64, y: f64| Point::new(x, y).with_interval(Some((0.5 * y, 2.0 * y))).with_runs(4);
    let series = Series { name: HOSTILE.into(), points: vec![point(0.0, 1.0), point(1.0, 30.0)] };
    let figure = |kind| Figure {
        title: "A figure".into(),
        note: "Bars are intervals.".into(),
        x_label: HOSTILE.into(),
        y_label: "value".into(),
        y_scale: Scale::Log,
        kind,
        series: vec![series.clone()],
        ..Figure::default()
    };
    kinds.map(figure).into()
}

/// The page without the scripts at its end.
fn before_scripts(html: &str) -> &str {
    html.split("<script>").next().unwrap()
}

#[test]
fn the_same_document_gives_the_same_bytes() {
    assert_eq!(render(&full_document(), "figures"), render(&full_document(), "figures"));
}

#[test]
fn every_figure_and_picture_is_a_file_and_is_shown_by_both() {
    let RenderedReport { html, markdown, pictures } = render(&full_document(), "figures").unwrap();
    assert_eq!(pictures.len(), 12);
    assert_eq!(pictures[0].stem, "01-a-figure");
    for picture in &pictures {
        assert!(picture.svg.contains("<svg"), "{}", picture.stem);
        assert!(markdown.contains(&format!("(figures/{}.svg)", picture.stem)), "{markdown}");
    }
    let own = before_scripts(&html);
    assert_eq!(own.matches("data:image/svg+xml").count(), 1);
    assert_eq!(own.matches("<figure class=\"plot").count(), 11);
    assert_eq!(own.matches("<svg class=\"chart\" aria-label=").count(), 11);
    assert_eq!(own.matches("application/json").count(), 11);
}

#[test]
fn a_folded_figure_shows_its_title_alone() {
    let mut document = Document::new("T", "");
    document.figures(all_figure_kinds().into_iter().map(Figure::folded));
    let html = render(&document, "figures").unwrap().html;
    assert_eq!(
        html.matches("<details class=\"chart-fold\"><summary>A figure</summary>").count(),
        11
    );
    assert!(!html.contains("<figcaption>"));
}

#[test]
fn words_stay_words_in_html() {
    let html = render(&full_document(), "figures").unwrap().html;
    let own = before_scripts(&html);
    assert!(!own.contains("<img src=x") && !own.contains("</script><img"));
    // Of scripts: the data of each figure, that of their marks and the page's own.
    assert_eq!(html.matches("</script>").count(), 11 + 2);
    assert!(own.contains("&lt;/script&gt;&lt;img src=x onerror=alert(1)&gt;"));
    assert!(own.contains("<strong>Mind</strong> the <code>gap</code>"));
}

#[test]
fn words_stay_words_in_markdown() {
    let text = render(&full_document(), "figures").unwrap().markdown;
    let escaped =
        "&lt;/script>&lt;img src=x onerror=alert(1)> | \\`a\\` \\*\\*b\\*\\* [c\\](d) &amp; \"e\"";
    assert!(
        text.starts_with(&format!("# {escaped}\n\n{escaped}\n\n> **Mind** the `gap`.\n\n")),
        "{text}"
    );
    assert!(text.contains("\n````sh\nsidestep run a ``` b\n````\n"), "{text}");
    let row = format!("\n| {} | 1.5 |\n| short |  |\n", escaped.replace('|', "\\|"));
    assert!(text.contains(&row), "{text}");
}

#[test]
fn claims_stand_with_the_papers_figure_beside_ours_and_a_verdict_in_words() {
    let RenderedReport { html, markdown, .. } = render(&full_document(), "figures").unwrap();
    assert!(
        markdown.contains("| 3 m | 2.9 [2.8, 3.1] n=4 | **refuted** | by the rule `r` |"),
        "{markdown}"
    );
    assert!(markdown.contains("| none | 2.9 [2.8, 3.1]"), "{markdown}");
    assert!(html.contains("<td>3 m</td><td>2.9 [2.8, 3.1] n=4</td>"));
    assert_eq!(html.matches("class=\"badge refuted\"").count(), 3, "two claims and their count");
}

/// The sentence above a report, the badges above its claims and those beside them say the same.
#[test]
fn the_headline_counts_the_same_words_as_the_badges() {
    let verdicts: Vec<Verdict> =
        (0..).zip(Verdict::ALL).flat_map(|(k, verdict)| vec![verdict; k + 1]).collect();
    let claims: Vec<Claim> =
        verdicts.iter().map(|&verdict| Claim { verdict, ..claim("C", None) }).collect();
    let lead = verdict_summary(&claims);
    let mut document = Document::new("T", lead.clone());
    document.section("Claims").push(Block::Claims(claims));
    let RenderedReport { html, markdown, .. } = render(&document, "figures").unwrap();
    for (k, verdict) in (0..).zip(Verdict::ALL) {
        let (word, count): (&str, usize) = (verdict.name(), k + 1);
        assert!(lead.contains(&format!("{count} {word}")), "{lead}");
        assert!(
            html.contains(&format!("{word}</span> <strong>{count}</strong>")),
            "{word}: {html}"
        );
        assert_eq!(html.matches(&format!("class=\"badge {word}\"")).count(), count + 1);
        assert_eq!(markdown.matches(&format!("| **{word}** |")).count(), count);
    }
    assert!(html.contains(&lead) && markdown.contains(&lead));
}

#[test]
fn a_page_is_accessible_and_forbids_the_network() {
    let html = render(&full_document(), "figures").unwrap().html;
    let own = before_scripts(&html);
    for part in [
        "<html lang=\"en\">",
        "default-src 'none'",
        "<meta name=\"description\"",
        "<meta name=\"viewport\"",
        "<nav class=\"contents\" aria-label=\"Contents\">",
        "<th scope=\"col\" class=\"number\">value</th>",
        "<th scope=\"row\">short</th>",
        "<caption>",
    ] {
        assert!(own.contains(part), "{part}: {own}");
    }
    assert_eq!(own.matches("<h1>").count(), 1);
    assert_eq!(own.matches("<img ").count(), own.matches(" alt=\"").count());
}

#[test]
fn bounds_stand_among_the_numbers_and_words_do_not() {
    let mut document = Document::new("T", "");
    let mut table = Table::new("Results", "", &["metric", "p", "verdict"]);
    table.push_row(["a", "0.5", "held"].map(String::from));
    table.push_row(["b", "< 0.0001", "-"].map(String::from));
    document.section("Results").tables([table]);
    let html = render(&document, "figures").unwrap().html;
    assert!(html.contains("<th scope=\"col\" class=\"number\">p</th>"), "{html}");
    assert!(html.contains("<td class=\"words\">held</td>"), "{html}");
    // Section and table are two landmarks.
    assert!(html.contains("aria-label=\"Table: Results\""), "{html}");
}

#[test]
fn a_report_without_figures_carries_no_script_for_them() {
    let rendered = render(&Document::new("T", "Nothing more."), "figures").unwrap();
    assert!(rendered.html.len() < 20_000, "{}", rendered.html.len());
    assert!(!rendered.html.contains("pointermove"));
    assert_eq!(rendered.markdown, "# T\n\nNothing more.\n");
    assert!(rendered.pictures.is_empty());
}

#[test]
fn titles_become_parts_of_file_names() {
    assert_eq!(slug("Trip times, by regime"), "trip-times-by-regime");
    assert_eq!(slug("1/2 (s)"), "1-2-s");
}

#[test]
fn bands_of_one_value_of_nothing_and_of_negative_values_are_drawn() {
    let rounded = 0.1 + 0.2;
    let runs = [
        vec![],
        vec![(0.0, 0.3), (1.0, rounded)],
        vec![(5.0, 1.0)],
        vec![(0.0, -3.0), (9.0, -1.0)],
    ];
    for values in runs {
        let points =
            values.iter().map(|&(x, y)| Point::new(x, y).with_interval(Some((y - 1e-17, y))));
        let series = vec![Series { name: "a".into(), points: points.collect() }];
        let figure = Figure { kind: FigureKind::Bands, series, ..Figure::default() };
        let mut document = Document::new("T", "");
        document.figures([figure]);
        assert!(render(&document, "figures").is_ok(), "{values:?}");
    }
}
