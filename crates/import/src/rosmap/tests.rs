//! Maps of ROS as their programs write them.

use std::path::PathBuf;

use super::survey::{MIN_LIGHT_GRAY, thresh_above};
use super::*;
use crate::map_yaml::MapMode;
use ::image::{ImageBuffer, Luma, LumaA, Rgb, Rgba};
use Cell::{Free, Unknown, Wall};

const READING: OccupancyRule = OccupancyRule::DEFAULT;

fn cells(reading: OccupancyRule, brightnesses: &[f64]) -> Vec<Cell> {
    brightnesses.iter().map(|&brightness| reading.cell(brightness)).collect()
}

#[test]
fn dark_is_occupied_light_is_free_and_205_is_unknown_by_a_hair() {
    assert_eq!(cells(READING, &[0.0, 205.0, 206.0, 255.0]), [Wall, Unknown, Free, Free]);
    let lenient = OccupancyRule { free_thresh: 0.25, ..READING };
    assert_eq!(cells(lenient, &[205.0]), [Free]);
}

#[test]
fn both_thresholds_are_strict() {
    let reading = OccupancyRule { occupied_thresh: 0.6, free_thresh: 0.2, ..READING };
    assert_eq!(cells(reading, &[102.0, 101.0, 204.0, 205.0]), [Unknown, Wall, Unknown, Free]);
}

#[test]
fn negate_turns_dark_and_light_around() {
    let reading = OccupancyRule { negate: true, ..READING };
    assert_eq!(cells(reading, &[0.0, 50.0, 255.0]), [Free, Unknown, Wall]);
}

#[test]
fn the_shades_of_scale_are_unknown() {
    let reading = OccupancyRule { mode: MapMode::Scale, ..READING };
    assert_eq!(cells(reading, &[0.0, 128.0, 255.0]), [Wall, Unknown, Free]);
}

#[test]
fn raw_values_are_percent_and_unknown_above_100() {
    let reading = OccupancyRule { mode: MapMode::Raw, ..READING };
    let values = [0.0, 19.0, 20.0, 65.0, 66.0, 100.0, 101.0, 255.0];
    let expected = [Free, Free, Unknown, Unknown, Wall, Wall, Unknown, Unknown];
    assert_eq!(cells(reading, &values), expected);
    let negated = OccupancyRule { negate: true, ..reading };
    assert_eq!(cells(negated, &[255.0, 155.0, 0.0]), [Free, Wall, Unknown]);
}

/// A folder with a map of 1 x 2 pixels, white over black, and its YAML file.
fn written(image: &str, bytes: &[u8]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join(image), bytes).expect("written");
    let yaml = "image: a.pgm\nresolution: 0.5\norigin: [1, 2, 0]\nnegate: 0\n\
                occupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let path = folder.path().join("a.yaml");
    std::fs::write(&path, yaml).expect("written");
    (folder, path)
}

const IMAGE: &[u8] = b"P5 1 2 255\n\xff\x00";

#[test]
fn the_last_row_of_the_image_is_the_bottom_of_the_map() {
    let (_folder, path) = written("a.pgm", IMAGE);
    let map = load(&path).expect("a map");
    assert_eq!((map.width(), map.height(), map.resolution_m()), (1, 2, 0.5));
    assert_eq!((map.plane().origin_m, map.pixels()), ([1.0, 2.0], &[Wall, Free][..]));
}

#[test]
fn an_image_that_is_there_in_packed_form_only_is_found() {
    use std::io::Write;
    let mut gzip = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    gzip.write_all(IMAGE).expect("memory takes all");
    let (_folder, path) = written("a.pgm.gz", &gzip.finish().expect("memory takes all"));
    assert_eq!(load(&path).map(|map| map.counts().free), Ok(1));
}

#[test]
fn a_missing_image_is_an_error_in_the_yaml_file_and_a_cut_one_in_the_image() {
    let (_folder, path) = written("b.pgm", IMAGE);
    let error = load(&path).expect_err("missing");
    assert!(error.place().ends_with("a.yaml"), "{error}");
    assert_eq!(error.line_and_column(), Some((1, 8)));
    let (_folder, path) = written("a.pgm", &IMAGE[..12]);
    let error = load(&path).expect_err("cut");
    assert!(error.place().ends_with("a.pgm") && error.cause().contains("short"), "{error}");
}

