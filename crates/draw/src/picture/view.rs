//! The direction from which a picture shows things in space.

use super::canvas::Camera;
use sidestep_kernel::math::{cos, sin};
use std::fmt;
use std::str::FromStr;

/// Largest azimuth in degrees, either way: a whole turn.
const MAX_AZIMUTH_DEG: f64 = 360.0;
/// Largest elevation in degrees, either way: straight from above, or from below.
const MAX_ELEVATION_DEG: f64 = 90.0;
/// The views with a name, and what has to be given for any other.
const FORMS: &str = "top, side, front or AZIMUTH,ELEVATION in degrees, like -60,30";

/// The direction from which a picture shows a run; all views are parallel projections.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum PictureView {
    /// From above where all lies in a plane, and of traffic, as a plan; otherwise the view that shows most of the agents.
    #[default]
    Usual,
    /// From above: x to the right, y up.
    Top,
    /// From the end of the x axis: y to the right, z up.
    Side,
    /// From the beginning of the y axis: x to the right, z up.
    Front,
    /// From any direction.
    From {
        /// The direction of the eye about the vertical, counterclockwise from the x axis.
        azimuth_deg: f64,
        /// The angle of the eye above the horizon; below zero, things are seen from below.
        elevation_deg: f64,
    },
}

impl PictureView {
    /// Returns the names of the two axes that a picture of two axes has, and its camera; none for views that show three.
    pub(crate) fn two_axes(self) -> Option<([&'static str; 2], Camera)> {
        match self {
            Self::Top => Some((["x", "y"], Camera::ABOVE)),
            Self::Side => Some((["y", "z"], Camera::SIDE)),
            Self::Front => Some((["x", "z"], Camera::FRONT)),
            Self::Usual | Self::From { .. } => None,
        }
    }

    /// Returns whether it shows a plane, or traffic, from above.
    pub(crate) fn is_from_above(self) -> bool {
        matches!(self, Self::Usual | Self::Top)
    }

    /// Returns its camera; none for the view that depends on what is shown.
    pub(crate) fn camera(self) -> Option<Camera> {
        match self {
            Self::Usual => None,
            Self::Top => Some(Camera::ABOVE),
            Self::Side => Some(Camera::SIDE),
            Self::Front => Some(Camera::FRONT),
            Self::From { azimuth_deg, elevation_deg } => {
                Some(Camera::from_angles(azimuth_deg.to_radians(), elevation_deg.to_radians()))
            }
        }
    }
}

impl Camera {
    /// View from a direction: an angle about the vertical, counterclockwise from the x axis, and one above the horizon.
    pub(crate) fn from_angles(azimuth_rad: f64, elevation_rad: f64) -> Self {
        let across = [cos(azimuth_rad), sin(azimuth_rad)];
        let level = cos(elevation_rad);
        let above = sin(elevation_rad);
        Self {
            right: [-across[1], across[0], 0.0],
            up: [-above * across[0], -above * across[1], level],
            to_eye: [level * across[0], level * across[1], above],
        }
    }
}

impl FromStr for PictureView {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "top" => return Ok(Self::Top),
            "side" => return Ok(Self::Side),
            "front" => return Ok(Self::Front),
            _ => {}
        }
        let wrong = || format!("`{text}` is no view: give {FORMS}");
        let (azimuth, elevation) = text.split_once(',').ok_or_else(wrong)?;
        let azimuth_deg: f64 = azimuth.trim().parse().map_err(|_| wrong())?;
        let elevation_deg: f64 = elevation.trim().parse().map_err(|_| wrong())?;
        // A number that is not one is in no range.
        let is_azimuth = (-MAX_AZIMUTH_DEG..=MAX_AZIMUTH_DEG).contains(&azimuth_deg);
        let is_elevation = (-MAX_ELEVATION_DEG..=MAX_ELEVATION_DEG).contains(&elevation_deg);
        if is_azimuth && is_elevation {
            Ok(Self::From { azimuth_deg, elevation_deg })
        } else {
            Err(format!(
                "`{text}` is no view: the azimuth is from -360 to 360 degrees, the elevation from -90 to 90"
            ))
        }
    }
}

impl fmt::Display for PictureView {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Usual => out.write_str("usual"),
            Self::Top => out.write_str("top"),
            Self::Side => out.write_str("side"),
            Self::Front => out.write_str("front"),
            Self::From { azimuth_deg, elevation_deg } => {
                write!(out, "{azimuth_deg},{elevation_deg}")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_are_read_as_they_are_written() {
        for text in ["top", "side", "front", "-60,30", "45.5,-90"] {
            let view: PictureView = text.parse().expect("a view");
            assert_eq!(view.to_string(), text);
        }
        for (text, words) in
            [("left", "top, side, front"), ("30", "AZIMUTH,ELEVATION"), ("0,91", "from -90 to 90")]
        {
            let error = text.parse::<PictureView>().expect_err("no view");
            assert!(error.contains(text) && error.contains(words), "{error}");
        }
        assert!("NaN,0".parse::<PictureView>().is_err());
    }

    #[test]
    fn the_named_views_are_those_of_their_angles() {
        let pairs = [
            (Camera::SIDE, (0.0, 0.0)),
            (Camera::FRONT, (-90.0, 0.0)),
            (Camera::ABOVE, (-90.0, 90.0)),
        ];
        for (camera, (azimuth_deg, elevation_deg)) in pairs {
            let angles = PictureView::From { azimuth_deg, elevation_deg };
            let same = angles.camera().expect("a camera");
            let sides =
                [(camera.right, same.right), (camera.up, same.up), (camera.to_eye, same.to_eye)];
            for (k, (a, b)) in (0..3).flat_map(|k| sides.map(|side| (k, side))) {
                assert!((a[k] - b[k]).abs() < 1e-12, "{azimuth_deg}: {a:?} {b:?}");
            }
        }
    }
}
