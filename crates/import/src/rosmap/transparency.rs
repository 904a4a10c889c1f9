//! What transparent pixels stand for.

use super::survey::Survey;
use crate::image::Shade;
use crate::map_yaml::{MapMode, OccupancyRule};
use crate::report::{Finding, ImportReport, Treatment};
use sidestep_map::Cell;

/// What the transparent pixels of an image stand for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum TransparentGround {
    /// Only opacities are looked at, as by `map_server` in the mode `scale`.
    UnknownByFormat,
    /// The image shows free ground as well, so that what it leaves out is not free.
    Unknown,
    /// Nothing opaque is free: the image is a drawing in ink, which viewers show on white.
    Free,
    /// The mode `raw` has no transparency.
    NotUsed,
    /// All pixels are fully transparent, and have grays all the same.
    Unset,
}

impl TransparentGround {
    pub(super) fn of(survey: &Survey, mode: MapMode) -> Self {
        let [darkest, lightest] = survey.range;
        match mode {
            // Nothing would be seen of the image at all: its program has not filled the channel in.
            MapMode::Trinary | MapMode::Scale
                if survey.max_opacity == 0.0 && darkest < lightest =>
            {
                Self::Unset
            }
            MapMode::Scale => Self::UnknownByFormat,
            MapMode::Raw => Self::NotUsed,
            MapMode::Trinary if survey.opaque_free > 0 => Self::Unknown,
            MapMode::Trinary => Self::Free,
        }
    }

    /// Returns the cell of a pixel. The edges of drawn lines are half transparent: such a pixel is an obstacle where
    /// it would be one on free ground.
    pub(super) fn cell(self, shade: Shade, reading: OccupancyRule) -> Cell {
        let Shade { brightness, opacity, .. } = shade;
        if opacity >= 1.0 || [Self::NotUsed, Self::Unset].contains(&self) {
            return reading.cell(brightness);
        }
        let on_ground = opacity * brightness + (1.0 - opacity) * reading.ground_brightness();
        match (self, reading.cell(on_ground)) {
            (Self::UnknownByFormat, _) => Cell::Unknown,
            (Self::Unknown, Cell::Free) => Cell::Unknown,
            (_, cell) => cell,
        }
    }
}

/// Records what transparent pixels were taken for.
pub(super) fn record_transparency(
    survey: &Survey,
    ground: TransparentGround,
    report: &mut ImportReport,
) {
    if survey.transparent == 0 {
        return;
    }
    let share = survey.share(survey.transparent);
    report.add_fact("transparent pixels", format!("{} ({share})", survey.transparent));
    let (treatment, rule, remedy) = match ground {
        TransparentGround::UnknownByFormat => return,
        TransparentGround::Unknown => (
            Treatment::Guessed,
            format!("transparent pixels are unknown, because opaque ones are free ({share})"),
            "save the image without transparency, on a white ground, if they are free",
        ),
        TransparentGround::Free => (
            Treatment::Guessed,
            format!(
                "transparent pixels are free, because the image has nothing but ink on them ({share})"
            ),
            "save the image without transparency, on a gray ground (128), if they are unknown",
        ),
        TransparentGround::Unset => (
            Treatment::Guessed,
            "transparency does not count, because every pixel is fully transparent".to_string(),
            "save the image without transparency",
        ),
        TransparentGround::NotUsed => (
            Treatment::NotUsed,
            format!("the transparency of pixels, as in map_server's mode raw ({share})"),
            "",
        ),
    };
    let count = survey.transparent as u64;
    let remedy = remedy.to_string();
    report.findings.push(Finding { treatment, rule, count, places: Vec::new(), remedy });
}
