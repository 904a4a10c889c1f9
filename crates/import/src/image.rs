//! Bitmaps: PNG, PNM (PGM among them), JPEG and BMP, binary or ASCII, gray, color or one bit.

use std::io::{Cursor, ErrorKind};
use std::path::Path;

use ::image::metadata::Orientation;
use ::image::{
    DynamicImage, ImageBuffer, ImageDecoder, ImageError, ImageFormat, ImageReader, ImageResult,
    Limits, Pixel, Primitive,
};
use sidestep_kernel::InputError;

use super::pnm;
use sidestep_scenario::file::read_bytes;

/// The maximum number of pixels, as a square of 16,384; larger images are refused before memory is allocated for them.
pub const MAX_PIXELS: u64 = 1 << 28;

/// The size of the largest image file in bytes: the ASCII form of an image of [`MAX_PIXELS`].
const MAX_IMAGE_BYTES: u64 = 4 * MAX_PIXELS;

/// The maximum memory for decoding in bytes: 8 (four channels of 16 bits) per pixel.
const MAX_DECODED_BYTES: u64 = 8 * MAX_PIXELS;

/// A decoded image.
#[derive(Debug, Clone)]
pub struct Bitmap {
    pixels: DynamicImage,
    /// Whether a camera says in the file that the picture is to be turned or mirrored. It is not, as in `map_server`.
    pub is_turned: bool,
    /// Whether the file holds the grays of its pixels with errors, as JPEG does.
    pub is_lossy: bool,
    /// Number of bytes behind the pixels, which are not read.
    pub trailing_bytes: usize,
}

impl Bitmap {
    /// Reads the image at `path` (also with gzip); its first bytes determine the format.
    ///
    /// # Errors
    /// When the file cannot be read, is no PNG, PNM, JPEG or BMP image, is damaged or cut short, or has no
    /// pixel or more than [`MAX_PIXELS`].
    pub fn load(path: &Path) -> Result<Self, InputError> {
        Self::decode(&path.display().to_string(), read_bytes(path, MAX_IMAGE_BYTES)?)
    }

    /// Reads the image in `bytes`; errors name `place`.
    ///
    /// # Errors
    /// As [`Bitmap::load`], except those of reading the file.
    pub fn decode(place: &str, bytes: Vec<u8>) -> Result<Self, InputError> {
        let bytes = pnm::with_short_line_ends(bytes);
        if bytes.starts_with(JPEG_MAGIC) && !has_jpeg_end(&bytes) {
            return Err(cut_short(place));
        }
        let length = bytes.len();
        let pnm_bytes = pnm::expected_bytes(&bytes);
        let (format, mut decoder) =
            decoder(bytes).map_err(|error| decoding_error(place, &error))?;
        check_pixel_count(place, decoder.dimensions())?;
        let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
        let pixels =
            DynamicImage::from_decoder(decoder).map_err(|error| decoding_error(place, &error))?;
        let is_turned = orientation != Orientation::NoTransforms;
        let is_lossy = format == Some(ImageFormat::Jpeg);
        let trailing_bytes = pnm_bytes.map_or(0, |expected| length.saturating_sub(expected));
        Ok(Self { pixels, is_turned, is_lossy, trailing_bytes })
    }

    /// Number of pixels from left to right.
    pub fn width(&self) -> u32 {
        self.pixels.width()
    }

    /// Number of pixels from top to bottom.
    pub fn height(&self) -> u32 {
        self.pixels.height()
    }

    /// Returns the result of `read` for each pixel's brightness, row by row from the top, whatever its opacity; see
    /// [`Shade::brightness`].
    pub fn map_brightness<T>(&self, read: impl Fn(f64) -> T) -> Vec<T> {
        self.map_shades(|shade| read(shade.brightness))
    }

