//! Figures, whose marks tell their values, and pictures.

use super::tables;
use crate::PagePicture;
use maud::{Markup, PreEscaped, html};
use serde_json::json;
use sidestep_document::document::Picture;
use sidestep_document::{Figure, FigureKind, Table};
use sidestep_draw::{DARK_COLORS, Spot};

/// Maximum number of points of a figure with a table of its numbers: a longer table helps no reader, and the numbers are in
/// the page as JSON anyway.
const MAX_TABLE_ROWS: usize = 200;

pub(super) fn figure(figure: &Figure, id: &str, drawn: Option<&PagePicture>) -> Markup {
    let chart = html! { @if let Some(drawn) = drawn { (chart(figure, drawn, id)) } };
    let class = if has_full_width(figure) { "plot full" } else { "plot" };
    html! {
        figure class=(class) id=(id) {
            @if figure.is_folded {
                details .chart-fold { summary { (figure.title) } (chart) }
            } @else {
                figcaption { (figure.title) }
                (chart)
            }
        }
    }
}

/// Returns whether a figure has a row of the page for itself: names and words stand beside its data.
fn has_full_width(figure: &Figure) -> bool {
    matches!(figure.kind, FigureKind::Forest { .. })
}

/// Returns the drawing of a figure, what its marks say where the pointer is, and its numbers.
fn chart(figure: &Figure, drawn: &PagePicture, id: &str) -> Markup {
    let spots: Vec<_> = drawn.spots.iter().map(spot_json).collect();
    let data = json!({ "figure": figure, "spots": spots });
    html! {
        // What scrolls on a telephone must be reached by keyboard, too.
        @let is_full = has_full_width(figure);
        div .canvas tabindex=[is_full.then_some("0")] role=[is_full.then_some("region")]
            aria-label=[is_full.then(|| format!("Figure: {}", figure.title))] { (inline_svg(&drawn.file.svg, &alt_text(figure), id)) }
        script type="application/json" { (PreEscaped(safe_json(&data))) }
        @if !figure.note.is_empty() { p .note { (figure.note) } }
        @if let Some(numbers) = numbers_table(figure) {
            details .numbers {
                summary { "Numbers" }
                (tables::wide_table(&format!("numbers of {}", figure.title), tables::grid(&numbers, None, None)))
            }
        }
    }
}

/// Returns the style of figures on a dark ground: a drawing is written once, in the colors for white paper.
pub(super) fn dark_style() -> String {
    let mut rules = String::new();
    for (light, dark) in DARK_COLORS {
        for property in ["fill", "stroke"] {
            let selector = format!("[{property}=\"{light}\"]");
            rules += &format!(".chart{selector},.chart {selector}{{{property}:{dark}}}");
        }
    }
    format!("@media screen and (prefers-color-scheme:dark){{{rules}}}")
}

/// Returns a mark as its place in the drawing, and the numbers of its series and its point.
fn spot_json(spot: &Spot) -> serde_json::Value {
    let tenths = |px: f64| (px * 10.0).round() / 10.0;
    json!([tenths(spot.x_px), tenths(spot.y_px), spot.series, spot.point])
}

/// Returns a drawing as a part of the page. Its own title would be shown beside the values of its marks, so it becomes
/// the name of the drawing. Names of clips are those of the figure alone: of two equal names a browser takes the first,
/// which clips nothing where its figure is folded.
fn inline_svg(svg: &str, alt: &str, id: &str) -> Markup {
    // Escaped by maud.
    let alt = html! { (alt) }.into_string();
    let (head, rest) = svg.split_once("<title>").unwrap_or((svg, ""));
    let body = rest.split_once("</title>").map_or(rest, |(_, body)| body);
    let head = head.replacen("<svg ", &format!("<svg class=\"chart\" aria-label=\"{alt}\" "), 1);
    let drawing = format!("{head}{body}")
        .replace("id=\"clip_", &format!("id=\"{id}_clip_"))
        .replace("url(#clip_", &format!("url(#{id}_clip_"));
    // No line ends are needed between elements.
    html! { (PreEscaped(drawing.replace(">\n", ">"))) }
}