#[test]
fn what_does_not_end_as_a_map_is_not_read_as_one() {
    let (folder, path) = written("a.pgm", IMAGE);
    for (name, is_map) in [("b.yml", true), ("B.YAML.gz", true), ("b.toml", false), ("b", false)] {
        let other = folder.path().join(name);
        std::fs::copy(&path, &other).expect("copied");
        assert_eq!(load(&other).is_ok(), is_map, "{name}");
    }
    let error = load(&folder.path().join("b.toml")).expect_err("a scenario");
    assert!(error.remedy().contains(".yaml or .yml"), "{error}");
}

/// A map of one row of gray pixels with opacities.
fn read_row(head: &str, pixels: &[[u8; 2]]) -> PixelMap {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let image = ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| LumaA(pixels[x as usize]));
    image.save(folder.path().join("a.png")).expect("written");
    let yaml = format!(
        "{head}\nimage: a.png\nresolution: 0.5\norigin: [1, 2, 0]\noccupied_thresh: 0.65\n\
         free_thresh: 0.196\n"
    );
    let path = folder.path().join("a.yaml");
    std::fs::write(&path, yaml).expect("written");
    load(&path).expect("a map")
}

fn findings(map: &PixelMap) -> Vec<String> {
    map.report().findings.iter().map(ToString::to_string).collect()
}

#[test]
fn ink_on_a_transparent_ground_is_walls_on_free_ground() {
    // The ground of drawing programs is transparent black or transparent white.
    let drawing = ImageBuffer::from_fn(12, 8, |x, y| {
        let is_ink = (2..10).contains(&x) && (y == 1 || y == 6);
        Rgba([0u8, 0, 0, if is_ink { 255 } else { 0 }])
    });
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("plan.png");
    drawing.save(&path).expect("written");
    let map = load_image(&path, 0.05).expect("a map");
    let counts = map.counts();
    assert_eq!((counts.free, counts.wall, counts.unknown), (80, 16, 0));
    assert_eq!(
        findings(&map),
        ["guessed: transparent pixels are free, because the image has nothing but ink on them \
          (83.3 % of all pixels) (80 times); save the image without transparency, on a gray \
          ground (128), if they are unknown"]
    );
    let row = read_row("negate: 0", &[[0, 255], [255, 0], [0, 0], [0, 200], [0, 20]]);
    assert_eq!(row.pixels(), [Wall, Free, Free, Wall, Free]);
    let light = read_row("negate: 1", &[[255, 255], [255, 0], [0, 0]]);
    assert_eq!(light.pixels(), [Wall, Free, Free]);
}

#[test]
fn beside_free_pixels_transparent_ones_are_unknown() {
    let row = read_row("negate: 0", &[[0, 255], [254, 255], [127, 0], [0, 0], [0, 200], [0, 20]]);
    assert_eq!(row.pixels(), [Wall, Free, Unknown, Unknown, Wall, Unknown]);
    assert_eq!(
        findings(&row),
        ["guessed: transparent pixels are unknown, because opaque ones are free (66.7 % of all \
          pixels) (4 times); save the image without transparency, on a white ground, if they are \
          free"]
    );
}

#[test]
fn transparent_pixels_are_unknown_as_map_saver_writes_them_in_the_mode_scale() {
    // 0.5, transparent: the unknown of map_saver; the file says what it means.
    let row = read_row("mode: scale\nnegate: 0", &[[0, 255], [255, 255], [127, 0], [0, 254]]);
    assert_eq!(row.pixels(), [Wall, Free, Unknown, Unknown]);
    assert!(findings(&row).is_empty());
    let unexplored = read_row("mode: scale\nnegate: 0", &[[0, 255], [127, 0]]);
    assert_eq!(unexplored.pixels(), [Wall, Unknown]);
}

#[test]
fn shades_and_keys_that_are_not_used_are_reported() {
    let row =
        read_row("frame_id: map\nmode: scale\nnegate: 0", &[[0, 255], [100, 255], [255, 255]]);
    assert_eq!(row.pixels(), [Wall, Unknown, Free]);
    assert_eq!(
        findings(&row),
        [
            "not used: the key `frame_id`, line 1",
            "not used: shades between free and occupied of the mode scale, which are unknown",
        ]
    );
}

#[test]
fn the_mode_raw_has_no_transparency_and_the_report_says_so() {
    let row = read_row("mode: raw\nnegate: 0", &[[0, 0], [100, 0], [255, 0]]);
    assert_eq!(row.pixels(), [Free, Wall, Unknown]);
    assert_eq!(row.report().findings[0].treatment, Treatment::NotUsed);
}

