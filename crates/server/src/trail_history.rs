//! Where the agents of a run were, for trails up to any cycle: the page itself knows only what it was shown.

use crate::encode::body_id;
use crate::protocol::{self, BodyTrail, ReplyBody};
use crate::usage_registry::StoreBytes;
use sidestep_kernel::Cycle;
use sidestep_kernel::view::{BodyId, Frame};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

/// Maximum number of places kept of one run: 12 bytes each.
const MAX_PLACES: usize = 1 << 20;
/// Maximum number of samples kept of one run: also a run of few agents has a bound.
const MAX_SAMPLES: usize = 1 << 14;
/// Bytes that a sample takes beside its places: its entry, and its lists.
const SAMPLE_BYTES: usize = 96;
/// Maximum number of places in a reply, of all bodies together and of one: what the page keeps and draws.
const MAX_REPLY_PLACES: usize = 240_000;
const MAX_REPLY_PLACES_PER_BODY: usize = 600;
/// Sampling may take this fraction of the time that cycles take.
const MAX_COST_FRACTION: f64 = 0.05;

/// The places of the agents at some cycles of a run, evenly spread.
#[derive(Debug, Default)]
pub(crate) struct TrailHistory {
    samples: BTreeMap<Cycle, Sample>,
    places: usize,
    /// Number of agents in all lists of them; at most, since a list may have been replaced.
    ids: usize,
    /// Cycles between two samples.
    spacing: Cycle,
    /// Computing time since the last sample, that of a cycle, and the time that a sample takes.
    computing_time: Duration,
    cycle_time: Duration,
    sample_time: Duration,
}

/// The agents at a cycle. Successive samples share the list of who they are, because it changes rarely.
#[derive(Debug)]
struct Sample {
    agents: Arc<[BodyId]>,
    places_m: Box<[[f32; 3]]>,
}

impl TrailHistory {
    /// Adds computing time that some cycles took.
    pub(crate) fn add_computing_time(&mut self, cycles: Cycle, computing_time: Duration) {
        self.computing_time += computing_time;
        let cycles = u32::try_from(cycles.max(1)).unwrap_or(u32::MAX);
        self.cycle_time = computing_time / cycles;
    }

    /// Returns whether a sample is due at a cycle.
    pub(crate) fn is_due(&self, cycle: Cycle) -> bool {
        let last = self.samples.last_key_value().map(|(&cycle, _)| cycle);
        let is_far = last.is_none_or(|last| cycle >= last + self.spacing.max(1));
        let is_cheap =
            self.sample_time.as_secs_f64() <= MAX_COST_FRACTION * self.computing_time.as_secs_f64();
        is_far && (is_cheap || last.is_none())
    }

    /// Returns the number of cycles to the next sample, which a run should not skip; at least one.
    pub(crate) fn cycles_until_due(&self, cycle: Cycle) -> Cycle {
        let last = self.samples.last_key_value().map_or(0, |(&cycle, _)| cycle);
        let by_spacing = (last + self.spacing.max(1)).saturating_sub(cycle);
        let wait = self.sample_time.div_f64(MAX_COST_FRACTION).saturating_sub(self.computing_time);
        let cycle_s = self.cycle_time.as_secs_f64();
        let by_cost =
            if cycle_s > 0.0 { (wait.as_secs_f64() / cycle_s).ceil() as Cycle } else { 1 };
        by_spacing.max(by_cost).max(1)
    }

    /// Adds the places of a frame, which took some time to make.
    pub(crate) fn push(&mut self, frame: &Frame, sample_time: Duration) {
        self.computing_time = Duration::ZERO;
        self.sample_time = sample_time;
        let agents = frame.bodies.iter().filter(|body| body.kind.is_agent());
        let ids: Vec<BodyId> = agents.clone().map(|body| body.id()).collect();
        let places_m = agents.map(|body| body.pose.at_m.map(|meters| meters as f32)).collect();
        let last = self.samples.last_key_value().map(|(_, sample)| sample.agents.clone());
        let agents = last.filter(|last| **last == *ids).unwrap_or_else(|| {
            self.ids += ids.len();
            ids.into()
        });
        let sample = Sample { agents, places_m };
        self.places += sample.places_m.len();
        if let Some(before) = self.samples.insert(frame.cycle, sample) {
            self.places -= before.places_m.len();
        }
        while (self.places > MAX_PLACES || self.samples.len() > MAX_SAMPLES)
            && self.samples.len() > 2
        {
            self.drop_every_second();
        }
    }

