//! A writer of SVG text: the few elements the pictures need, numbers rounded, text escaped.

use std::fmt::{self, Display, Write as _};

use crate::style::INK;
use crate::text::{FAMILIES, Weight};

/// A number with at most two decimals and no trailing zeros, so that bytes are few and equal on
/// every machine. Non-finite values become 0; no picture depends on them.
#[derive(Clone, Copy)]
pub(crate) struct SvgNumber(pub(crate) f64);

impl Display for SvgNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hundredths = (self.0 * 100.0).round();
        let value = if hundredths.is_finite() { hundredths / 100.0 } else { 0.0 };
        // Adding zero turns -0 into 0.
        write!(f, "{}", value + 0.0)
    }
}

/// A rectangle in SVG pixels, y downward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rect {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) width: f64,
    pub(crate) height: f64,
}

impl Rect {
    pub(crate) fn right(&self) -> f64 {
        self.x + self.width
    }

    pub(crate) fn bottom(&self) -> f64 {
        self.y + self.height
    }

    /// Returns the same rectangle with `margin` more on every side.
    pub(crate) fn grown(&self, margin: f64) -> Self {
        Self {
            x: self.x - margin,
            y: self.y - margin,
            width: self.width + 2.0 * margin,
            height: self.height + 2.0 * margin,
        }
    }
}

/// The point of a text that stands at its position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// The style of a text; its font is always the embedded one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TextStyle<'a> {
    pub(crate) size_px: f64,
    pub(crate) anchor: Anchor,
    pub(crate) weight: Weight,
    pub(crate) fill: &'a str,
    /// Whether it reads upward instead of to the right.
    pub(crate) upward: bool,
    /// Whether it has a white rim, for text on top of a drawing.
    pub(crate) halo: bool,
}

impl TextStyle<'_> {
    /// Returns regular dark text of this size.
    pub(crate) fn new(size_px: f64, anchor: Anchor) -> Self {
        Self { size_px, anchor, weight: Weight::Regular, fill: INK, upward: false, halo: false }
    }

    /// Returns how far the baseline lies below the middle of a capital letter.
    pub(crate) fn middle_px(&self) -> f64 {
        self.size_px * 0.365
    }
}

/// An SVG picture under construction.
#[derive(Debug, Default)]
pub(crate) struct Svg {
    body: String,
}

impl Svg {
    /// Writes raw SVG; `fmt::Write` into a `String` cannot fail.
    pub(crate) fn push_raw(&mut self, element: impl Display) {
        let _ = writeln!(self.body, "{element}");
    }

    pub(crate) fn rect(&mut self, r: Rect, attributes: impl Display) {
        let Rect { x, y, width, height } = r;
        let (x, y, width, height) =
            (SvgNumber(x), SvgNumber(y), SvgNumber(width), SvgNumber(height));
        self.push_raw(format_args!(
            r#"<rect x="{x}" y="{y}" width="{width}" height="{height}" {attributes}/>"#
        ));
    }

    pub(crate) fn line(&mut self, from: (f64, f64), to: (f64, f64), attributes: impl Display) {
        let (x1, y1, x2, y2) =
            (SvgNumber(from.0), SvgNumber(from.1), SvgNumber(to.0), SvgNumber(to.1));
        self.push_raw(format_args!(
            r#"<line x1="{x1}" y1="{y1}" x2="{x2}" y2="{y2}" {attributes}/>"#
        ));
    }

