//! Conversion of SVG to PDF: one page as large as the picture, its shapes and its letters as outlines.
//!
//! Letters are outlines, as publishers ask for: a file without fonts looks the same everywhere.

use crate::error::DrawError;
use crate::raster::parse;
use crate::text::Fonts;
use flate2::{Compression, write::ZlibEncoder};
use pdf_writer::types::{LineCapStyle, LineJoinStyle};
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref, TextStr};
use resvg::tiny_skia::{self, PathSegment, Transform};
use resvg::usvg::{self, FillRule, Group, Node, Paint, PaintOrder, Path};
use std::io::Write;

/// Points of PDF, 72 of an inch, per pixel of SVG, 96 of an inch.
const PT_PER_PX: f32 = 0.75;

/// Converts an SVG picture to a PDF file of one page in its size, e.g. for a paper in LaTeX. Shapes, letters, clips and
/// opacities are converted; charts and pictures of this crate have no others. The bytes depend only on the arguments.
///
/// # Errors
/// [`DrawError::Svg`] if `svg` is no SVG.
pub fn to_pdf(svg: &str, title: &str, fonts: &Fonts) -> Result<Vec<u8>, DrawError> {
    let tree = parse(svg, fonts)?;
    let size = tree.size();
    let (width, height) = (size.width() * PT_PER_PX, size.height() * PT_PER_PX);
    // The origin of a page is its lower left corner.
    let to_page = Transform::from_row(PT_PER_PX, 0.0, 0.0, -PT_PER_PX, 0.0, height);
    let mut page = PageContent { content: Content::new(), to_page, opacities: Vec::new() };
    page.group(tree.root(), 1.0);
    let PageContent { content, opacities, .. } = page;
    let stream = compress(&content.finish())?;
    Ok(file(&stream, (width, height), &opacities, title))
}

/// Returns the whole file: the page, its content, and what that refers to.
fn file(
    stream: &[u8],
    (width, height): (f32, f32),
    opacities: &[Opacities],
    title: &str,
) -> Vec<u8> {
    let [catalog, pages, page_id, content_id, info] = [1, 2, 3, 4, 5].map(Ref::new);
    let state_id = |k: usize| Ref::new(6 + k as i32);
    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page_id]).count(1);
    let mut page = pdf.page(page_id);
    page.media_box(Rect::new(0.0, 0.0, width, height)).parent(pages).contents(content_id);
    let mut resources = page.resources();
    let mut states = resources.ext_g_states();
    for k in 0..opacities.len() {
        states.pair(Name(Opacities::name(k).as_bytes()), state_id(k));
    }
    states.finish();
    resources.finish();
    page.finish();
    for (k, Opacities { fill, stroke }) in opacities.iter().enumerate() {
        pdf.ext_graphics(state_id(k)).non_stroking_alpha(*fill).stroking_alpha(*stroke);
    }
    pdf.stream(content_id, stream).filter(Filter::FlateDecode);
    let mut document = pdf.document_info(info);
    document.title(TextStr(title)).producer(TextStr("sidestep"));
    document.finish();
    pdf.finish()
}

fn compress(content: &[u8]) -> Result<Vec<u8>, DrawError> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    let written = encoder.write_all(content).and_then(|()| encoder.finish());
    written.map_err(|error| DrawError::Pdf(error.to_string()))
}

/// The opacities of a shape.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Opacities {
    fill: f32,
    stroke: f32,
}

impl Opacities {
    /// Returns the name by which a page refers to them.
    fn name(index: usize) -> String {
        format!("o{index}")
    }
}

/// The content of a page under construction.
struct PageContent {
    content: Content,
    to_page: Transform,
    /// All that occur; the first use of a pair adds it.
    opacities: Vec<Opacities>,
}

impl PageContent {
    fn group(&mut self, group: &Group, opacity: f32) {
        let opacity = opacity * group.opacity().get();
        self.content.save_state();
        if let Some(clip) = group.clip_path() {
            self.clip(clip, group.abs_transform());
        }
        for node in group.children() {
            match node {
                Node::Group(inside) => self.group(inside, opacity),
                Node::Path(path) if path.is_visible() => self.path(path, opacity),
                Node::Text(text) => self.group(text.flattened(), opacity),
                // No picture of ours has an image in it.
                Node::Path(_) | Node::Image(_) => {}
            }
        }
        self.content.restore_state();
    }

    /// Limits all that follows to the shapes of a clip.
    fn clip(&mut self, clip: &usvg::ClipPath, place: Transform) {
        let to_page = self.to_page.pre_concat(place).pre_concat(clip.transform());
        for node in clip.root().children() {
            if let Node::Path(path) = node {
                self.outline(path.data(), to_page.pre_concat(path.abs_transform()));
            }
        }
        self.content.clip_nonzero().end_path();
    }

    fn path(&mut self, path: &Path, opacity: f32) {
        let to_page = self.to_page.pre_concat(path.abs_transform());
        let opacities = Opacities {
            fill: opacity * path.fill().map_or(1.0, |fill| fill.opacity().get()),
            stroke: opacity * path.stroke().map_or(1.0, |stroke| stroke.opacity().get()),
        };
        self.content.save_state();
        self.set_opacities(opacities);
        if path.paint_order() == PaintOrder::FillAndStroke {
            self.fill(path, to_page);
            self.stroke(path, to_page);
        } else {
            self.stroke(path, to_page);
            self.fill(path, to_page);
        }
        self.content.restore_state();
    }