    /// Returns the bytes of all that is kept, and their bound: at worst each sample has a list of agents of its own.
    pub(crate) fn bytes(&self) -> StoreBytes {
        let bytes_of = |places: usize, ids: usize, samples: usize| {
            let of_places = places * size_of::<[f32; 3]>();
            let of_ids = ids * size_of::<BodyId>();
            (of_places + of_ids + samples * SAMPLE_BYTES) as u64
        };
        let used = bytes_of(self.places, self.ids, self.samples.len());
        StoreBytes { used, max: bytes_of(MAX_PLACES, MAX_PLACES, MAX_SAMPLES) }
    }

    fn drop_every_second(&mut self) {
        let mut is_odd = true;
        self.samples.retain(|_, _| {
            is_odd = !is_odd;
            !is_odd
        });
        self.places = self.samples.values().map(|sample| sample.places_m.len()).sum();
        self.ids = self.count_ids();
        self.spacing = 2 * self.spacing.max(1);
    }

    /// Returns the number of agents in all lists; one that successive samples share counts once.
    fn count_ids(&self) -> usize {
        let mut last: Option<&Arc<[BodyId]>> = None;
        let mut ids = 0;
        for sample in self.samples.values() {
            if last.is_none_or(|last| !Arc::ptr_eq(last, &sample.agents)) {
                ids += sample.agents.len();
            }
            last = Some(&sample.agents);
        }
        ids
    }

    /// Returns the trails of some bodies up to a cycle, or of all agents: the last part of each, as long as a reply may be.
    /// A body that was gone for a while has the part since it came back.
    pub(crate) fn trails_reply(&self, until: Cycle, bodies: &[protocol::BodyId]) -> ReplyBody {
        let mut trails: BTreeMap<BodyId, TrailEnd> = BTreeMap::new();
        let mut places = 0;
        for (index, (&cycle, sample)) in self.samples.range(..=until).rev().enumerate() {
            let before = places;
            for (agent, at_m) in sample.agents.iter().zip(&sample.places_m) {
                // Agents that are not there at the end have no trail.
                if index == 0 && is_wanted(agent, bodies) {
                    trails.insert(*agent, TrailEnd::default());
                }
                let Some(trail) = trails.get_mut(agent) else { continue };
                if trail.push(index, (cycle, *at_m)) {
                    places += 1;
                }
            }
            // A trail that was not extended has its beginning.
            if places >= MAX_REPLY_PLACES || places == before {
                break;
            }
        }
        let trails = trails.into_iter().map(|(agent, trail)| body_trail(&agent, &trail.points));
        ReplyBody::Trails { trails: trails.collect() }
    }
}

/// The last part of a trail, from its end on.
#[derive(Debug, Default)]
struct TrailEnd {
    points: Vec<(Cycle, [f32; 3])>,
}

impl TrailEnd {
    /// Adds the place of a body in a sample, counted from the end; returns false if it was not in the one after it, or
    /// there are as many places as a reply may have.
    fn push(&mut self, sample: usize, place: (Cycle, [f32; 3])) -> bool {
        let goes_on = self.points.len() == sample && sample < MAX_REPLY_PLACES_PER_BODY;
        if goes_on {
            self.points.push(place);
        }
        goes_on
    }
}

fn is_wanted(agent: &BodyId, bodies: &[protocol::BodyId]) -> bool {
    let is_it = |body: &protocol::BodyId| {
        body.kind == agent.kind.name() && body.number == agent.number && body.part == agent.part
    };
    bodies.is_empty() || bodies.iter().any(is_it)
}

