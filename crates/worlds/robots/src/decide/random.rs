//! Random actions as a behavior: the contact is all that it uses of its percept.

use super::{Behaviour, Decision, Memory, Percept};
use sidestep_error_models::RandomPolicy;
use sidestep_kernel::stream::Draws;

impl Behaviour for RandomPolicy {
    #[inline]
    fn decide(&self, percept: &Percept<'_>, _: &mut Memory, draws: &mut Draws) -> Decision {
        self.sample(percept.contact.is_some(), draws.next_u32()).into()
    }
}
