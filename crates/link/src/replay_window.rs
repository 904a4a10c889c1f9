//! Which frames of a peer have arrived: one that is repeated on the way, by whomever, is dropped.

/// Number of frames before the newest one of which it is known whether they have arrived. Frames overtake each other where
/// some of a sender's go through the server and others directly; a message whose frame was overtaken by more than that is
/// sent again in a frame of its own.
const WINDOW: u64 = 1024;

/// The frames that have arrived of one incarnation of a peer, by their numbers.
///
/// The window of received numbers is that of IPsec (RFC 4303, section 3.4.3).
#[derive(Debug)]
pub(crate) struct ReplayWindow {
    /// The number after the largest one that has arrived.
    end: u64,
    /// Whether a number has arrived, at its remainder by [`WINDOW`].
    arrived: [bool; WINDOW as usize],
}

impl Default for ReplayWindow {
    fn default() -> Self {
        Self { end: 0, arrived: [false; WINDOW as usize] }
    }
}

impl ReplayWindow {
    /// Records that a frame has arrived, and returns whether it is new: not seen before, and not so old that nobody can
    /// tell.
    pub(crate) fn record(&mut self, number: u64) -> bool {
        if number.saturating_add(WINDOW) < self.end {
            return false;
        }
        // The largest number has none after it; nobody sends that many.
        let end = self.end.max(number.saturating_add(1));
        for passed in self.end.max(end.saturating_sub(WINDOW))..end {
            self.arrived[slot(passed)] = false;
        }
        self.end = end;
        let has_arrived = &mut self.arrived[slot(number)];
        !std::mem::replace(has_arrived, true)
    }
}

fn slot(number: u64) -> usize {
    (number % WINDOW) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    proptest! {
        #[test]
        fn each_number_is_new_once_and_those_before_the_window_never(
            steps in proptest::collection::vec((0u64..40, 0u64..3000), 1..300),
        ) {
            let mut window = ReplayWindow::default();
            let mut arrived = BTreeSet::new();
            let mut newest = 0;
            for (forward, back) in steps {
                let number = (newest + forward).saturating_sub(back);
                let is_in_window = number + WINDOW > newest || arrived.is_empty();
                let is_new = window.record(number);
                if is_in_window {
                    prop_assert_eq!(is_new, arrived.insert(number), "{}", number);
                } else {
                    prop_assert!(!is_new);
                }
                newest = newest.max(number);
            }
        }
    }

    #[test]
    fn the_largest_numbers_do_no_harm() {
        let mut window = ReplayWindow::default();
        assert!(window.record(7));
        assert!(window.record(u64::MAX - 1) && !window.record(u64::MAX - 1));
        assert!(!window.record(7));
        let _ = window.record(u64::MAX);
    }
}