/// Returns a trail for the page from points that begin with the latest.
fn body_trail(agent: &BodyId, points: &[(Cycle, [f32; 3])]) -> BodyTrail {
    BodyTrail {
        body: body_id(agent),
        cycles: points.iter().rev().map(|(cycle, _)| *cycle as f64).collect(),
        points_m: points.iter().rev().flat_map(|(_, at_m)| *at_m).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sidestep::worlds::airspace::kinds::AIRPLANE;
    use sidestep_kernel::view::{Body, Pose, Shape};

    const MS: Duration = Duration::from_millis(1);

    fn frame(cycle: Cycle, numbers: &[u32]) -> Frame {
        let body = |&number: &u32| {
            let at_m = [cycle as f64, f64::from(number), 0.0];
            Body::new(AIRPLANE, number, Pose::from_position(at_m), Shape::Sphere { radius_m: 1.0 })
        };
        Frame { cycle, bodies: numbers.iter().map(body).collect(), ..Frame::default() }
    }

    fn airplane(number: u32) -> protocol::BodyId {
        body_id(&BodyId::new(AIRPLANE, number, None))
    }

    fn trails(
        history: &TrailHistory,
        until: Cycle,
        bodies: &[protocol::BodyId],
    ) -> Vec<(u32, Vec<f64>)> {
        let ReplyBody::Trails { trails } = history.trails_reply(until, bodies) else {
            panic!("no trails")
        };
        trails.into_iter().map(|trail| (trail.body.number, trail.cycles)).collect()
    }

    #[test]
    fn a_trail_ends_at_the_cycle_that_is_asked_for_and_begins_where_its_body_appeared() {
        let mut history = TrailHistory::default();
        for cycle in 0..6 {
            let numbers: &[u32] = if cycle < 3 { &[0] } else { &[0, 1] };
            history.push(&frame(cycle, numbers), MS);
        }
        assert_eq!(trails(&history, 1, &[]), [(0, vec![0.0, 1.0])]);
        let both = trails(&history, 4, &[]);
        assert_eq!(both, [(0, vec![0.0, 1.0, 2.0, 3.0, 4.0]), (1, vec![3.0, 4.0])]);
        let one = [airplane(1)];
        assert_eq!(trails(&history, 9, &one), [(1, vec![3.0, 4.0, 5.0])]);
        assert!(trails(&history, 1, &one).is_empty(), "it is not there yet");
    }

    #[test]
    fn a_body_that_was_gone_for_a_while_has_the_part_since_it_came_back() {
        let mut history = TrailHistory::default();
        for cycle in 0..9 {
            let numbers: &[u32] = if (3..5).contains(&cycle) { &[0] } else { &[0, 1] };
            history.push(&frame(cycle, numbers), MS);
        }
        assert_eq!(trails(&history, 8, &[airplane(1)]), [(1, vec![5.0, 6.0, 7.0, 8.0])]);
        assert_eq!(trails(&history, 2, &[airplane(1)]), [(1, vec![0.0, 1.0, 2.0])]);
    }

    #[test]
    fn memory_of_a_long_run_with_one_agent_or_none_is_bounded() {
        for numbers in [&[0][..], &[]] {
            let mut history = TrailHistory::default();
            for cycle in 0..3 * MAX_SAMPLES as Cycle {
                history.push(&frame(cycle, numbers), Duration::ZERO);
                assert!(history.samples.len() <= MAX_SAMPLES);
            }
            let StoreBytes { used, max } = history.bytes();
            assert!(used > (MAX_SAMPLES * SAMPLE_BYTES / 2) as u64 && used <= max, "{used} {max}");
        }
    }

    #[test]
    fn memory_is_bounded_and_the_whole_run_is_kept() {
        let mut history = TrailHistory::default();
        let numbers: Vec<u32> = (0..1000).collect();
        for cycle in 0..3000 {
            history.add_computing_time(1, 100 * MS);
            if history.is_due(cycle) {
                history.push(&frame(cycle, &numbers), MS);
            }
            assert!(history.places <= MAX_PLACES);
        }
        let all = trails(&history, 3000, &[]);
        let (_, cycles) = &all[0];
        assert_eq!(all.len(), 1000);
        assert!(
            all.iter().map(|(_, cycles)| cycles.len()).sum::<usize>() <= MAX_REPLY_PLACES + 1000
        );
        let one = &trails(&history, 3000, &[airplane(7)])[0].1;
        assert!(one.len() == MAX_REPLY_PLACES_PER_BODY && one.len() > cycles.len(), "{one:?}");
        assert_eq!(history.samples.first_key_value().map(|(&cycle, _)| cycle), Some(0));
    }

    #[test]
    fn samples_cost_a_small_part_of_the_time_that_cycles_take() {
        let mut history = TrailHistory::default();
        assert!(history.is_due(0), "the start is always known");
        history.push(&frame(0, &[0]), MS);
        history.add_computing_time(1, 5 * MS);
        assert!(!history.is_due(1));
        assert_eq!(history.cycles_until_due(1), 3, "20 ms of cycles of 5 ms each");
        history.add_computing_time(3, 15 * MS);
        assert!(history.is_due(4));
    }
}
