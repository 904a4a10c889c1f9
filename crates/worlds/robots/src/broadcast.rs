//! The words of the radio: the last broadcast of each robot.

use sidestep_kernel::{AtomicColumn, Cycle, EntityId};

/// The last broadcast of each robot by id; empty without radio.
///
/// A word that is broadcast in one cycle is heard in the next. Therefore there are two pages: one is
/// read while the other is written, by parity of the cycle in which it is read. Every robot writes in
/// every cycle, also where it does not act, so that the page being read holds the last word of all,
/// whatever their periods, and the page being written holds nothing that is still needed.
#[derive(Debug, Clone)]
pub(crate) struct BroadcastBuffer([BroadcastPage; 2]);

#[derive(Debug, Clone)]
struct BroadcastPage {
    words: AtomicColumn<u64>,
    /// 1 for a robot that has broadcast a word, because every word is a possible one.
    spoken: AtomicColumn<u8>,
}

impl BroadcastBuffer {
    /// Returns the pages of `n` bodies that have said nothing yet.
    pub(crate) fn new(n: usize) -> Self {
        Self([BroadcastPage::silent(n), BroadcastPage::silent(n)])
    }

    fn page(&self, read_in: Cycle) -> &BroadcastPage {
        &self.0[(read_in % 2) as usize]
    }

    /// Returns the last word that a robot has broadcast before cycle `now`, if any.
    pub(crate) fn last_broadcast(&self, id: EntityId, now: Cycle) -> Option<u64> {
        let page = self.page(now);
        let index = id as usize;
        // Without radio the pages are empty.
        let has_spoken = index < page.spoken.len() && page.spoken.get(index) == 1;
        has_spoken.then(|| page.words.get(index))
    }

    /// Records the word of a robot in cycle `now`: a new one, or still the last one.
    pub(crate) fn record(&self, id: EntityId, now: Cycle, word: Option<u64>) {
        if let Some(word) = word.or_else(|| self.last_broadcast(id, now)) {
            self.page(now + 1).set(id, word);
        }
    }

    /// Restores the last word of a robot, on both pages, because the cycle may be even or odd.
    pub(crate) fn restore(&self, id: EntityId, word: u64) {
        self.0.iter().filter(|page| !page.spoken.is_empty()).for_each(|page| page.set(id, word));
    }

    /// Both pages count; 0 without radio.
    pub(crate) fn heap_bytes(&self) -> usize {
        self.0.iter().map(|page| page.words.heap_bytes() + page.spoken.heap_bytes()).sum()
    }
}

impl BroadcastPage {
    fn silent(bodies: usize) -> Self {
        Self { words: AtomicColumn::filled(bodies, 0), spoken: AtomicColumn::filled(bodies, 0) }
    }

    fn set(&self, id: EntityId, word: u64) {
        self.words.set(id as usize, word);
        self.spoken.set(id as usize, 1);
    }
}

#[cfg(test)]
mod tests {
    use crate::RobotsRun;
    use crate::decide::{Behaviour, Decision, Memory, Percept, ReceivedMessage};
    use crate::effector::STAY;
    use crate::scenario::{Behaviours, Compiled, StorageOrder};
    use sidestep_kernel::stream::Draws;
    use sidestep_kernel::{Cycle, Simulation};
    use sidestep_scenario::Source;
    use std::sync::Arc;

    /// Broadcasts the cycle of each of its turns, so that its first word may be 0.
    #[derive(Debug)]
    struct Talker;

    impl Behaviour for Talker {
        fn decide(&self, percept: &Percept<'_>, _: &mut Memory, _: &mut Draws) -> Decision {
            Decision { action: STAY, trip: None, broadcast: Some(percept.now) }
        }
    }

    /// Remembers the word that it hears plus 1, or 0 where it hears nothing, and its own id.
    #[derive(Debug)]
    struct Listener;

    impl Behaviour for Listener {
        fn decide(&self, percept: &Percept<'_>, memory: &mut Memory, _: &mut Draws) -> Decision {
            memory.words[0] = match *percept.heard {
                [ReceivedMessage { sender: 0, word }] => word as u32 + 1,
                _ => 0,
            };
            memory.words[1] = percept.id;
            STAY.into()
        }
    }

    fn run(period: u64, phase: u64) -> RobotsRun {
        let text = format!(
            "format = 1\nworld = \"robots\"\nmap.ascii = \"....\"\nradio.range_m = 5\n\
             [[robots]]\nat = [[0, 0, 0]]\nperiod = {period}\nphase = {phase}\n\
             behaviour.kind = \"talker\"\n\
             [[robots]]\nat = [[2, 0, 0]]\nbehaviour.kind = \"listener\"\n"
        );
        let own = Behaviours::from([
            ("talker".into(), Arc::new(Talker) as Arc<dyn Behaviour>),
            ("listener".into(), Arc::new(Listener)),
        ]);
        let source = Source::new("s", &text, "");
        let compiled = Compiled::new(&source, &own, StorageOrder::Spatial).expect("fits");
        compiled.start(&source, 1)
    }

    /// The word that the listener must remember after cycle `now`: the last turn of the talker before it.
    fn expected(period: u64, phase: u64, now: Cycle) -> u32 {
        let is_turn = |cycle: &Cycle| (cycle + phase).is_multiple_of(period);
        (0..now).rev().find(is_turn).map_or(0, |cycle| cycle as u32 + 1)
    }

    fn remembered(run: &RobotsRun) -> [u32; 2] {
        [0, 1].map(|k| run.state().body(1).memory[k].get())
    }

    #[test]
    fn the_last_word_of_a_robot_is_heard_whatever_its_period_and_wherever_the_run_was_resumed() {
        for (period, phase) in [(1, 0), (2, 0), (2, 1), (3, 1), (5, 0), (5, 2)] {
            let mut whole = run(period, phase);
            for now in 0..40 {
                let mut resumed = run(period, phase);
                resumed.restore(&whole.checkpoint()).expect("the same scenario");
                for run in [&mut whole, &mut resumed] {
                    run.advance(1);
                    let must_be = [expected(period, phase, now), 1];
                    assert_eq!(remembered(run), must_be, "period {period}, cycle {now}");
                }
                assert_eq!(resumed.digest(), whole.digest());
            }
        }
    }

    #[test]
    fn a_word_of_0_is_no_silence() {
        let mut talking = run(2, 0);
        assert_eq!(talking.state().snapshot(talking.world(), 0).bodies[0].voice, None);
        talking.advance(1);
        let mut said = talking.state().snapshot(talking.world(), 1);
        assert_eq!(said.bodies[0].voice, Some(0));
        let digest = said.digest();
        said.bodies[0].voice = None;
        assert_ne!(said.digest(), digest);
    }
}
