//! Reports as files: the page, the Markdown version, and its pictures.

use crate::exit::Failure;
use sidestep_document::Document;
use sidestep_report::{RenderedReport, SvgFile, render};
use sidestep_session::{write_atomically, write_png};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Where a report is stored: all files are beside the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct ReportFiles {
    /// The page; the Markdown version has the same name with the ending `md`.
    pub(crate) html: PathBuf,
    /// Name of the folder beside it for pictures.
    pub(crate) pictures: String,
}

/// The formats that pictures are stored in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PngOutput {
    /// SVG alone, which the page needs.
    None,
    /// SVG, and PNG for programs that cannot show it.
    AlsoPng,
}

impl ReportFiles {
    pub(crate) fn markdown(&self) -> PathBuf {
        self.html.with_extension("md")
    }

    /// Returns the name of the page without its ending, from which the names of the others are made.
    pub(crate) fn stem(&self) -> String {
        self.html.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Writes a report. Every file is replaced as a whole, and the page last: if it is new, all the
    /// others are.
    ///
    /// # Errors
    /// When a figure cannot be drawn, or something cannot be written.
    pub(crate) fn store(&self, document: &Document, raster: PngOutput) -> Result<(), Failure> {
        let RenderedReport { html, markdown, pictures } = render(document, &self.pictures)?;
        self.store_pictures(&pictures, raster)?;
        write_atomically(&self.markdown(), |file| file.write_all(markdown.as_bytes()))?;
        write_atomically(&self.html, |file| file.write_all(html.as_bytes()))
    }

    fn store_pictures(&self, pictures: &[SvgFile], raster: PngOutput) -> Result<(), Failure> {
        if pictures.is_empty() {
            return Ok(());
        }
        let folder = self.html.parent().unwrap_or(Path::new("")).join(&self.pictures);
        std::fs::create_dir_all(&folder).map_err(|e| Failure::cannot_write(&folder, &e))?;
        for SvgFile { stem, svg } in pictures {
            write_atomically(&folder.join(format!("{stem}.svg")), |file| {
                file.write_all(svg.as_bytes())
            })?;
            if raster == PngOutput::AlsoPng {
                write_png(&folder.join(format!("{stem}.png")), svg)?;
            }
        }
        Ok(())
    }
}
