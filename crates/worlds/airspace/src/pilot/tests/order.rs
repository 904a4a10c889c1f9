//! Results do not depend on the order in which packets come, nor on which pilot is ahead.

use super::*;
use proptest::prelude::*;
use sidestep_kernel::Seed;
use sidestep_kernel::stream::{Draws, Purpose, Streams};

/// Something that a pilot has yet to learn.
enum PilotInput {
    Sight(Box<Percept>),
    Packet(EntityId, Vec<u8>),
}

/// Lets pilots decide a cycle. The next input of any of them is drawn, so that packets overtake each other and some
/// are in the second conversation before others have begun the first.
fn decided(
    pilots: &mut [Pilot],
    percepts: Vec<Percept>,
    draws: &mut Draws,
) -> Vec<AirplaneControl> {
    let ids: Vec<EntityId> = percepts.iter().map(|percept| percept.own.id).collect();
    let mut due: Vec<(EntityId, PilotInput)> = percepts
        .into_iter()
        .map(|percept| (percept.own.id, PilotInput::Sight(Box::new(percept))))
        .collect();
    while !due.is_empty() {
        let (id, next) = due.swap_remove(draws.uniform_below(due.len() as u32) as usize);
        let pilot = &mut pilots[id as usize];
        match next {
            PilotInput::Sight(percept) => pilot.start(*percept, 0),
            PilotInput::Packet(from, bytes) => pilot.on_packet(from, &bytes, 0),
        }
        for OutgoingPacket { to, payload, .. } in pilot.take_packets() {
            due.extend(to.iter().map(|&other| (other, PilotInput::Packet(id, payload.clone()))));
        }
    }
    let control = |&id: &EntityId| pilots[id as usize].control().expect("nobody waits any more");
    ids.iter().map(control).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn controls_do_not_depend_on_the_order_of_packets(
        seed in any::<u64>(),
        airspace in prop::sample::select(vec![
            "deployment = \"team\"",
            "deployment = \"team\"\norder = \"parallel\"",
            "deployment = \"compact-team\"",
            "deployment = \"team\"\npreset = \"paper\"",
            "deployment = \"compact-team\"\npreset = \"paper\"",
            "deployment = \"pim\"",
            "deployment = \"pim\"\npreset = \"paper\"",
            "deployment = \"hierarchical-pim\"\npreset = \"paper\"",
            "deployment = \"team\"\nmethod = \"mvp\"",
            "deployment = \"compact-team\"\nmethod = \"orca\"",
            "deployment = \"team\"\nmethod = \"none\"",
            "deployment = \"compact-team\"\ngroups = \"heard\"",
            "deployment = \"pim\"\ngroups = \"heard\"",
        ]),
    ) {
        let mut draws = Streams::new(Seed(seed)).draws(0, 0, Purpose(901));
        let (mut own, mut driven) = (run(airspace, TROUBLE), run(airspace, TROUBLE));
        let mut crew = TestPilots::from_run(&driven);
        own.advance(6);
        for _ in 0..6 {
            let controls = decided(&mut crew.pilots, driven.percepts(), &mut draws);
            driven.submit(controls).expect("what pilots decide");
            driven.advance(1);
        }
        prop_assert_eq!(driven.digest(), own.digest());
        prop_assert_eq!(driven.metrics().messages, own.metrics().messages);
        for pilot in &crew.pilots {
            prop_assert_eq!(pilot.drop_counts().total(), 0);
        }
    }
}
