//! Imports between the files of a package: arrows back up between layers, and circles.

use crate::source::Source;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

/// Layers of a crate: lists of modules, the lowest layer first.
pub(crate) type Layers = Vec<Vec<String>>;

/// For each file the places of the files in the list of sources that it names.
pub(crate) type Imports = Vec<BTreeSet<usize>>;

/// Imports that are followed to where an item is declared. A circle of them would have no end.
const MAX_DETOURS: usize = 16;

/// Reads the layers of each crate of the workspace at `root`, or of this one where that has none.
pub(crate) fn read_layers(root: &Path) -> Result<BTreeMap<String, Layers>, String> {
    let own = root.join("xtask/layers.toml");
    let path = if own.exists() { own } else { crate::root().join("xtask/layers.toml") };
    let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    toml::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Returns the layer of a module: that of the innermost module around it that is in the table.
pub(crate) fn layer(module: &[String], layers: &Layers) -> Option<usize> {
    (2..=module.len()).rev().find_map(|length| {
        let name = module[1..length].join("::");
        layers.iter().position(|layer| layer.contains(&name))
    })
}

/// Returns the imports from a file to one of a higher layer.
pub(crate) fn arrows_back_up(
    sources: &[Source],
    imports: &Imports,
    layers: &Layers,
) -> Vec<String> {
    let mut arrows = Vec::new();
    for (from, others) in sources.iter().zip(imports) {
        for to in others.iter().map(|other| &sources[*other]) {
            let low = layer(&from.module, layers);
            let high = layer(&to.module, layers);
            if low.zip(high).is_some_and(|(low, high)| low < high) {
                arrows.push(format!("{} -> {}", from.path.display(), to.path.display()));
            }
        }
    }
    arrows
}

/// Returns the circles: files that reach each other.
pub(crate) fn circles(sources: &[Source], imports: &Imports) -> BTreeSet<String> {
    let reached: Imports = imports.iter().map(|others| reached(others, imports)).collect();
    let mut circles = BTreeSet::new();
    for (file, others) in reached.iter().enumerate() {
        let circle = others.iter().filter(|other| reached[**other].contains(&file));
        let circle: Vec<String> =
            circle.map(|other| sources[*other].path.display().to_string()).collect();
        circles.extend((!circle.is_empty()).then(|| circle.join(" ")));
    }
    circles
}

/// Returns all files that imports lead to from those of one file.
fn reached(others: &BTreeSet<usize>, imports: &Imports) -> BTreeSet<usize> {
    let mut reached = others.clone();
    let mut open = Vec::from_iter(others);
    while let Some(file) = open.pop() {
        open.extend(imports[*file].iter().filter(|next| reached.insert(**next)));
    }
    reached
}

/// Returns what each file names, its own modules and those that it lies in aside.
pub(crate) fn of(sources: &[Source]) -> Imports {
    let modules = Modules::of(sources);
    let mut imports = Imports::new();
    for source in sources {
        let mut others = BTreeSet::new();
        for path in &source.paths {
            if let Some(file) = modules.declaring(&path.module, &path.names, MAX_DETOURS)
                && !sources[file].module.starts_with(&source.module)
                && !source.module.starts_with(&sources[file].module)
            {
                others.insert(file);
            }
        }
        imports.push(others);
    }
    imports
}

struct Modules<'a> {
    /// File of each module, inline modules included.
    files: HashMap<&'a [String], usize>,
    /// Path that a name stands for, by module and name.
    imports: HashMap<(&'a [String], &'a str), &'a [String]>,
}

impl<'a> Modules<'a> {
    fn of(sources: &'a [Source]) -> Modules<'a> {
        let mut modules = Modules { files: HashMap::new(), imports: HashMap::new() };
        for (file, source) in sources.iter().enumerate() {
            modules.files.insert(&source.module, file);
            for path in &source.paths {
                modules.files.entry(&path.module).or_insert(file);
                if let Some(name) = &path.import {
                    modules.imports.insert((&path.module, name), &path.names);
                }
            }
        }
        modules
    }

    /// Returns the file that declares the item of a path, seen from `module`; none if it is of another crate.
    fn declaring(&self, module: &[String], path: &[String], detours: usize) -> Option<usize> {
        let mut here = match path.first()?.as_str() {
            "crate" => module[..1].to_vec(),
            "self" => module.to_vec(),
            "super" => module[..module.len() - 1].to_vec(),
            child => [module, &[child.to_string()]].concat(),
        };
        self.files.get(here.as_slice())?;
        for name in &path[1..] {
            let inner = [here.as_slice(), std::slice::from_ref(name)].concat();
            let import = self.imports.get(&(here.as_slice(), name.as_str()));
            if name == "super" {
                here.pop();
            } else if self.files.contains_key(inner.as_slice()) {
                here = inner;
            } else if let Some(import) = import.filter(|_| detours > 0)
                && let Some(file) = self.declaring(&here, import, detours - 1)
            {
                return Some(file);
            } else {
                break;
            }
        }
        self.files.get(here.as_slice()).copied()
    }
}
