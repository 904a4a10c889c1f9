//! The embedded font: widths of texts, and line breaks.
//!
//! SVG viewers bring their own fonts and a bare machine has none, so pictures are laid out with
//! the metrics of DejaVu Sans, which `to_png` also draws with. Viewers without it fall back to a
//! sans-serif font that is, as a rule, narrower: text then has more room, not less.

use std::sync::{Arc, OnceLock};

use crate::error::DrawError;
use resvg::usvg::fontdb;
use skrifa::{FontRef, MetadataProvider, instance::LocationRef, instance::Size};

/// Font families that the SVG names; the first is the embedded one.
pub(crate) const FAMILIES: &str = "DejaVu Sans, Verdana, Helvetica, Arial, sans-serif";

/// The weight of letters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Weight {
    Regular,
    Bold,
}

/// The fonts that pictures are drawn with as PNG and PDF.
#[derive(Debug, Clone)]
pub struct Fonts {
    pub(crate) database: Arc<fontdb::Database>,
    family: Option<String>,
}

impl Default for Fonts {
    /// Returns the embedded DejaVu Sans alone.
    fn default() -> Self {
        Self { database: fonts(), family: None }
    }
}

impl Fonts {
    /// Returns the embedded font, and before it the font of a file, as TrueType or OpenType: pictures in it are laid
    /// out for DejaVu Sans, which is wider than most.
    ///
    /// # Errors
    /// [`DrawError::Font`] if the bytes are no such font.
    pub fn from_file_bytes(bytes: Vec<u8>) -> Result<Self, DrawError> {
        let mut database = (*fonts()).clone();
        let faces = database.load_font_source(fontdb::Source::Binary(Arc::new(bytes)));
        let face = faces.first().and_then(|id| database.face(*id));
        let family = face.and_then(|face| face.families.first());
        let Some((family, _)) = family.cloned() else { return Err(DrawError::Font) };
        let family = Some(quoted_family(&family));
        Ok(Self { database: Arc::new(database), family })
    }

    /// Returns the names of the families in a font file; none if it is no font.
    pub fn families(bytes: &[u8]) -> Vec<String> {
        let mut database = fontdb::Database::new();
        database.load_font_data(bytes.to_vec());
        let mut names: Vec<String> = Vec::new();
        for face in database.faces() {
            // The first name is the English one.
            names.extend(face.families.first().map(|(name, _)| name.clone()));
        }
        names.dedup();
        names
    }

    /// Returns the embedded font, and before it a family from the files with its weights and slopes.
    ///
    /// # Errors
    /// [`DrawError::Font`] if none of them is a font of this family.
    pub fn from_family(family: &str, files: Vec<Vec<u8>>) -> Result<Self, DrawError> {
        let mut database = (*fonts()).clone();
        files.into_iter().for_each(|bytes| database.load_font_data(bytes));
        let names = database.faces().filter_map(|face| face.families.first());
        let name = names.map(|(name, _)| name).find(|name| name.eq_ignore_ascii_case(family));
        let Some(name) = name else { return Err(DrawError::Font) };
        let family = Some(quoted_family(name));
        Ok(Self { database: Arc::new(database), family })
    }

    /// Returns a picture that names these fonts for its text.
    pub fn apply(&self, svg: &str) -> String {
        let Some(family) = &self.family else { return svg.to_string() };
        let embedded = format!("font-family=\"{FAMILIES}\"");
        svg.replacen(&embedded, &format!("font-family=\"'{family}', {FAMILIES}\""), 1)
    }
}

/// Returns the name of a family as it can stand in an attribute of a picture.
fn quoted_family(family: &str) -> String {
    family.replace(['"', '\'', '<', '>', '&', ','], " ")
}

/// Returns the font database of `to_png`: DejaVu Sans, regular and bold, and nothing else.
pub(crate) fn fonts() -> Arc<fontdb::Database> {
    static FONTS: OnceLock<Arc<fontdb::Database>> = OnceLock::new();
    Arc::clone(FONTS.get_or_init(|| {
        let mut fonts = fontdb::Database::new();
        fonts.load_font_data(dejavu::sans::regular().to_vec());
        fonts.load_font_data(dejavu::sans::bold().to_vec());
        fonts.set_sans_serif_family("DejaVu Sans");
        // The fallback for text with a missing font.
        fonts.set_serif_family("DejaVu Sans");
        Arc::new(fonts)
    }))
}

