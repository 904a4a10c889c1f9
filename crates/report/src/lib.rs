#![doc = include_str!("../README.md")]

mod chart;
mod gallery;
mod html;
pub mod markdown;
mod print;
mod series_looks;

pub use gallery::{Gallery, GalleryMark, GalleryMetric, GalleryRun, GalleryValue, gallery_page};
pub use print::{FigureLook, PrintFigure, PrintStyle};

/// The text of a gallery.
pub use sidestep_document::document::Text;

use sidestep_document::Document;
use sidestep_document::document::Block;
use sidestep_draw::{DrawError, DrawnChart, Spot};

/// A report, ready to be stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RenderedReport {
    /// The page; self-contained.
    pub html: String,
    /// The Markdown version, which shows the pictures below.
    pub markdown: String,
    /// Every figure and picture, in the order of the document.
    pub pictures: Vec<SvgFile>,
}

/// A picture and its file name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SvgFile {
    /// Name without its ending, e.g. `03-speed-up`.
    pub stem: String,
    /// The picture as a whole SVG document, which needs no other file.
    pub svg: String,
}

/// A picture of a page.
struct PagePicture {
    file: SvgFile,
    /// Where the marks of a figure are; a finished picture has none.
    spots: Vec<Spot>,
}

/// Renders a document as page, text and pictures. `folder` is the folder of the pictures, as seen
/// from the Markdown file.
///
/// # Errors
/// When a figure cannot be drawn.
pub fn render(document: &Document, folder: &str) -> Result<RenderedReport, DrawError> {
    let pictures = pictures(document)?;
    let html = html::page(document, &pictures);
    let pictures: Vec<SvgFile> = pictures.into_iter().map(|picture| picture.file).collect();
    Ok(RenderedReport { html, markdown: markdown::text(document, folder, &pictures), pictures })
}

/// Returns all figures and pictures, numbered in order.
fn pictures(document: &Document) -> Result<Vec<PagePicture>, DrawError> {
    let mut files = Vec::new();
    for block in &document.blocks {
        let (title, DrawnChart { svg, spots }) = match block {
            Block::Figure(figure) => (&figure.title, chart::page_chart(figure)?),
            Block::Picture(picture) => {
                (&picture.title, DrawnChart { svg: picture.svg.clone(), spots: Vec::new() })
            }
            _ => continue,
        };
        // The number keeps the files of a folder in the order of the document, and tells equal titles apart.
        let stem = format!("{:02}-{}", files.len() + 1, slug(title));
        files.push(PagePicture { file: SvgFile { stem, svg }, spots });
    }
    Ok(files)
}

/// Returns a title as part of a file name or an address: `Trip times, by regime` becomes
/// `trip-times-by-regime`. It has at most eight words, so that names of files stay short.
fn slug(title: &str) -> String {
    let words = title.split(|c: char| !c.is_ascii_alphanumeric()).filter(|w| !w.is_empty());
    words.map(str::to_ascii_lowercase).take(8).collect::<Vec<_>>().join("-")
}

#[cfg(test)]
mod tests;