    /// Returns the result of `read` for each pixel, row by row from the top.
    pub fn map_shades<T>(&self, read: impl FnMut(Shade) -> T) -> Vec<T> {
        match &self.pixels {
            DynamicImage::ImageLuma8(pixels) => map_channels(pixels, 1, read),
            DynamicImage::ImageLumaA8(pixels) => map_channels(pixels, 1, read),
            DynamicImage::ImageRgb8(pixels) => map_channels(pixels, 3, read),
            DynamicImage::ImageRgba8(pixels) => map_channels(pixels, 3, read),
            DynamicImage::ImageLuma16(pixels) => map_channels(pixels, 1, read),
            DynamicImage::ImageLumaA16(pixels) => map_channels(pixels, 1, read),
            DynamicImage::ImageRgb16(pixels) => map_channels(pixels, 3, read),
            DynamicImage::ImageRgba16(pixels) => map_channels(pixels, 3, read),
            other => map_channels(&other.to_rgba16(), 3, read),
        }
    }

    /// Returns whether the pixels can be transparent.
    pub fn has_opacity(&self) -> bool {
        self.pixels.color().has_alpha()
    }

    /// Returns what a pixel consists of, for people; colors of a palette have been looked up.
    pub fn pixel_type(&self) -> String {
        let color = self.pixels.color();
        let channels = if color.has_color() { "color" } else { "gray" };
        let opacity = if color.has_alpha() { " with opacity" } else { "" };
        let bits = color.bits_per_pixel() / u16::from(color.channel_count());
        format!("{channels}{opacity}, {bits} bits a channel")
    }
}

/// What is seen of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shade {
    /// The mean of its color channels, from 0 (black) to 255 (white), without regard to its opacity.
    pub brightness: f64,
    /// The weighted mean of its color channels by Rec. 709, from 0 to 255: what Nav2 takes for the gray of a color. That of
    /// a gray is the gray itself.
    pub luma: f64,
    /// The first of its channels alone, gray or red, from 0 to 255.
    pub first_channel: f64,
    /// From 0 (transparent) to 1 (opaque).
    pub opacity: f64,
}

/// Returns the result of `read` for each pixel: the mean of its first `colors` channels, scaled to 0..255, and the
/// channel behind them, if any, as its opacity.
fn map_channels<P, T>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
    colors: usize,
    mut read: impl FnMut(Shade) -> T,
) -> Vec<T>
where
    P: Pixel,
    P::Subpixel: Primitive + Into<f64>,
{
    let white: f64 = P::Subpixel::DEFAULT_MAX_VALUE.into();
    // One division of whole numbers below 2^53, so that gray 205 is exactly 205.0 in every format.
    let divisor = colors as f64 * (white / 255.0);
    let mut values = Vec::with_capacity(image.width() as usize * image.height() as usize);
    for pixel in image.pixels() {
        let channels = pixel.channels();
        let sum: f64 = channels[..colors].iter().map(|&channel| channel.into()).sum();
        let opacity = channels.get(colors).map_or(1.0, |&channel| channel.into() / white);
        let first: f64 = channels[0].into();
        let first_channel = first / (white / 255.0);
        let brightness = sum / divisor;
        let is_gray = channels[..colors].iter().all(|&channel| channel.into() == first);
        let luma = if is_gray { brightness } else { luma(channels) / (white / 255.0) };
        values.push(read(Shade { brightness, luma, first_channel, opacity }));
    }
    values
}

/// Returns the weighted mean of three color channels by Rec. 709.
fn luma<S: Primitive + Into<f64>>(channels: &[S]) -> f64 {
    const WEIGHTS: [f64; 3] = [0.212656, 0.715158, 0.072186];
    let weighted = channels.iter().zip(WEIGHTS).map(|(&channel, weight)| weight * channel.into());
    weighted.sum()
}

fn decoder(bytes: Vec<u8>) -> ImageResult<(Option<ImageFormat>, impl ImageDecoder)> {
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    reader.limits(limits);
    Ok((reader.format(), reader.into_decoder()?))
}

