//! Pilots are programs of their own: each in a thread, with packets through channels and at a pace of its own, they
//! decide as one process does for all.

use sidestep_airspace::agents::traffic_state::TrafficPicture;
use sidestep_airspace::pilot::{AirplaneControl, Percept, Pilot};
use sidestep_airspace::world::AirspaceWorld;
use sidestep_airspace::{RemotePilotRun, airspace_run};
use sidestep_kernel::network::{NetworkAgent, OutgoingPacket};
use sidestep_kernel::{Digest, EntityId, Simulation};
use sidestep_scenario::Source;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// A message to a pilot in a thread.
enum PilotMessage {
    /// The sight of a cycle.
    Begin(Box<Percept>),
    /// A packet, with its sender.
    Packet(EntityId, Vec<u8>),
    /// The end of the run.
    End,
}

/// A pilot's thread.
fn fly(
    mut pilot: Pilot,
    told: Receiver<PilotMessage>,
    others: Vec<Sender<PilotMessage>>,
    done: Sender<AirplaneControl>,
) {
    let mut is_told = true;
    for message in told {
        match message {
            PilotMessage::Begin(sight) => {
                pilot.start(*sight, 0);
                is_told = false;
            }
            PilotMessage::Packet(from, bytes) => pilot.on_packet(from, &bytes, 0),
            PilotMessage::End => return,
        }
        for OutgoingPacket { to, payload, .. } in pilot.take_packets() {
            to.iter().for_each(|&id| {
                // A pilot that has come to an end hears no more.
                let _ = others[id as usize].send(PilotMessage::Packet(pilot.id(), payload.clone()));
            });
        }
        if let Some(control) = pilot.control().filter(|_| !is_told) {
            assert_eq!(pilot.drop_counts().total(), 0);
            (is_told, _) = (true, done.send(control));
        }
    }
}

fn text(deployment: &str) -> String {
    format!(
        "format = 1\nworld = \"airspace\"\nseed = 5\n[airspace]\ndeployment = \"{deployment}\"\n\
         max_rounds = 30\n[airspace.generator]\nkind = \"superconflict\"\nn = 5\nradius_m = 2500.0\n"
    )
}

/// Flies a scenario by pilots in threads.
fn flown_in_threads(deployment: &str, cycles: u64) -> Digest {
    let mut run = airspace_run(&Source::new("s", text(deployment), ""), 1).expect("a scenario");
    let world: Arc<AirspaceWorld> = run.world().clone();
    let n = world.airplanes.len() as EntityId;
    let (senders, told): (Vec<_>, Vec<_>) = (0..n).map(|_| channel()).unzip();
    let (done, controls) = channel();
    std::thread::scope(|scope| {
        for (id, told) in (0..).zip(told) {
            let pilot = Pilot::new(world.clone(), id, TrafficPicture::new());
            let (others, done) = (senders.clone(), done.clone());
            scope.spawn(move || fly(pilot, told, others, done));
        }
        for _ in 0..cycles {
            let sights = run.percepts();
            let flying = sights.len();
            for sight in sights {
                let own = sight.own.id as usize;
                senders[own].send(PilotMessage::Begin(Box::new(sight))).expect("a thread");
            }
            run.submit(controls.iter().take(flying).collect()).expect("what pilots decide");
            run.advance(1);
        }
        senders.iter().for_each(|sender| sender.send(PilotMessage::End).expect("a thread"));
    });
    run.digest()
}

#[test]
fn pilots_in_threads_of_their_own_fly_as_one_process_decides() {
    let source = Source::new("s", text("direct"), "");
    let mut alone = airspace_run(&source, 1).expect("a scenario");
    alone.advance(20);
    for deployment in ["team", "compact-team"] {
        assert_eq!(flown_in_threads(deployment, 20), alone.digest(), "{deployment}");
    }
}
