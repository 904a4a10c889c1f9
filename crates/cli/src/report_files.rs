//! Reports as files: the page, the Markdown version, and its pictures.

use crate::exit::Failure;
use sidestep::kernel::InputError;
use sidestep_document::Document;
use sidestep_record::{FileManifest, FileSet, REPORT};
use sidestep_report::{RenderedReport, SvgFile, render};
use sidestep_session::{VERSION, png_bytes};
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

    /// Begins a report: nothing is in its place before [`FileSet::commit`], and what is there then is replaced only if it
    /// is an earlier report that nobody changed.
    ///
    /// # Errors
    /// When another file has the name of the page or of its list.
    pub(crate) fn begin(&self) -> Result<FileSet, InputError> {
        let list = self.html.with_file_name(FileManifest::name_for(&self.stem()));
        let files = FileSet::new(&list, REPORT, VERSION)?;
        files.check(&name(&self.html))?;
        files.check(&name(&self.markdown()))?;
        Ok(files)
    }

    /// Adds the page, the Markdown version and the pictures.
    ///
    /// # Errors
    /// When a figure cannot be drawn, something cannot be written, or a file of others has the name of one.
    pub(crate) fn add(
        &self,
        files: &mut FileSet,
        document: &Document,
        raster: PngOutput,
    ) -> Result<(), Failure> {
        let RenderedReport { html, markdown, pictures } = render(document, &self.pictures)?;
        for SvgFile { stem, svg } in &pictures {
            let place = format!("{}/{stem}", self.pictures);
            files.stage_bytes::<Failure>(&format!("{place}.svg"), svg.as_bytes())?;
            if raster == PngOutput::AlsoPng {
                files.stage_bytes::<Failure>(&format!("{place}.png"), &png_bytes(svg)?)?;
            }
        }
        files.stage_bytes::<Failure>(&name(&self.markdown()), markdown.as_bytes())?;
        // The page comes last: if it is new, all the others are.
        files.stage_bytes::<Failure>(&name(&self.html), html.as_bytes())
    }
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}