fn check_pixel_count(place: &str, (width, height): (u32, u32)) -> Result<(), InputError> {
    let pixels = u64::from(width) * u64::from(height);
    if (1..=MAX_PIXELS).contains(&pixels) {
        return Ok(());
    }
    let cause =
        format!("an image of {width} x {height} pixels; from 1 to {MAX_PIXELS} pixels are allowed");
    Err(InputError::new(place, cause, "scale the image, or cut out the part you need"))
}

fn cut_short(place: &str) -> InputError {
    let cause = "the image is cut short: it has fewer pixels than its header says";
    InputError::new(place, cause, "download or write the image again")
}

/// The first bytes of a JPEG.
const JPEG_MAGIC: &[u8] = b"\xff\xd8\xff";

/// Returns whether the data of a JPEG have an end. Decoders fill the rest of one that was cut short with gray.
fn has_jpeg_end(bytes: &[u8]) -> bool {
    const END: u8 = 0xd9;
    let mut at = 2;
    while let Some([first, marker]) = bytes.get(at..at + 2) {
        let is_marker = *first == 0xff;
        match *marker {
            // Between segments any number of fill bytes may lie; in data 0xff is followed by 0, or by a restart.
            _ if !is_marker => at += 1,
            0xff => at += 1,
            0x00 | 0x01 | 0xd0..=0xd7 => at += 2,
            END => return true,
            // A segment with its length, also between the scans of a progressive image.
            _ => {
                let Some([high, low]) = bytes.get(at + 2..at + 4) else { return false };
                at += 2 + usize::from(u16::from_be_bytes([*high, *low]));
            }
        }
    }
    false
}

