//! The behavior `random` of a scenario: weights by the actions' names.

use super::BehaviourSection;
use crate::decide::RandomPolicy;
use sidestep_scenario::suggestion;
use std::collections::BTreeMap;

/// Cause and remedy of an error in a behavior; the caller knows the place.
pub(super) type UnlocatedError = (String, String);

/// Returns the behavior. Without weights the standard actions are equally likely; after a contact
/// the same weights hold unless others are given.
pub(super) fn behaviour(
    s: &BehaviourSection,
    actions: &[String],
) -> Result<RandomPolicy, UnlocatedError> {
    let Some(usual) = &s.weights else {
        return match &s.weights_after_contact {
            None => Ok(RandomPolicy::uniform()),
            Some(_) => Err((
                "`weights_after_contact` without `weights`".into(),
                "add weights = { forward = 1 }".into(),
            )),
        };
    };
    let after_contact = s.weights_after_contact.as_ref().unwrap_or(usual);
    let random = RandomPolicy::new(row(usual, actions)?, row(after_contact, actions)?);
    Ok(random.expect("the rows were brought to sum to 1"))
}

/// Returns weights by the actions' names as probabilities by their ids.
fn row(weights: &BTreeMap<String, f64>, actions: &[String]) -> Result<Vec<f64>, UnlocatedError> {
    let sum: f64 = weights.values().sum();
    if !(sum > 0.0 && sum.is_finite() && weights.values().all(|w| *w >= 0.0)) {
        let cause = "a negative weight, or weights that are all 0 or beyond all numbers";
        return Err((cause.into(), "give weights of at least 0, one of them above 0".into()));
    }
    let mut row = vec![0.0; actions.len()];
    for (name, weight) in weights {
        row[action_id(name, actions)?] = weight / sum;
    }
    Ok(row)
}

/// Returns the index of an action among those of an effector.
pub(super) fn action_id(name: &str, actions: &[String]) -> Result<usize, UnlocatedError> {
    actions.iter().position(|action| action == name).ok_or_else(|| {
        let known: Vec<&str> = actions.iter().map(String::as_str).collect();
        (format!("unknown action `{name}`"), suggestion(name, &known))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<RandomPolicy, UnlocatedError> {
        let section: BehaviourSection = toml::from_str(text).expect("a section");
        behaviour(&section, &["forward", "left", "right", "stay", "spin"].map(String::from))
    }

    #[test]
    fn weights_become_probabilities_by_action() {
        let random = read("kind = 'random'\nweights = { forward = 3, spin = 1 }").expect("fits");
        assert_eq!(random.probabilities(false), [0.75, 0.0, 0.0, 0.0, 0.25]);
        assert_eq!(random.probabilities(true), [0.75, 0.0, 0.0, 0.0, 0.25]);
        assert_eq!(read("kind = 'random'").expect("fits"), RandomPolicy::uniform());
    }

    #[test]
    fn weights_that_mean_nothing_are_refused() {
        let wrong = |text: &str| read(&format!("kind = 'random'\n{text}")).expect_err(text);
        assert_eq!(wrong("weights = { foward = 1 }").1, "did you mean `forward`?");
        wrong("weights = {}");
        wrong("weights = { left = -1, right = 3 }");
        wrong("weights = { left = inf }");
        wrong("weights = { left = nan }");
        wrong("weights_after_contact = { left = 1 }");
    }
}
