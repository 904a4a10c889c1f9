//! Which runs of a sweep get a replay.

use super::FinishedRun;
use std::fmt;
use std::str::FromStr;

/// Number of replays, unless others are requested: as many as one looks through.
const DEFAULT_REPLAYS: usize = 24;

/// The runs that get a replay.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunChoice {
    /// All that did not fail.
    All,
    /// The outliers.
    Outliers,
    /// So many: the first of each variant, then outliers, the farthest first, then others by seed.
    Number(usize),
}

impl Default for RunChoice {
    fn default() -> Self {
        Self::Number(DEFAULT_REPLAYS)
    }
}

impl FromStr for RunChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            "outliers" => Ok(Self::Outliers),
            _ => match text.parse() {
                Ok(number) if number > 0 => Ok(Self::Number(number)),
                _ => Err(format!("`{text}` is not `all`, `outliers` or a number of runs")),
            },
        }
    }
}

impl fmt::Display for RunChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Outliers => f.write_str("outliers"),
            Self::Number(number) => write!(f, "{number}"),
        }
    }
}

impl RunChoice {
    /// Returns the indices of the chosen runs, in rising order.
    pub(super) fn choose(self, runs: &[FinishedRun]) -> Vec<usize> {
        let finished = (0..runs.len()).filter(|&k| runs[k].end.is_some());
        let mut chosen: Vec<usize> = match self {
            Self::All => finished.collect(),
            Self::Outliers => finished.filter(|&k| runs[k].distance > 0.0).collect(),
            Self::Number(number) => {
                let mut order: Vec<usize> = finished.collect();
                order.sort_by(|&a, &b| {
                    rank(&runs[a]).cmp(&rank(&runs[b])).then_with(|| {
                        let farther_first = runs[b].distance.total_cmp(&runs[a].distance);
                        farther_first.then_with(|| by_seed(&runs[a]).cmp(&by_seed(&runs[b])))
                    })
                });
                order.truncate(number);
                order
            }
        };
        chosen.sort_unstable();
        chosen
    }
}

/// Returns the class of a run, the one that is chosen first being the lowest.
fn rank(run: &FinishedRun) -> u8 {
    match run {
        run if run.trial.replicate == 0 => 0,
        run if run.distance > 0.0 => 1,
        _ => 2,
    }
}

fn by_seed(run: &FinishedRun) -> (u32, u32) {
    (run.trial.replicate, run.trial.variant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep_experiment::sweep::Trial;
    use sidestep_session::RunEnd;

    fn run(variant: u32, replicate: u32, distance: f64) -> FinishedRun {
        let id = u64::from(10 * variant + replicate);
        let trial = Trial { id, variant, replicate, seed: 5 };
        let end = Some(RunEnd { cycles: 1, digest: String::new() });
        FinishedRun { row: id as usize, trial, end, distance }
    }

    #[test]
    fn the_first_of_each_variant_come_first_then_outliers_by_distance_then_the_other_seeds() {
        let mut runs = vec![run(0, 0, 0.0), run(0, 1, 2.0), run(0, 2, 0.0)];
        runs.extend([run(1, 0, 0.0), run(1, 1, 0.0), run(1, 2, f64::INFINITY), run(1, 3, 0.0)]);
        runs[6].end = None;
        let chosen = |text: &str| text.parse::<RunChoice>().expect("a choice").choose(&runs);
        assert_eq!(chosen("1"), [0]);
        assert_eq!(chosen("3"), [0, 3, 5]);
        assert_eq!(chosen("5"), [0, 1, 3, 4, 5]);
        assert_eq!(chosen("outliers"), [1, 5]);
        assert_eq!(chosen("all"), [0, 1, 2, 3, 4, 5], "a run that failed has none");
        assert_eq!(chosen("99"), chosen("all"));
        assert!("0".parse::<RunChoice>().is_err() && "none".parse::<RunChoice>().is_err());
    }
}
