//! What the pixels of an image are like, and what of it may be read otherwise than meant.

use super::ThresholdSource;
use crate::image::{Bitmap, Shade};
use crate::map_yaml::{MapMode, OccupancyRule};
use crate::report::{Finding, ImportReport, Treatment};
use sidestep_map::Cell;

/// The gray that `map_saver` writes for unknown pixels.
const UNKNOWN_GRAY: usize = 205;

/// Grays from this one on are as bright as free pixels are written (254), with room for noise.
pub(super) const MIN_LIGHT_GRAY: usize = 240;

/// Share of the pixels from which a gray is no accident: the edges of lines and the noise of drawings have fewer of
/// any one gray.
const MIN_SUSPICIOUS_SHARE: f64 = 0.01;

/// What the pixels of an image are like, before any is read as a cell.
#[derive(Debug)]
pub(super) struct Survey {
    /// Number of all pixels.
    pixels: usize,
    /// Number of pixels that are not opaque.
    pub(super) transparent: usize,
    /// The greatest opacity of a pixel, from 0 to 1.
    pub(super) max_opacity: f64,
    /// Number of opaque pixels whose brightness is that of free ground.
    pub(super) opaque_free: usize,
    /// Number of those of each whole gray.
    free_grays: [usize; 256],
    /// Number of opaque pixels between free and occupied.
    opaque_between: usize,
    /// Number of opaque colored pixels that Nav2 reads otherwise.
    colored: usize,
    /// Number of opaque pixels whose occupancy is a threshold.
    at_threshold: usize,
    /// Number of pixels between free and occupied of the mode raw, and of those above occupied and below unknown.
    raw_between: usize,
    raw_beyond: usize,
    /// The darkest and the lightest brightness.
    pub(super) range: [f64; 2],
}

impl Survey {
    pub(super) fn of(image: &Bitmap, reading: OccupancyRule) -> Self {
        let mut survey = Self {
            pixels: 0,
            transparent: 0,
            max_opacity: 0.0,
            opaque_free: 0,
            opaque_between: 0,
            colored: 0,
            at_threshold: 0,
            raw_between: 0,
            raw_beyond: 0,
            free_grays: [0; 256],
            range: [255.0, 0.0],
        };
        image.map_shades(|shade| survey.add(shade, reading));
        survey
    }

    fn add(&mut self, shade: Shade, reading: OccupancyRule) {
        self.pixels += 1;
        self.range = [self.range[0].min(shade.brightness), self.range[1].max(shade.brightness)];
        self.max_opacity = self.max_opacity.max(shade.opacity);
        if reading.mode == MapMode::Raw {
            self.raw_between += usize::from(reading.is_between_raw(shade.brightness));
            self.raw_beyond += usize::from(reading.is_beyond_raw(shade.brightness));
        }
        if shade.opacity < 1.0 {
            self.transparent += 1;
            return;
        }
        if reading.mode != MapMode::Raw {
            let is_other = reading.cell(shade.luma) != reading.cell(shade.brightness);
            self.colored += usize::from(is_other);
            self.at_threshold += usize::from(reading.is_at_threshold(shade.brightness));
        }
        match reading.cell(shade.brightness) {
            Cell::Wall => {}
            Cell::Unknown => self.opaque_between += 1,
            Cell::Free => {
                self.opaque_free += 1;
                if shade.brightness.fract() == 0.0 {
                    self.free_grays[shade.brightness as usize] += 1;
                }
            }
        }
    }

    /// Records pixels that the map servers of ROS 1 and of Nav2 read in different ways.
    pub(super) fn record_choices(&self, reading: OccupancyRule, report: &mut ImportReport) {
        let colored = "colored pixels count by the mean of their channels as in ROS 1; Nav2 weighs the channels, and \
                       reads them as other cells";
        let at_threshold = "pixels whose occupancy is a threshold are unknown as in ROS 1; in Nav2 they are free or \
                            occupied";
        let raw = "values of the mode raw between 0 and 100 are compared with the thresholds, and map_server hands them on";
        let choices = [
            (self.colored, colored, "save the image in grays"),
            (self.at_threshold, at_threshold, "give the threshold another digit"),
            (self.raw_between, raw, "write 0, 100 and 255 alone for free, occupied and unknown"),
        ];
        for (count, rule, remedy) in choices.into_iter().filter(|(count, ..)| *count > 0) {
            report.findings.push(Finding {
                treatment: Treatment::Guessed,
                rule: format!("{rule} ({})", self.share(count)),
                count: count as u64,
                places: Vec::new(),
                remedy: remedy.to_string(),
            });
        }
        if reading.mode == MapMode::Raw && reading.negate {
            let rule = "`negate` turns the values of the mode raw around, as in ROS 1; Nav2 does not obey it";
            report.record(Treatment::Guessed, rule, "", "set `negate: 0`, and negate the image");
        }
    }

