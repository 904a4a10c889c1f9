//! The scenarios that the program carries for the welcome page of the studio, with a picture of each.
//!
//! They lie in the folder `gallery/` of this crate; `scenarios/` has copies of the texts, which a test compares, and
//! another one draws the pictures anew (`pictures.rs`).

#[cfg(test)]
mod pictures;

use sidestep_server::ShippedScenario;

/// A scenario by its name, with the files beside it to which it refers.
macro_rules! shipped {
    ($name:literal $(, $world:literal / $file:literal)*) => {
        ShippedScenario {
            name: $name,
            text: include_str!(concat!("../../gallery/", $name, ".toml")),
            files: &[$(($file, include_bytes!(concat!("../../gallery/", $world, "/", $file)))),*],
            picture_png: include_bytes!(concat!("../../gallery/", $name, ".png")),
        }
    };
}

/// The scenarios, world by world, those that show the most first.
pub(crate) static SHIPPED: [ShippedScenario; 27] = [
    shipped!("robots/office"),
    shipped!("robots/crossing"),
    shipped!("robots/corridor"),
    shipped!("robots/planner"),
    shipped!("robots/radio"),
    shipped!("robots/one-robot"),
    shipped!("robots/fleet"),
    shipped!("chain/serpentine"),
    shipped!("chain/snake3d"),
    shipped!("chain/arm", "chain" / "arm.urdf"),
    shipped!("chain/movers"),
    shipped!("chain/movers-apart"),
    shipped!("chain/pushed-and-pulled"),
    shipped!("chain/hemmed-in"),
    shipped!("chain/broken"),
    shipped!("chain/team"),
    shipped!("chain/fleet"),
    shipped!("airspace/superconflict"),
    shipped!("airspace/departures"),
    shipped!("airspace/areas"),
    shipped!("airspace/wind-layers"),
    shipped!("airspace/levels-and-speeds"),
    shipped!("airspace/mixed-types"),
    shipped!("airspace/mvp-speed"),
    shipped!("airspace/mvp-vertical"),
    shipped!("airspace/surveillance"),
    shipped!("airspace/multirotors"),
];
