//! Where the poses of one body jump, without keeping them all.

use crate::report::{ImportReport, MAX_PLACES, Treatment};
use crate::track::{SpeedRule, StampedPose2, absurd_speed_mps, describe_jump, record_absurd_speed};

/// Number of poses by which the usual speed is told: those before and after are others.
const BLOCK_POSES: usize = 1 << 14;

/// The motion of a body.
#[derive(Default)]
pub(super) struct TopicMotion {
    poses: Vec<StampedPose2>,
    jumps: u64,
    /// The first jumps.
    places: Vec<String>,
    limit_mps: f64,
    /// Its usual speed, where no robot has it.
    absurd_mps: Option<f64>,
}

impl TopicMotion {
    pub(super) fn add(&mut self, pose: StampedPose2) {
        self.poses.push(pose);
        if self.poses.len() >= BLOCK_POSES {
            self.close_block();
        }
    }

    fn close_block(&mut self) {
        self.absurd_mps = self.absurd_mps.or_else(|| absurd_speed_mps(&self.poses));
        let rule = SpeedRule::for_tracks(None, &[&self.poses]);
        for pair in self.poses.windows(2).filter(|pair| !rule.is_possible(&pair[0], &pair[1])) {
            self.jumps += 1;
            self.limit_mps = self.limit_mps.max(rule.max_speed_mps);
            if self.places.len() < MAX_PLACES {
                self.places.push(describe_jump(&pair[0], &pair[1]));
            }
        }
        // The next block begins where this one ends.
        let start = self.poses.len().saturating_sub(1);
        self.poses.drain(..start);
    }

    /// Records the jumps of a body that has this name.
    pub(super) fn report(&mut self, name: &str, report: &mut ImportReport) {
        self.close_block();
        record_absurd_speed(name, self.absurd_mps, report);
        let rule = format!(
            "jumps of {name}, which no robot makes that drives at most {:.2} m/s",
            self.limit_mps
        );
        let remedy = "no error is learned across them; give --max-speed M/S for another limit";
        for k in 0..self.jumps {
            let place = self.places.get(k as usize).cloned().unwrap_or_default();
            report.record(Treatment::Suspicious, rule.clone(), place, remedy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body at 0.5 m/s, ten poses a second, with these positions beside those it drives to.
    fn said(n: u32, jump_m: impl Fn(u32) -> f64) -> Vec<String> {
        let mut motion = TopicMotion::default();
        for k in 0..n {
            let position_m = [0.05 * f64::from(k) + jump_m(k), 0.0];
            motion.add(StampedPose2 { t_secs: 0.1 * f64::from(k), position_m, heading_rad: 0.0 });
        }
        let mut report = ImportReport::new("bag");
        motion.report("/truth", &mut report);
        report.findings.iter().map(ToString::to_string).collect()
    }

    #[test]
    fn jumps_are_counted_in_a_recording_of_any_length() {
        assert_eq!(said(40_000, |_| 0.0), [""; 0]);
        let far = said(40_000, |k| if k >= 16_384 { 3.0 } else { 0.0 });
        assert!(
            far[0].starts_with(
                "suspicious: jumps of /truth, which no robot makes that drives at most 1.50 m/s"
            ),
            "{far:?}"
        );
        assert!(far[0].contains("at 1638.400 s: 3.05 m"), "{far:?}");
        let in_millimeters = said(200, |k| 50.0 * f64::from(k));
        assert!(
            in_millimeters[0].starts_with("suspicious: the usual speed of /truth is 500 m/s"),
            "{in_millimeters:?}"
        );
        let lost = said(200, |k| if (50..53).contains(&k) { 4.0 } else { 0.0 });
        assert!(lost.len() == 1 && lost[0].contains("(2 times)"), "{lost:?}");
    }
}