    fn set_opacities(&mut self, opacities: Opacities) {
        if (opacities.fill, opacities.stroke) == (1.0, 1.0) {
            return;
        }
        let known = self.opacities.iter().position(|other| *other == opacities);
        let index = known.unwrap_or_else(|| {
            self.opacities.push(opacities);
            self.opacities.len() - 1
        });
        self.content.set_parameters(Name(Opacities::name(index).as_bytes()));
    }

    fn fill(&mut self, path: &Path, to_page: Transform) {
        let Some(fill) = path.fill() else { return };
        let Some([red, green, blue]) = color(fill.paint()) else { return };
        self.content.set_fill_rgb(red, green, blue);
        self.outline(path.data(), to_page);
        match fill.rule() {
            FillRule::NonZero => self.content.fill_nonzero(),
            FillRule::EvenOdd => self.content.fill_even_odd(),
        };
    }

    fn stroke(&mut self, path: &Path, to_page: Transform) {
        let Some(stroke) = path.stroke() else { return };
        let Some([red, green, blue]) = color(stroke.paint()) else { return };
        // Pictures are scaled alike in both directions.
        let scale = to_page.get_scale().0;
        self.content.set_stroke_rgb(red, green, blue);
        self.content.set_line_width(stroke.width().get() * scale);
        self.content.set_line_cap(match stroke.linecap() {
            usvg::LineCap::Butt => LineCapStyle::ButtCap,
            usvg::LineCap::Round => LineCapStyle::RoundCap,
            usvg::LineCap::Square => LineCapStyle::ProjectingSquareCap,
        });
        self.content.set_line_join(match stroke.linejoin() {
            usvg::LineJoin::Round => LineJoinStyle::RoundJoin,
            usvg::LineJoin::Bevel => LineJoinStyle::BevelJoin,
            usvg::LineJoin::Miter | usvg::LineJoin::MiterClip => LineJoinStyle::MiterJoin,
        });
        self.content.set_miter_limit(stroke.miterlimit().get());
        let dashes = stroke.dasharray().unwrap_or_default().iter().map(|length| length * scale);
        self.content.set_dash_pattern(dashes, stroke.dashoffset() * scale);
        self.outline(path.data(), to_page);
        self.content.stroke();
    }

    /// Writes the segments of a path; curves of the second degree become those of the third, which PDF has.
    fn outline(&mut self, data: &tiny_skia::Path, to_page: Transform) {
        let Some(placed) = data.clone().transform(to_page) else { return };
        let mut at = tiny_skia::Point::zero();
        for segment in placed.segments() {
            match segment {
                PathSegment::MoveTo(p) => {
                    self.content.move_to(p.x, p.y);
                    at = p;
                }
                PathSegment::LineTo(p) => {
                    self.content.line_to(p.x, p.y);
                    at = p;
                }
                PathSegment::QuadTo(control, p) => {
                    let near = |end: f32, control: f32| end + (control - end) * 2.0 / 3.0;
                    let [x1, y1] = [near(at.x, control.x), near(at.y, control.y)];
                    let [x2, y2] = [near(p.x, control.x), near(p.y, control.y)];
                    self.content.cubic_to(x1, y1, x2, y2, p.x, p.y);
                    at = p;
                }
                PathSegment::CubicTo(a, b, p) => {
                    self.content.cubic_to(a.x, a.y, b.x, b.y, p.x, p.y);
                    at = p;
                }
                PathSegment::Close => {
                    self.content.close_path();
                }
            }
        }
    }
}

/// Returns a plain color as parts of 1; no picture of ours has gradients or patterns.
fn color(paint: &Paint) -> Option<[f32; 3]> {
    let Paint::Color(color) = paint else { return None };
    Some([color.red, color.green, color.blue].map(|part| f32::from(part) / 255.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PICTURE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="400" height="200">
        <rect width="40" height="20" fill="#FF0000" fill-opacity="0.5"/><text x="5" y="50">Ag</text>
        <clipPath id="c"><rect width="9" height="9"/></clipPath>
        <g clip-path="url(#c)"><line x1="0" y1="0" x2="40" y2="20" stroke="#000" stroke-dasharray="2 1"/></g></svg>"##;

    #[test]
    fn a_page_is_as_large_as_its_picture_and_the_same_every_time() {
        let pdf = to_pdf(PICTURE, "A title", &Fonts::default()).unwrap();
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-1.") && text.trim_end().ends_with("%%EOF"));
        assert!(text.contains("/MediaBox [0 0 300 150]") && text.contains("(A title)"), "{text}");
        assert!(text.contains("/ca 0.5") && !text.contains("/Font"));
        assert_eq!(to_pdf(PICTURE, "A title", &Fonts::default()).unwrap(), pdf);
        assert!(matches!(to_pdf("<html/>", "", &Fonts::default()), Err(DrawError::Svg(_))));
    }
}
