//! Turn profiles in messages: as runs of equal turn rates, because most profiles have one or two rates.

use crate::flight::MAX_STEPS_PER_DT;
use crate::shield::TurnProfile;
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};

/// A number of steps, and the turn rate in each of them in radians per second.
type TurnRun = (u32, f64);

pub(super) fn serialize<S: Serializer>(profiles: &[TurnProfile], to: S) -> Result<S::Ok, S::Error> {
    let runs: Vec<Vec<TurnRun>> = profiles.iter().map(runs_of).collect();
    runs.serialize(to)
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<Vec<TurnProfile>, D::Error> {
    let runs = Vec::<Vec<TurnRun>>::deserialize(from)?;
    let profiles: Option<Vec<TurnProfile>> = runs.iter().map(|runs| profile_of(runs)).collect();
    profiles.ok_or_else(|| D::Error::custom("a profile has more steps than a cycle"))
}

fn runs_of(profile: &TurnProfile) -> Vec<TurnRun> {
    // By their bits: the receiver gets the very same profile.
    let runs = profile.omegas_rad_s.chunk_by(|a, b| a.to_bits() == b.to_bits());
    runs.map(|run| (run.len() as u32, run[0])).collect()
}

/// Returns the profile of some runs; `None` if it is longer than any can be: a few bytes must not take much memory.
fn profile_of(runs: &[TurnRun]) -> Option<TurnProfile> {
    let steps: u64 = runs.iter().map(|(steps, _)| u64::from(*steps)).sum();
    if steps > MAX_STEPS_PER_DT {
        return None;
    }
    let omegas_rad_s =
        runs.iter().flat_map(|&(steps, omega)| std::iter::repeat_n(omega, steps as usize));
    Some(TurnProfile { omegas_rad_s: omegas_rad_s.collect() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[derive(Debug, PartialEq, Serialize, Deserialize)]
    struct Message(#[serde(with = "super")] Vec<TurnProfile>);

    fn read(bytes: &[u8]) -> Result<Message, postcard::Error> {
        postcard::from_bytes(bytes)
    }

    proptest! {
        #[test]
        fn profiles_arrive_as_they_were_sent_bit_for_bit(
            rates in prop::collection::vec(prop::collection::vec(prop::sample::select(vec![0.0, -0.0, 0.1, -0.2]), 0..9), 0..5),
        ) {
            let profiles = rates.into_iter().map(|omegas_rad_s| TurnProfile { omegas_rad_s });
            let message = Message(profiles.collect());
            let bytes = postcard::to_stdvec(&message).expect("plain data");
            let again = read(&bytes).expect("it can be read");
            let bits = |message: &Message| -> Vec<Vec<u64>> {
                let of_one = |one: &TurnProfile| one.omegas_rad_s.iter().map(|x| x.to_bits()).collect();
                message.0.iter().map(of_one).collect()
            };
            prop_assert_eq!(bits(&again), bits(&message));
        }
    }

    #[test]
    fn a_profile_of_one_rate_takes_a_dozen_bytes_however_long_it_is() {
        let message = Message(vec![TurnProfile { omegas_rad_s: vec![0.1; 100] }]);
        let bytes = postcard::to_stdvec(&message).expect("plain data");
        assert!(bytes.len() <= 12, "{}", bytes.len());
    }

    #[test]
    fn a_few_bytes_that_stand_for_endless_profiles_are_refused() {
        let bytes = postcard::to_stdvec(&vec![vec![(u32::MAX, 0.1)]; 3]).expect("plain data");
        assert!(read(&bytes).is_err());
    }
}
