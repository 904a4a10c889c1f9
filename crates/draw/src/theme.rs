//! Pictures for dark grounds: the same drawing in other colors.

use crate::style::{FAINT_INK, GRID, GROUND, INK};

/// The colors of charts, and those that take their places on a dark ground: as far from it as the others are from
/// white.
pub const DARK_COLORS: [(&str, &str); 14] = [
    (GROUND, "#14171C"),
    (INK, "#E4E7EC"),
    (FAINT_INK, "#A2ABB8"),
    (GRID, "#2F3640"),
    ("#0072B2", "#3D9FE0"),
    ("#D55E00", "#F07F3C"),
    ("#009E73", "#2FC79A"),
    ("#CC79A7", "#E3A0C6"),
    ("#E69F00", "#F2B134"),
    ("#56B4E9", "#9AD4F5"),
    ("#000000", "#F7F7F7"),
    // Walls, ground that is not mapped, and the floor of pictures in space.
    ("#3C3C3C", "#8A919C"),
    ("#EDEBE6", "#2A2E35"),
    ("#F7F7F5", "#1B1F26"),
];

/// Returns a chart in the colors for a dark ground.
pub fn to_dark(svg: &str) -> String {
    let mut dark = svg.to_string();
    for (light, other) in DARK_COLORS {
        for attribute in ["fill", "stroke"] {
            dark = dark
                .replace(&format!("{attribute}=\"{light}\""), &format!("{attribute}=\"{other}\""));
        }
    }
    dark
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::style::series_colors;

    #[test]
    fn every_color_of_a_series_has_one_on_a_dark_ground() {
        for color in series_colors() {
            assert!(DARK_COLORS.iter().any(|(light, _)| *light == color), "{color}");
        }
        assert_eq!(to_dark(r##"<rect fill="#FFFFFF"/>"##), r##"<rect fill="#14171C"/>"##);
    }
}