    /// Records values of the mode raw that no program writes: an image of grays is none of occupancies.
    pub(super) fn record_grays_of_raw(&self, report: &mut ImportReport) {
        if self.raw_beyond == 0 {
            return;
        }
        report.findings.push(Finding {
            treatment: Treatment::Suspicious,
            rule: format!(
                "values of the mode raw from 101 to 254, which are unknown ({}); black is free in this mode",
                self.share(self.raw_beyond)
            ),
            count: self.raw_beyond as u64,
            places: Vec::new(),
            remedy: "set `mode: trinary` if dark pixels are walls".to_string(),
        });
    }

    /// Records shades that `map_server` gives an occupancy between free and occupied.
    pub(super) fn record_shades(&self, mode: MapMode, report: &mut ImportReport) {
        if mode != MapMode::Scale || self.opaque_between == 0 {
            return;
        }
        report.findings.push(Finding {
            treatment: Treatment::NotUsed,
            rule: "shades between free and occupied of the mode scale, which are unknown"
                .to_string(),
            count: self.opaque_between as u64,
            places: Vec::new(),
            remedy: String::new(),
        });
    }

    /// Records grays between black and white that are read as free, and can hardly be meant so.
    pub(super) fn record_grays(&self, thresholds: ThresholdSource, report: &mut ImportReport) {
        let reading = thresholds.reading();
        // In the mode raw values are no grays, and with `negate` free pixels are dark.
        if reading.mode == MapMode::Raw || reading.negate {
            return;
        }
        let min_count = (MIN_SUSPICIOUS_SHARE * self.pixels as f64).max(1.0);
        for (gray, &count) in self.free_grays.iter().enumerate().take(MIN_LIGHT_GRAY) {
            if (count as f64) < min_count {
                continue;
            }
            let meaning = match gray {
                UNKNOWN_GRAY => ", which map_saver writes for unknown,",
                _ => "",
            };
            let rule = format!(
                "pixels of the gray {gray}{meaning} are free, because free_thresh is {} ({})",
                reading.free_thresh,
                self.share(count)
            );
            let remedy = format!(
                "{} `free_thresh: {}` if they are unknown",
                thresholds.remedy(),
                thresh_above(gray)
            );
            let treatment = Treatment::Suspicious;
            let places = Vec::new();
            report.findings.push(Finding { treatment, rule, count: count as u64, places, remedy });
        }
    }

    /// Records that no pixel is free, or none is occupied: such a map is of no use, and mostly read otherwise than meant.
    pub(super) fn record_single_kind(
        &self,
        cells: &[Cell],
        mode: MapMode,
        report: &mut ImportReport,
    ) {
        if mode == MapMode::Raw {
            // Grays of an image are named by themselves.
            if self.raw_beyond == 0 && !cells.contains(&Cell::Wall) {
                let rule = "no pixel is occupied in the mode raw, where 0 is free, 100 occupied and 255 unknown";
                let remedy = "set `mode: trinary` if dark pixels are walls";
                report.record(Treatment::Suspicious, rule, "", remedy);
            }
            return;
        }
        let [darkest, lightest] = self.range;
        for (cell, word) in [(Cell::Free, "free"), (Cell::Wall, "occupied")] {
            if cells.contains(&cell) {
                continue;
            }
            let rule = format!(
                "no pixel is {word}; the darkest has {darkest:.0} and the lightest {lightest:.0} of 255"
            );
            let remedy = "dark pixels have to be walls and light ones free; for the contrary set \
                          `negate: 1` in the .yaml file, and for values that do not reach from 0 to 255 \
                          stretch the contrast of the image";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
    }

    /// Returns a number of pixels as a share of all.
    pub(super) fn share(&self, pixels: usize) -> String {
        format!("{:.1} % of all pixels", 100.0 * pixels as f64 / self.pixels as f64)
    }
}

/// Returns the largest threshold of three digits under which a gray is not free, and lighter ones are; for the gray 205
/// the one that everybody uses.
pub(super) fn thresh_above(gray: usize) -> f64 {
    let occupancy = (255 - gray) as f64 / 255.0;
    (occupancy * 1000.0).floor() / 1000.0
}
