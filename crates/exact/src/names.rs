//! Names as the POMDP format allows them: a letter, then letters, digits, `-` and `_`.

use std::collections::BTreeSet;

/// Words that mean something else in the format.
const RESERVED: [&str; 16] = [
    "T",
    "O",
    "R",
    "discount",
    "values",
    "states",
    "actions",
    "observations",
    "start",
    "include",
    "exclude",
    "uniform",
    "identity",
    "reset",
    "reward",
    "cost",
];

/// Returns valid names, all different, as close to the given ones as possible.
pub(super) fn valid_names(names: impl IntoIterator<Item = String>) -> Vec<String> {
    let mut used = BTreeSet::new();
    let mut valid = Vec::new();
    for name in names {
        let base = valid_name(&name);
        let mut unique = base.clone();
        let mut copies = 1;
        while used.contains(&unique) {
            copies += 1;
            unique = format!("{base}-{copies}");
        }
        used.insert(unique.clone());
        valid.push(unique);
    }
    valid
}

fn valid_name(name: &str) -> String {
    let mut valid: String = name.chars().map(|c| if is_valid(c) { c } else { '-' }).collect();
    if !valid.starts_with(|c: char| c.is_ascii_alphabetic()) {
        valid.insert(0, 'n');
    }
    if RESERVED.contains(&valid.as_str()) {
        valid.push('-');
    }
    valid
}

fn is_valid(c: char) -> bool {
    c.is_ascii_alphanumeric() || c == '-' || c == '_'
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_valid_and_stay_different() {
        let names = ["forward", "spin left", "spin-left", "4x", "", "reset", "é"];
        let valid = valid_names(names.map(String::from));
        assert_eq!(valid, ["forward", "spin-left", "spin-left-2", "n4x", "n", "reset-", "n-"]);
    }
}
