//! The scenarios that the program carries: the page lists them with a picture and a line each, and opens them without a
//! file.

use crate::protocol::{GalleryEntry, Problem, ReplyBody};
use serde::Deserialize;
use sidestep_scenario::{Source, Worlds};

/// A scenario that the program carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShippedScenario {
    /// Its name, which is unique, such as `robots/office`.
    pub name: &'static str,
    /// Its text.
    pub text: &'static str,
    /// The files to which it refers, by their paths in it.
    pub files: &'static [(&'static str, &'static [u8])],
    /// A small picture of it, as PNG.
    pub picture_png: &'static [u8],
}

/// The keys of a scenario that its entry has.
#[derive(Deserialize)]
struct Header {
    world: String,
    #[serde(default)]
    name: String,
}

impl ShippedScenario {
    /// Returns its entry in the list; `None` where the program has no such world.
    fn entry(&self, worlds: &Worlds) -> Option<GalleryEntry> {
        let Header { world, name } = Source::new(self.name, self.text, "").parse().ok()?;
        worlds.find(&world)?;
        let title = if name.is_empty() { self.name.to_string() } else { name };
        Some(GalleryEntry {
            name: self.name.into(),
            world,
            title,
            about: first_sentence(self.text),
        })
    }
}

/// Returns the scenario of a name.
///
/// # Errors
/// When there is none.
pub(crate) fn find_shipped(
    gallery: &[ShippedScenario],
    name: &str,
) -> Result<ShippedScenario, Problem> {
    gallery.iter().find(|shipped| shipped.name == name).copied().ok_or_else(|| {
        let names: Vec<&str> = gallery.iter().map(|shipped| shipped.name).collect();
        let remedy = match names.as_slice() {
            [] => "open a file instead".to_string(),
            _ => format!("give one of {}", names.join(", ")),
        };
        Problem::new(name, "this program carries no such scenario", remedy)
    })
}

/// Lists the scenarios of worlds that the program has.
pub(crate) fn gallery_reply(gallery: &[ShippedScenario], worlds: &Worlds) -> ReplyBody {
    let entries = gallery.iter().filter_map(|shipped| shipped.entry(worlds));
    ReplyBody::Gallery { entries: entries.collect() }
}

/// Returns the first sentence of the comment at the head of a scenario.
fn first_sentence(text: &str) -> String {
    let comments = text.lines().map_while(|line| line.strip_prefix('#'));
    let paragraph = comments.map(str::trim).take_while(|line| !line.is_empty());
    let words = paragraph.collect::<Vec<&str>>().join(" ");
    match words.find(". ") {
        Some(end) => words[..=end].to_string(),
        None => words,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::WORLDS;

    const TEXT: &str = "# A hall of 2.5 m, and\n# robots in it. Try --regime noisy.\n#\n# More.\n\nformat = 1\n\
        world = \"robots\"\nname = \"A hall\"\n";
    const HALL: ShippedScenario =
        ShippedScenario { name: "robots/hall", text: TEXT, files: &[], picture_png: &[] };

    #[test]
    fn an_entry_has_the_name_of_the_scenario_and_the_first_sentence_of_its_head() {
        let ReplyBody::Gallery { entries } = gallery_reply(&[HALL], &WORLDS) else {
            panic!("no gallery")
        };
        let entry = GalleryEntry {
            name: "robots/hall".into(),
            world: "robots".into(),
            title: "A hall".into(),
            about: "A hall of 2.5 m, and robots in it.".into(),
        };
        assert_eq!(entries, [entry]);
    }

    #[test]
    fn scenarios_of_worlds_that_the_program_does_not_have_are_not_listed() {
        let other = ShippedScenario { text: "format = 1\nworld = \"ocean\"\n", ..HALL };
        assert_eq!(gallery_reply(&[other], &WORLDS), ReplyBody::Gallery { entries: Vec::new() });
    }

    #[test]
    fn a_wrong_name_is_told_with_the_right_ones() {
        assert_eq!(find_shipped(&[HALL], "robots/hall"), Ok(HALL));
        let problem = find_shipped(&[HALL], "robots/hal").expect_err("none of that name");
        assert_eq!(&*problem.remedy, "give one of robots/hall");
    }
}
