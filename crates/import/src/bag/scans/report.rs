//! What is said of the ranges of a topic.

use super::counts::{MAX_NEAR_SHARE, MIN_AT_LIMIT, MIN_SHARE_AT_LIMIT, RangeCounts};
use super::{NoEcho, ScanConvention};
use crate::report::{ImportReport, Treatment};

impl RangeCounts {
    /// Chooses how the driver writes "no echo", and records what is not as REP 117 has it; `topic` is its name.
    pub(in crate::bag) fn convention(
        &self,
        topic: &str,
        given: Option<NoEcho>,
        report: &mut ImportReport,
    ) -> ScanConvention {
        let no_echo = given.or_else(|| self.guess()).unwrap_or(NoEcho::Infinite);
        let convention = ScanConvention {
            no_echo,
            measured_limit_m: self.measured_limit_m(),
            mark_m: self.mark().map(|mark| mark.value_m).filter(|_| no_echo == NoEcho::Maximum),
            is_maximum_no_echo: no_echo == NoEcho::Maximum
                || given.is_none() && self.is_maximum_repeated(),
        };
        self.record(topic, given.is_some(), &convention, report);
        convention
    }

    /// Returns whether ranges are equal to the limit more often than measurements can be.
    fn is_maximum_repeated(&self) -> bool {
        self.at_maximum >= MIN_AT_LIMIT
            && self.at_maximum as f64 >= MIN_SHARE_AT_LIMIT * self.beams as f64
            && !self.is_limit_measured()
    }

    fn count_of(&self, no_echo: NoEcho) -> u64 {
        match no_echo {
            NoEcho::Infinite => self.infinite,
            NoEcho::NotANumber => self.not_a_number,
            NoEcho::Zero => self.zero,
            NoEcho::Maximum => {
                self.at_maximum + self.beyond_maximum + self.mark().map_or(0, |mark| mark.count)
            }
            NoEcho::TooNear => self.too_near,
        }
    }

    fn record(
        &self,
        topic: &str,
        is_given: bool,
        convention: &ScanConvention,
        report: &mut ImportReport,
    ) {
        let percent = |n: u64| {
            format!(
                "{n} of {} ranges, {:.2} %",
                self.beams,
                100.0 * n as f64 / self.beams.max(1) as f64
            )
        };
        let no_echo = convention.no_echo;
        let n = self.count_of(no_echo);
        if !is_given && no_echo != NoEcho::Infinite && n > 0 {
            let rule = format!(
                "{} on {topic} is no echo ({}), as no range is inf, which REP 117 asks for",
                no_echo.describe(),
                percent(n)
            );
            let remedy = "give --no-echo inf where it is no measurement";
            report.record(Treatment::Guessed, rule, "", remedy);
        }
        self.record_doubts(topic, no_echo, report);
        if let Some(limit_m) = convention.measured_limit_m {
            let cause =
                if self.is_limit_measured() { "its own greatest range" } else { "infinite" };
            let rule = format!(
                "range_max of each scan on {topic} is {cause}: {limit_m} m, the greatest of all, is taken for the limit"
            );
            report.record(Treatment::Guessed, rule, "", "");
        }
        let others = [
            (NoEcho::NotANumber, self.not_a_number, "NaN"),
            (NoEcho::Zero, self.zero, "0 or negative"),
        ];
        for (kind, n, name) in others {
            if n > 0 && kind != no_echo {
                let rule =
                    format!("ranges on {topic} that are {name}: no measurement ({})", percent(n));
                report.record(Treatment::NotUsed, rule, "", "");
            }
        }
        if convention.is_maximum_no_echo && no_echo != NoEcho::Maximum {
            let rule = format!(
                "ranges on {topic} equal to range_max: no echo ({})",
                percent(self.at_maximum)
            );
            report.record(Treatment::Guessed, rule, "", "");
        }
        // A wall at the limit is measured beyond it at times: where REP 117 is followed, that guesses nothing.
        let treatment = if self.infinite > 0 { Treatment::NotUsed } else { Treatment::Guessed };
        if self.beyond_maximum > 0 && no_echo != NoEcho::Maximum {
            let rule = format!(
                "ranges on {topic} above range_max: no echo ({})",
                percent(self.beyond_maximum)
            );
            report.record(treatment, rule, "", "");
        }
    }
}

impl RangeCounts {
    /// Records what can hardly be right with the ranges of a topic.
    fn record_doubts(&self, topic: &str, no_echo: NoEcho, report: &mut ImportReport) {
        let percent = |n: u64| 100.0 * n as f64 / self.beams.max(1) as f64;
        if self.measured == 0 && self.beams > 0 {
            let rule = format!("none of the {} ranges on {topic} is an echo", self.beams);
            let remedy = "check that the scanner turned, and that lengths are in meters";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
        let far_share = self.beyond_maximum as f64 / self.beams.max(1) as f64;
        if far_share > 0.5 {
            let rule = format!(
                "{:.2} % of the ranges on {topic} are beyond range_max",
                percent(self.beyond_maximum)
            );
            report.record(
                Treatment::Suspicious,
                rule,
                "",
                "check that ranges and range_max are both in meters",
            );
        }
        let is_near_often = self.too_near as f64 > MAX_NEAR_SHARE * self.beams as f64;
        if is_near_often && self.infinite == 0 && no_echo != NoEcho::TooNear {
            let rule = format!(
                "{:.2} % of the ranges on {topic} are nearer than the scanner measures, and none is inf",
                percent(self.too_near)
            );
            let remedy = "give --no-echo near if the driver writes so where nothing answers";
            report.record(Treatment::Suspicious, rule, "", remedy);
        }
        if self.other_end > 0 {
            let rule = format!(
                "scans on {topic} whose angle_max is not the bearing of their last beam: angle_min and angle_increment count \
                 ({} of {} scans)",
                self.other_end, self.scans
            );
            report.record(Treatment::Suspicious, rule, "", "");
        }
    }
}
