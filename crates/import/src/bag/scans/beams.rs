//! Sets of beams of a scanner, by their numbers.

const BITS: usize = u64::BITS as usize;

/// A set of beams.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct BeamSet {
    words: Vec<u64>,
}

impl BeamSet {
    pub(super) fn insert(&mut self, beam: usize) {
        let word = beam / BITS;
        if word >= self.words.len() {
            self.words.resize(word + 1, 0);
        }
        self.words[word] |= 1 << (beam % BITS);
    }

    /// Returns the number of beams.
    pub(super) fn len(&self) -> u64 {
        self.words.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// Returns the number of runs of beams that are next to each other.
    pub(super) fn runs(&self) -> u64 {
        let mut carry = 0;
        let mut runs = 0;
        for word in &self.words {
            let starts = word & !(word << 1 | carry);
            runs += u64::from(starts.count_ones());
            carry = word >> (BITS - 1);
        }
        runs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn beams_are_counted_once_and_those_side_by_side_are_one_run() {
        let mut beams = BeamSet::default();
        [3, 4, 4, 63, 64, 200].iter().for_each(|beam| beams.insert(*beam));
        assert_eq!((beams.len(), beams.runs()), (5, 3));
    }
}