/// Returns the width of `text` in pixels at a font size of `size_px`.
pub(crate) fn width(text: &str, size_px: f64, weight: Weight) -> f64 {
    let data = match weight {
        Weight::Regular => dejavu::sans::regular(),
        Weight::Bold => dejavu::sans::bold(),
    };
    let Ok(font) = FontRef::new(data) else { return text.chars().count() as f64 * size_px * 0.6 };
    let charmap = font.charmap();
    let metrics = font.glyph_metrics(Size::new(1000.0), LocationRef::default());
    let thousandths: f64 = text
        .chars()
        // The viewer takes a missing character from another font, so assume a full square.
        .map(|c| charmap.map(c).and_then(|g| metrics.advance_width(g)).unwrap_or(1000.0))
        .map(f64::from)
        .sum();
    thousandths * size_px / 1000.0
}

/// Breaks `text` at spaces (not at no-break spaces) into lines at most `room_px` wide; a word wider
/// than that is shortened with an ellipsis. Empty text has no lines.
pub(crate) fn wrap(text: &str, size_px: f64, weight: Weight, room_px: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    // Not `split_whitespace`, because a no-break space holds words together.
    for word in text.split([' ', '\t', '\n']).filter(|word| !word.is_empty()) {
        let word = shorten(word, size_px, weight, room_px);
        match lines.last_mut() {
            Some(line) if width(&format!("{line} {word}"), size_px, weight) <= room_px => {
                line.push(' ');
                line.push_str(&word);
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// Returns `text` itself if it fits, otherwise as much of it as fits before an ellipsis.
pub(crate) fn shorten(text: &str, size_px: f64, weight: Weight, room_px: f64) -> String {
    if width(text, size_px, weight) <= room_px {
        return text.to_string();
    }
    let room_px = room_px - width("…", size_px, weight);
    let mut used_px = 0.0;
    let mut shortened = String::new();
    for c in text.chars() {
        used_px += width(c.encode_utf8(&mut [0; 4]), size_px, weight);
        if used_px > room_px {
            break;
        }
        shortened.push(c);
    }
    shortened.push('…');
    shortened
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_embedded_fonts_are_readable() {
        assert_eq!(fonts().len(), 2);
    }

    #[test]
    fn a_picture_names_the_font_of_a_file() {
        let fonts = Fonts::from_file_bytes(dejavu::sans::bold().to_vec()).unwrap();
        let svg = format!("<svg font-family=\"{FAMILIES}\">");
        assert!(fonts.apply(&svg).starts_with("<svg font-family=\"'DejaVu Sans', DejaVu"));
        assert_eq!(Fonts::default().apply(&svg), svg);
        assert!(matches!(Fonts::from_file_bytes(vec![1, 2, 3]), Err(DrawError::Font)));
    }

    #[test]
    fn a_family_is_taken_from_its_files_whatever_the_case_of_its_name() {
        let bold = dejavu::sans::bold().to_vec();
        assert_eq!(Fonts::families(&bold), ["DejaVu Sans"]);
        assert!(Fonts::families(b"no font").is_empty());
        let fonts = Fonts::from_family("dejavu sans", vec![bold]).unwrap();
        assert_eq!(fonts.family.as_deref(), Some("DejaVu Sans"));
        assert!(matches!(Fonts::from_family("Missing", vec![]), Err(DrawError::Font)));
    }

    #[test]
    fn widths_grow_with_text_size_and_weight() {
        let plain = width("Contacts", 10.0, Weight::Regular);
        assert!((40.0..55.0).contains(&plain), "{plain}");
        assert!((width("Contacts", 20.0, Weight::Regular) - 2.0 * plain).abs() < 1e-9);
        assert!(width("Contacts", 10.0, Weight::Bold) > plain);
    }

    #[test]
    fn wrapped_lines_fit_and_lose_no_short_word() {
        let text = "unreliable sensors and unreliable effectors";
        let lines = wrap(text, 12.0, Weight::Regular, 90.0);
        assert!(lines.len() > 1);
        assert_eq!(lines.join(" "), text);
        assert!(lines.iter().all(|line| width(line, 12.0, Weight::Regular) <= 90.0));
    }

    #[test]
    fn a_no_break_space_holds_words_together() {
        let lines = wrap("closer than 0.5\u{a0}m", 12.0, Weight::Regular, 90.0);
        assert_eq!(lines, ["closer than", "0.5\u{a0}m"]);
    }

    #[test]
    fn an_overlong_word_is_cut_with_an_ellipsis() {
        let cut = shorten("antidisestablishmentarianism", 12.0, Weight::Regular, 60.0);
        assert!(cut.ends_with('…') && width(&cut, 12.0, Weight::Regular) <= 60.0);
        assert_eq!(shorten("", 12.0, Weight::Regular, 0.0), "");
    }
}
