//! The header of a binary PNM image, whose pixels begin behind one blank character.

/// The header of a binary image of gray (P5) or of colors (P6).
struct Header {
    width: usize,
    height: usize,
    channels: usize,
    max: usize,
    /// The offset of the character that ends it.
    end: usize,
}

impl Header {
    fn parse(bytes: &[u8]) -> Option<Self> {
        let channels = match bytes.get(..2)? {
            b"P5" => 1,
            b"P6" => 3,
            _ => return None,
        };
        let mut at = 2;
        let [width, height, max] = [(); 3].map(|()| next_number(bytes, &mut at));
        Some(Self { width: width?, height: height?, channels, max: max?, end: at })
    }

    /// Returns the number of bytes of the pixels.
    fn pixel_bytes(&self) -> Option<usize> {
        let sample_bytes = if self.max > 255 { 2 } else { 1 };
        self.width.checked_mul(self.height)?.checked_mul(self.channels * sample_bytes)
    }
}

/// Reads the next number behind blank characters and comments.
fn next_number(bytes: &[u8], at: &mut usize) -> Option<usize> {
    loop {
        match bytes.get(*at)? {
            b'#' => *at += bytes[*at..].iter().position(|byte| matches!(byte, b'\n' | b'\r'))?,
            byte if byte.is_ascii_whitespace() => *at += 1,
            _ => break,
        }
    }
    let length = bytes[*at..].iter().position(|byte| !byte.is_ascii_digit())?;
    let digits = std::str::from_utf8(&bytes[*at..*at + length]).ok()?;
    *at += length;
    digits.parse().ok()
}

/// Returns how long a binary image is with its header; `None` for other files.
pub(super) fn expected_bytes(bytes: &[u8]) -> Option<usize> {
    let header = Header::parse(bytes)?;
    (header.end + 1).checked_add(header.pixel_bytes()?)
}

/// Returns an image whose header ends with a line end of Windows, CR LF, with LF alone: of two characters one would be the
/// first pixel, and all others one place further. Only the length of the file tells.
pub(super) fn with_short_line_ends(mut bytes: Vec<u8>) -> Vec<u8> {
    let Some(header) = Header::parse(&bytes) else { return bytes };
    let ends_as_on_windows = bytes[header.end..].starts_with(b"\r\n");
    let is_one_more = expected_bytes(&bytes).is_some_and(|expected| bytes.len() == expected + 1);
    if ends_as_on_windows && is_one_more {
        bytes.remove(header.end);
    }
    bytes
}