    pub(crate) fn path(&mut self, data: &str, attributes: impl Display) {
        self.push_raw(format_args!(r#"<path d="{data}" {attributes}/>"#));
    }

    pub(crate) fn circle(&mut self, center: (f64, f64), radius: f64, attributes: impl Display) {
        let x = SvgNumber(center.0);
        let y = SvgNumber(center.1);
        let r = SvgNumber(radius);
        self.push_raw(format_args!(r#"<circle cx="{x}" cy="{y}" r="{r}" {attributes}/>"#));
    }

    /// Writes `text` with its baseline at `y`.
    pub(crate) fn text(&mut self, x: f64, y: f64, text: &str, style: &TextStyle<'_>) {
        let x = SvgNumber(x);
        let y = SvgNumber(y);
        let size = SvgNumber(style.size_px);
        // Ink is the default fill of the document.
        let fill =
            if style.fill == INK { String::new() } else { format!(r#" fill="{}""#, style.fill) };
        let anchor = match style.anchor {
            Anchor::Start => "",
            Anchor::Middle => r#" text-anchor="middle""#,
            Anchor::End => r#" text-anchor="end""#,
        };
        let weight = if style.weight == Weight::Bold { r#" font-weight="bold""# } else { "" };
        let halo = if style.halo { HALO } else { "" };
        let turn = if style.upward {
            format!(r#" transform="rotate(-90 {x} {y})""#)
        } else {
            String::new()
        };
        self.push_raw(format_args!(
            r#"<text x="{x}" y="{y}" font-size="{size}"{fill}{anchor}{weight}{halo}{turn}>{}</text>"#,
            EscapedText(text)
        ));
    }

    /// Opens a group that shows only the part inside `window`.
    ///
    /// The clip's name contains its place, so that names are equal only if clips are: several
    /// pictures may stand in one HTML page.
    pub(crate) fn open_clip(&mut self, window: Rect) {
        let Rect { x, y, width, height } = window;
        let id = format!(
            "clip_{}_{}_{}_{}",
            SvgNumber(x),
            SvgNumber(y),
            SvgNumber(width),
            SvgNumber(height)
        );
        self.push_raw(format_args!(r#"<clipPath id="{id}">"#));
        self.rect(window, "");
        self.push_raw(format_args!(r#"</clipPath><g clip-path="url(#{id})">"#));
    }

    /// Closes the innermost group; each opened one needs it once.
    pub(crate) fn close_group(&mut self) {
        self.push_raw("</g>");
    }

    /// Returns the whole document on a white ground; `title` is read by screen readers.
    pub(crate) fn finish(self, width_px: f64, height_px: f64, title: &str) -> String {
        let ground = r##"<rect width="100%" height="100%" fill="#FFFFFF"/>"##;
        self.document((width_px, height_px), title, ground)
    }

    /// Returns the whole document without a ground, to be drawn over another picture.
    pub(crate) fn finish_transparent(self, width_px: f64, height_px: f64) -> String {
        self.document((width_px, height_px), "", "")
    }

    fn document(self, (width_px, height_px): (f64, f64), title: &str, ground: &str) -> String {
        let (width, height) = (SvgNumber(width_px.ceil()), SvgNumber(height_px.ceil()));
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" fill=\"{INK}\" font-family=\"{FAMILIES}\" role=\"img\">\n\
             <title>{}</title>\n{ground}\n{}</svg>\n",
            EscapedText(title),
            self.body
        )
    }
}

/// Returns the size in which a document is shown.
pub(crate) fn page_size(document: &str) -> Option<[f64; 2]> {
    let (_, rest) = document.split_once("viewBox=\"0 0 ")?;
    let (width, height) = rest.split_once('"')?.0.split_once(' ')?;
    Some([width.parse().ok()?, height.parse().ok()?])
}

/// Returns a document in the middle of a page of another size in its own pixels, shown in a size of the same proportions.
pub(crate) fn on_page(document: &str, page_px: [f64; 2], shown_px: [f64; 2]) -> String {
    let Some(own_px) = page_size(document) else { return document.to_string() };
    let [width, height] = own_px.map(SvgNumber);
    let [page_width, page_height] = page_px.map(SvgNumber);
    let [shown_width, shown_height] = shown_px.map(SvgNumber);
    let [left, top] = [0, 1].map(|k| SvgNumber(-0.5 * (page_px[k] - own_px[k])));
    let own = format!("width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"");
    let page = format!(
        "width=\"{shown_width}\" height=\"{shown_height}\" viewBox=\"{left} {top} {page_width} {page_height}\""
    );
    // The ground covers the page, which begins before the document.
    let ground = "<rect width=\"100%\" height=\"100%\"";
    let page_ground =
        format!("<rect x=\"{left}\" y=\"{top}\" width=\"{page_width}\" height=\"{page_height}\"");
    document.replacen(&own, &page, 1).replacen(ground, &page_ground, 1)
}

const HALO: &str =
    r##" stroke="#FFFFFF" stroke-width="3" stroke-linejoin="round" paint-order="stroke""##;

/// Text as XML character data; characters that XML 1.0 forbids become the replacement character.
struct EscapedText<'a>(&'a str);

impl Display for EscapedText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for c in self.0.chars() {
            match c {
                '<' => f.write_str("&lt;")?,
                '>' => f.write_str("&gt;")?,
                '&' => f.write_str("&amp;")?,
                '\n' | '\t' => f.write_char(' ')?,
                '\0'..='\u{1f}' | '\u{fffe}' | '\u{ffff}' => f.write_char('\u{fffd}')?,
                c => f.write_char(c)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_never_nan() {
        let shown = |v| SvgNumber(v).to_string();
        assert_eq!(shown(1.0), "1");
        assert_eq!(shown(1.005), "1");
        assert_eq!(shown(-0.001), "0");
        assert_eq!(shown(2.346), "2.35");
        assert_eq!(shown(f64::NAN), "0");
        assert_eq!(shown(f64::INFINITY), "0");
    }

    #[test]
    fn any_text_is_well_formed_xml() {
        let mut svg = Svg::default();
        svg.text(1.0, 2.0, "a<b & \u{0} \"c\"\u{ffff}", &TextStyle::new(12.0, Anchor::Start));
        let svg = svg.finish(10.0, 10.0, "</svg>");
        let options = resvg::usvg::Options::default();
        assert!(resvg::usvg::Tree::from_str(&svg, &options).is_ok(), "{svg}");
    }
}