fn decoding_error(place: &str, error: &ImageError) -> InputError {
    match error {
        ImageError::IoError(io) if io.kind() == ErrorKind::UnexpectedEof => cut_short(place),
        ImageError::Unsupported(_) => InputError::new(
            place,
            format!("no image of a kind that is read ({error})"),
            "save it as PNG, PGM (P2 or P5), JPEG or BMP",
        ),
        _ => InputError::new(
            place,
            format!("the image cannot be read: {error}"),
            "give a PNG or a PGM image, whole and undamaged",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::image::{GrayImage, Luma, LumaA, Rgb, Rgba};
    use proptest::prelude::*;

    fn brightness(bytes: &[u8]) -> Vec<f64> {
        Bitmap::decode("test", bytes.to_vec()).expect("an image").map_brightness(|v| v)
    }

    fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
        encoded(image, ImageFormat::Png)
    }

    fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        image.into().write_to(&mut bytes, format).expect("memory takes all");
        bytes.into_inner()
    }

    #[test]
    fn jpeg_and_bmp_are_read_and_a_camera_that_turns_a_picture_is_noticed() {
        let image = GrayImage::from_fn(16, 8, |x, _| Luma([255 * u8::from(x < 8)]));
        let jpeg = encoded(image.clone(), ImageFormat::Jpeg);
        let read = Bitmap::decode("test", jpeg.clone()).expect("a JPEG");
        assert_eq!(
            (read.width(), read.height(), read.is_lossy, read.is_turned),
            (16, 8, true, false)
        );
        let grays = read.map_brightness(|v| v);
        assert!(grays[..8].iter().all(|v| *v > 250.0) && grays[8..16].iter().all(|v| *v < 5.0));
        let bmp = Bitmap::decode("test", encoded(image, ImageFormat::Bmp)).expect("a BMP");
        assert_eq!(
            (bmp.is_lossy, bmp.map_brightness(|v| v)[..9].to_vec()),
            (false, [[255.0; 8].to_vec(), vec![0.0]].concat())
        );
        // A segment of EXIF behind the first marker: one entry, orientation 6.
        let exif = b"\xff\xe1\x00\x22Exif\0\0MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
        let turned = [&jpeg[..2], exif, &jpeg[2..]].concat();
        assert!(Bitmap::decode("test", turned).expect("a JPEG").is_turned);
        for end in [3, 30, jpeg.len() / 2] {
            let _ = Bitmap::decode("test", jpeg[..end].to_vec());
        }
    }

    #[test]
    fn a_jpeg_that_is_cut_short_is_no_image_in_gray() {
        let image = GrayImage::from_fn(64, 64, |x, y| Luma([((x * 7 + y * 13) % 251) as u8]));
        let jpeg = encoded(image, ImageFormat::Jpeg);
        assert!(Bitmap::decode("test", jpeg.clone()).is_ok());
        for end in [jpeg.len() / 3, jpeg.len() / 2, jpeg.len() - 2] {
            let error = Bitmap::decode("test", jpeg[..end].to_vec()).expect_err("cut");
            assert!(error.cause().contains("cut short"), "{end}: {error}");
        }
        let with_more = [&jpeg[..], b"a trailer of the camera"].concat();
        assert!(Bitmap::decode("test", with_more).is_ok());
    }

    #[test]
    fn a_pgm_whose_lines_end_as_on_windows_has_its_pixels_where_they_are() {
        let windows = b"P5\r\n3 1\r\n255\r\n\x00\xcd\xff";
        assert_eq!(brightness(windows), [0.0, 205.0, 255.0]);
        // One blank character ends the header: here the first pixel happens to be 10.
        assert_eq!(brightness(b"P5\n3 1\n255\r\n\xcd\xff"), [10.0, 205.0, 255.0]);
    }

    #[test]
    fn bytes_behind_the_pixels_are_counted() {
        let trailing =
            |bytes: &[u8]| Bitmap::decode("test", bytes.to_vec()).expect("an image").trailing_bytes;
        assert_eq!(trailing(b"P5 3 1 255\n\x00\xcd\xff"), 0);
        assert_eq!(trailing(b"P5 3 1 255\n\x00\xcd\xff\x01\x02"), 2);
        assert_eq!(trailing(b"P2 3 1 255\n0 205 255\n\n"), 0);
    }

    #[test]
    fn the_weights_of_colors_leave_grays_alone() {
        let image = ImageBuffer::from_fn(3, 1, |x, _| {
            [Rgb([205u8; 3]), Rgb([255, 0, 0]), Rgb([0, 255, 0])][x as usize]
        });
        let image = Bitmap::decode("test", png(image)).expect("an image");
        let lumas: Vec<f64> = image.map_shades(|shade| shade.luma);
        assert_eq!(lumas[0], 205.0);
        assert!((lumas[1] - 54.2).abs() < 0.1 && (lumas[2] - 182.4).abs() < 0.1, "{lumas:?}");
    }

    #[test]
    fn ascii_and_binary_pgm_read_the_same_with_comments_in_the_header() {
        let ascii = b"P2\n# by hand\n3 1 # size\n# deepest\n255\n0 205\n255\n";
        let binary = b"P5\n# CREATOR: GIMP PNM Filter Version 1.1\n3 1\n255\n\x00\xcd\xff";
        assert_eq!(brightness(ascii), [0.0, 205.0, 255.0]);
        assert_eq!(brightness(binary), [0.0, 205.0, 255.0]);
    }

    #[test]
    fn other_depths_are_scaled_to_255() {
        assert_eq!(brightness(b"P2 3 1 15 0 1 15"), [0.0, 17.0, 255.0]);
        assert_eq!(brightness(b"P2 2 1 65535 0 65535"), [0.0, 255.0]);
        assert_eq!(brightness(b"P1 2 1 1 0"), [0.0, 255.0], "in a P1 a 1 is black");
    }

    #[test]
    fn a_gray_is_exactly_itself_in_every_png() {
        let rgb = ImageBuffer::from_pixel(1, 1, Rgb([205u8; 3]));
        let deep = ImageBuffer::from_pixel(1, 1, Luma([205u16 * 257]));
        let deep_rgb = ImageBuffer::from_pixel(1, 1, Rgb([205u16 * 257; 3]));
        assert_eq!(brightness(&png(ImageBuffer::from_pixel(1, 1, Luma([205u8])))), [205.0]);
        assert_eq!(brightness(&png(rgb)), [205.0]);
        assert_eq!(brightness(&png(deep)), [205.0]);
        assert_eq!(brightness(&png(deep_rgb)), [205.0]);
    }

    #[test]
    fn colors_are_averaged_without_regard_to_opacity() {
        let rgba = ImageBuffer::from_pixel(1, 1, Rgba([0u8, 30, 63, 7]));
        let gray = ImageBuffer::from_pixel(1, 1, LumaA([9u8, 0]));
        assert_eq!(brightness(&png(rgba)), [31.0]);
        assert_eq!(brightness(&png(gray)), [9.0]);
    }

    /// The bytes of a PNG of the given header (depth and color type among it) with chunks before its data; each row
    /// begins with the byte of its filter.
    fn raw_png(header: [u8; 13], chunks: &[(&[u8; 4], &[u8])], rows: &[u8]) -> Vec<u8> {
        let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut packed, rows).expect("memory takes all");
        let data = packed.finish().expect("memory takes all");
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        let all = [&[(b"IHDR", &header[..])][..], chunks, &[(b"IDAT", &data[..]), (b"IEND", &[])]];
        for (name, content) in all.concat() {
            let mut crc = flate2::Crc::new();
            crc.update(name);
            crc.update(content);
            bytes.extend_from_slice(&(content.len() as u32).to_be_bytes());
            bytes.extend_from_slice(name);
            bytes.extend_from_slice(content);
            bytes.extend_from_slice(&crc.sum().to_be_bytes());
        }
        bytes
    }

    /// A header for one row of 8 bits a sample or less.
    fn header(width: u8, bits: u8, color_type: u8) -> [u8; 13] {
        [0, 0, 0, width, 0, 0, 0, 1, bits, color_type, 0, 0, 0]
    }

    fn shades(bytes: Vec<u8>) -> Vec<(f64, f64)> {
        let image = Bitmap::decode("test", bytes).expect("an image");
        image.map_shades(|shade| (shade.brightness, shade.opacity))
    }

    #[test]
    fn colors_of_a_palette_are_looked_up_with_their_opacity() {
        // White is the first color and black the second, as no order of indices would have it.
        let palette: &[u8] = &[254, 254, 254, 0, 0, 0, 205, 205, 205, 30, 60, 90];
        let chunks: &[(&[u8; 4], &[u8])] = &[(b"PLTE", palette)];
        let eight_bits = raw_png(header(4, 8, 3), chunks, &[0, 0, 1, 2, 3]);
        assert_eq!(shades(eight_bits), [(254.0, 1.0), (0.0, 1.0), (205.0, 1.0), (60.0, 1.0)]);
        let two_bits = raw_png(header(4, 2, 3), chunks, &[0, 0b0001_1011]);
        assert_eq!(shades(two_bits), [(254.0, 1.0), (0.0, 1.0), (205.0, 1.0), (60.0, 1.0)]);
        let with_opacity: &[(&[u8; 4], &[u8])] = &[(b"PLTE", palette), (b"tRNS", &[255, 255, 0])];
        let transparent = raw_png(header(3, 8, 3), with_opacity, &[0, 0, 1, 2]);
        assert_eq!(shades(transparent), [(254.0, 1.0), (0.0, 1.0), (205.0, 0.0)]);
    }

    #[test]
    fn a_gray_that_a_png_declares_transparent_is() {
        let chunks: &[(&[u8; 4], &[u8])] = &[(b"tRNS", &[0, 205])];
        let gray = raw_png(header(3, 8, 0), chunks, &[0, 0, 205, 254]);
        assert_eq!(shades(gray), [(0.0, 1.0), (205.0, 0.0), (254.0, 1.0)]);
        let deep = raw_png(header(2, 16, 0), &[(b"tRNS", &[205, 205])], &[0, 205, 205, 0, 0]);
        assert_eq!(shades(deep), [(205.0, 0.0), (0.0, 1.0)]);
    }

    #[test]
    fn the_type_of_pixels_is_told() {
        let gray = Bitmap::decode("test", b"P5 1 1 255\n\x00".to_vec()).expect("an image");
        assert_eq!(gray.pixel_type(), "gray, 8 bits a channel");
        let deep = png(ImageBuffer::from_pixel(1, 1, Rgba([7u16, 7, 7, 9])));
        let deep = Bitmap::decode("test", deep).expect("an image");
        assert_eq!(deep.pixel_type(), "color with opacity, 16 bits a channel");
    }

    fn opacity(image: impl Into<DynamicImage>) -> Vec<f64> {
        let image = Bitmap::decode("test", png(image)).expect("an image");
        image.map_shades(|shade| shade.opacity)
    }

    #[test]
    fn opacity_is_exact_at_both_ends_in_every_png() {
        let gray = ImageBuffer::from_fn(2, 1, |x, _| LumaA([7u8, x as u8 * 255]));
        let color = ImageBuffer::from_fn(2, 1, |x, _| Rgba([7u8, 7, 7, x as u8 * 255]));
        let deep_gray = ImageBuffer::from_fn(2, 1, |x, _| LumaA([7u16, x as u16 * 65535]));
        let deep = ImageBuffer::from_fn(2, 1, |x, _| Rgba([7u16, 7, 7, x as u16 * 65535]));
        assert_eq!(opacity(gray), [0.0, 1.0]);
        assert_eq!(opacity(color), [0.0, 1.0]);
        assert_eq!(opacity(deep_gray), [0.0, 1.0]);
        assert_eq!(opacity(deep), [0.0, 1.0]);
        assert_eq!(opacity(GrayImage::from_pixel(1, 1, Luma([0]))), [1.0]);
    }

    #[test]
    fn an_image_cut_short_is_an_error_in_every_format() {
        let whole = png(GrayImage::from_fn(64, 64, |x, y| Luma([(x * y) as u8])));
        let images: [&[u8]; 4] =
            [b"P5 3 1 255\n\x00\xcd", b"P2 3 1 255 0 205", &whole[..whole.len() / 2], b"P5 3"];
        for bytes in images {
            assert!(Bitmap::decode("test", bytes.to_vec()).is_err(), "{bytes:?}");
        }
    }

    #[test]
    fn other_files_and_absurd_sizes_are_errors() {
        for bytes in [&b""[..], b"GIF89a", b"text", b"P5 0 5 255\n", b"P2 1 1 255 x"] {
            assert!(Bitmap::decode("test", bytes.to_vec()).is_err(), "{bytes:?}");
        }
        let error = Bitmap::decode("test", b"P5 60000 60000 255\n".to_vec()).expect_err("absurd");
        assert!(error.cause().contains("60000 x 60000"), "{error}");
    }

    proptest! {
        #[test]
        fn no_damage_panics_the_decoder(
            damage in proptest::collection::vec((0usize..200, any::<u8>()), 1..6),
            which in 0usize..3,
        ) {
            let gray = GrayImage::from_fn(9, 9, |x, y| Luma([(x * y) as u8]));
            let ascii = b"P2\n# comment\n3 2\n255\n0 1 2\n253 254 255\n".to_vec();
            let mut bytes = [png(gray), ascii, b"P5 3 2 255\n\x00\x01\x02\x03\x04\x05".to_vec()][which].clone();
            let length = bytes.len();
            for (at, value) in damage {
                bytes[at % length] = value;
            }
            // Damage may make a huge header, which is tested elsewhere and slow to allocate.
            let is_small = decoder(bytes.clone()).is_ok_and(|(_, d)| d.dimensions().0.max(d.dimensions().1) < 5000);
            if is_small && let Ok(image) = Bitmap::decode("test", bytes) {
                let pixels = image.map_brightness(|v| v);
                prop_assert!(pixels.iter().all(|v| (0.0..=255.0).contains(v)));
            }
        }
    }
}