#[test]
fn pixels_that_ros_and_nav2_read_in_different_ways_are_said() {
    let raw = read_row("mode: raw\nnegate: 1", &[[255, 255], [205, 255], [155, 255]]);
    assert_eq!(raw.pixels(), [Free, Unknown, Wall]);
    let said = findings(&raw);
    assert!(said[0].starts_with("guessed: values of the mode raw between 0 and 100"), "{said:?}");
    assert!(said[1].starts_with("guessed: `negate` turns the values of the mode raw"), "{said:?}");
    let plain = read_row("mode: raw\nnegate: 0", &[[0, 255], [100, 255], [255, 255]]);
    assert_eq!(findings(&plain), [""; 0]);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let row = |name: &str, pixels: &[[u8; 3]]| {
        let image = ImageBuffer::from_fn(pixels.len() as u32, 1, |x, _| Rgb(pixels[x as usize]));
        let path = folder.path().join(name);
        image.save(&path).expect("written");
        load_image(&path, 1.0).expect("a map")
    };
    // Red has the mean 85 and the weighted mean 54; both are walls. Green has 182.
    let red = row("red.png", &[[255, 0, 0], [255; 3]]);
    assert_eq!((red.pixels(), findings(&red)), (&[Wall, Free][..], Vec::new()));
    let green = row("green.png", &[[0, 255, 0], [255; 3]]);
    assert_eq!(green.pixels(), [Wall, Free]);
    assert!(findings(&green)[0].starts_with("guessed: colored pixels count by the mean"));
    let photo = row("photo.jpg", &[[0; 3], [0; 3], [255; 3], [255; 3]]);
    assert!(photo.report().facts[0].value.contains("JPEG"), "{:?}", photo.report());
}

#[test]
fn an_occupancy_that_is_a_threshold_is_unknown_and_said() {
    let row = read_row("negate: 0", &[[0, 255], [255, 255]]);
    assert_eq!(findings(&row), [""; 0]);
    let (folder, path) = written("a.pgm", b"P5 1 2 255\n\xff\x00");
    let text = std::fs::read_to_string(&path).expect("written").replace("0.65", "1.0");
    std::fs::write(&path, text).expect("written");
    let map = load(&path).expect("a map");
    assert_eq!(map.pixels(), [Unknown, Free]);
    let said = findings(&map);
    assert!(said[0].starts_with("guessed: pixels whose occupancy is a threshold"), "{said:?}");
    drop(folder);
}

#[test]
fn remedies_for_transparency_change_what_it_means() {
    let white = read_row("negate: 0", &[[0, 255], [254, 255], [255, 255]]);
    assert_eq!((white.pixels(), findings(&white).len()), (&[Wall, Free, Free][..], 0));
    let gray = read_row("negate: 0", &[[0, 255], [128, 255]]);
    assert_eq!(gray.pixels(), [Wall, Unknown]);
}

#[test]
fn opaque_pixels_with_opacities_are_what_they_are_without_them() {
    let opaque = [[0, 255], [205, 255], [206, 255], [255, 255]];
    let row = read_row("negate: 0", &opaque);
    assert_eq!(row.pixels(), [Wall, Unknown, Free, Free]);
    let findings = findings(&row);
    assert!(!findings.iter().any(|found| found.starts_with("guessed")), "{findings:?}");
}

/// A map of one row of gray pixels under a `free_thresh`.
fn read_grays(free_thresh: &str, grays: &[u8]) -> PixelMap {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut image = format!("P5 {} 1 255\n", grays.len()).into_bytes();
    image.extend_from_slice(grays);
    std::fs::write(folder.path().join("a.pgm"), image).expect("written");
    let yaml = format!(
        "image: a.pgm\nmode: trinary\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n\
         occupied_thresh: 0.65\nfree_thresh: {free_thresh}\n"
    );
    let path = folder.path().join("a.yaml");
    std::fs::write(&path, yaml).expect("written");
    load(&path).expect("a map")
}

#[test]
fn the_gray_of_unknown_that_the_default_of_nav2_makes_free_is_suspicious() {
    let grays = [[205; 16], [0; 16], [254; 16], [254; 16]].concat();
    let map = read_grays("0.25", &grays);
    assert_eq!(map.counts().free, 48, "as map_server reads it");
    assert_eq!(
        findings(&map),
        [
            "suspicious: pixels of the gray 205, which map_saver writes for unknown, are free, because \
          free_thresh is 0.25 (25.0 % of all pixels) (16 times); set `free_thresh: 0.196` if they \
          are unknown"
        ]
    );
    let corrected = read_grays("0.196", &grays);
    assert_eq!((corrected.counts().free, corrected.counts().unknown), (32, 16));
    assert!(findings(&corrected).is_empty());
}