pub(super) fn picture(picture: &Picture, id: &str, replay: Option<&str>) -> Markup {
    let drawing = image(&picture.svg, &format!("{}. {}", picture.title, picture.caption));
    html! {
        figure .picture id=(id) {
            figcaption { (picture.title) }
            @match replay {
                Some(replay) => a href=(replay) { (drawing) },
                None => (drawing),
            }
            @if !picture.caption.is_empty() { p .note { (picture.caption) } }
        }
    }
}

/// Returns the description of a figure for screen readers.
fn alt_text(figure: &Figure) -> String {
    let names: Vec<&str> =
        figure.series.iter().map(|s| s.name.as_str()).filter(|n| !n.is_empty()).collect();
    let list = if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) };
    format!("{}. {} over {}{list}.", figure.title, figure.y_label, figure.x_label)
}

/// Returns the figure's points as a table, if they are few.
fn numbers_table(figure: &Figure) -> Option<Table> {
    let count: usize = figure.series.iter().map(|s| s.points.len()).sum();
    if count > MAX_TABLE_ROWS || figure.kind == FigureKind::Ways {
        return None;
    }
    let mut table = Table::new("", "", &["series"]);
    let [x_label, y_label] = figure.column_labels();
    table.columns.push(x_label.into());
    table.columns.push(y_label.into());
    table.columns.extend(["from", "to", "n"].map(String::from));
    for series in &figure.series {
        for point in &series.points {
            let x = match figure.position_names() {
                Some(names) => names.get(point.x as usize).cloned().unwrap_or_default(),
                None => point.x.to_string(),
            };
            let (low, high) = match point.interval {
                Some((low, high)) => (format_short(low), format_short(high)),
                None => Default::default(),
            };
            let n = point.n.map_or(String::new(), |n| n.to_string());
            table.push_row([series.name.clone(), x, format_short(point.y), low, high, n]);
        }
    }
    Some(table)
}

/// Formats a value with six digits, which distinguish any two measurements.
fn format_short(value: f64) -> String {
    let digits = format!("{value:.5e}").parse::<f64>();
    digits.map_or_else(|_| value.to_string(), |rounded| rounded.to_string())
}

/// Returns JSON for a script: no text in it can end the script.
pub(crate) fn safe_json(value: &serde_json::Value) -> String {
    value.to_string().replace('<', "\\u003c").replace('\u{2028}', "\\u2028")
}

/// Returns an image whose address is an SVG.
fn image(svg: &str, alt: &str) -> Markup {
    // Escaped by maud.
    let alt = html! { (alt) }.into_string();
    // In single quotes, of which pictures have few: every double one would take three bytes.
    html! { (PreEscaped(format!("<img src='{}' alt=\"{alt}\">", data_uri(svg)))) }
}

/// Returns an SVG as the address of an image, for an attribute in single quotes. Addresses take marks of
/// HTML as they are, and so do attributes, so that only characters that would end either are written in
/// another way.
fn data_uri(svg: &str) -> String {
    let mut address = String::with_capacity(svg.len() + svg.len() / 8);
    address.push_str("data:image/svg+xml;charset=utf-8,");
    for c in svg.chars() {
        match c {
            '%' => address.push_str("%25"),
            '#' => address.push_str("%23"),
            '\'' => address.push_str("%27"),
            '&' => address.push_str("%26"),
            // None is needed between elements.
            '\n' if address.ends_with('>') => {}
            '\n' => address.push(' '),
            _ => address.push(c),
        }
    }
    address
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_text_ends_the_script_that_it_stands_in() {
        let json = safe_json(&json!({ "name": "</script><!--\u{2028}" }));
        assert_eq!(json, r#"{"name":"\u003c/script>\u003c!--\u2028"}"#);
        assert_eq!(
            serde_json::from_str::<serde_json::Value>(&json).unwrap()["name"],
            "</script><!--\u{2028}"
        );
    }

    #[test]
    fn nothing_in_a_picture_ends_its_address_or_its_attribute() {
        let image = image("<a b=\"#1\">50 % &amp; 'c'</a>\n", "\"A\" & <b>").into_string();
        assert_eq!(
            image,
            "<img src='data:image/svg+xml;charset=utf-8,<a b=\"%231\">50 %25 %26amp; \
             %27c%27</a>' alt=\"&quot;A&quot; &amp; &lt;b&gt;\">"
        );
    }
}