#[test]
fn another_gray_that_is_free_is_suspicious_where_it_is_no_accident() {
    let grays = [[216; 16], [0; 16], [254; 16], [254; 16]].concat();
    let map = read_grays("0.196", &grays);
    assert_eq!(
        findings(&map),
        [
            "suspicious: pixels of the gray 216 are free, because free_thresh is 0.196 (25.0 % of all \
          pixels) (16 times); set `free_thresh: 0.152` if they are unknown"
        ]
    );
    assert_eq!(read_grays("0.152", &grays).counts().unknown, 16);
    let noise = [vec![216, 0], vec![254; 198]].concat();
    assert!(findings(&read_grays("0.196", &noise)).is_empty());
}

#[test]
fn the_threshold_that_is_advised_for_a_gray_makes_it_unknown_and_lighter_ones_free() {
    // Darker ones are occupied.
    for gray in 90..MIN_LIGHT_GRAY {
        let reading = OccupancyRule { free_thresh: thresh_above(gray), ..READING };
        assert_ne!(reading.cell(gray as f64), Free, "{gray}");
        assert_eq!(reading.cell(gray as f64 + 1.0), Free, "{gray}");
    }
}

#[test]
fn an_image_of_16_bits_that_uses_few_of_them_is_suspicious() {
    // Values from 0 to 255 in 16 bits: as good as black.
    let image = ImageBuffer::from_fn(4, 1, |x, _| Luma([x as u16 * 85]));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.png");
    image.save(&path).expect("written");
    let map = load_image(&path, 0.5).expect("a map");
    assert_eq!(map.counts().wall, 4);
    let found = findings(&map);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with(
            "suspicious: no pixel is free; the darkest has 0 and the lightest 1 of 255"
        ),
        "{found:?}"
    );
    let stretched = ImageBuffer::from_fn(4, 1, |x, _| Luma([x as u16 * 21845]));
    stretched.save(&path).expect("written");
    let map = load_image(&path, 0.5).expect("a map");
    assert_eq!(map.pixels(), [Wall, Wall, Unknown, Free]);
    assert!(findings(&map).is_empty());
}

#[test]
fn a_map_without_walls_is_suspicious() {
    let found = findings(&read_grays("0.196", &[254; 8]));
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(
        found[0].starts_with("suspicious: no pixel is occupied; the darkest has 254"),
        "{found:?}"
    );
}

#[test]
fn an_image_whose_every_pixel_is_transparent_is_read_by_its_grays() {
    let row = read_row("negate: 0", &[[0, 0], [254, 0], [205, 0]]);
    assert_eq!(row.pixels(), [Wall, Free, Unknown]);
    assert!(
        findings(&row)[0].starts_with("guessed: transparency does not count"),
        "{:?}",
        findings(&row)
    );
    // Nothing at all is drawn.
    assert_eq!(read_row("negate: 0", &[[0, 0], [0, 0]]).pixels(), [Free, Free]);
}

#[test]
fn an_image_of_grays_under_the_mode_raw_is_suspicious() {
    let row = read_row("mode: raw\nnegate: 0", &[[0, 255], [205, 255], [254, 255], [255, 255]]);
    assert_eq!(row.pixels(), [Free, Unknown, Unknown, Unknown], "as map_server reads it");
    let said = findings(&row);
    assert!(said[0].starts_with("suspicious: values of the mode raw from 101 to 254"), "{said:?}");
    // Black and white alone: the walls of the drawing are free.
    let row = read_row("mode: raw\nnegate: 0", &[[0, 255], [255, 255]]);
    assert_eq!(row.pixels(), [Free, Unknown], "as map_server reads it");
    let said = findings(&row);
    assert!(
        said[0].starts_with("suspicious: no pixel is occupied in the mode raw")
            && said[0].ends_with("set `mode: trinary` if dark pixels are walls"),
        "{said:?}"
    );
    let row = read_row("mode: raw\nnegate: 0", &[[0, 255], [100, 255], [255, 255]]);
    assert!(findings(&row).is_empty(), "{:?}", findings(&row));
}

#[test]
fn bytes_behind_an_image_are_said() {
    let (_folder, path) = written("a.pgm", b"P5 1 2 255\n\xff\x00P5 1 2 255\n\xff\x00");
    let said = findings(&load(&path).expect("a map"));
    assert!(said[0].starts_with("not used: 13 bytes behind the pixels"), "{said:?}");
}

#[test]
fn a_yaml_file_of_absurd_size_is_refused() {
    let (_folder, path) = written("a.pgm", IMAGE);
    std::fs::write(&path, "#".repeat(1 << 20)).expect("written");
    assert!(load(&path).is_err());
}
