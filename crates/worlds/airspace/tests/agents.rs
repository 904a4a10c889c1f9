//! Agents are a part of their own: each in a thread, with a transport between threads that is
//! handed in, they come to what one process decides for all.

use sidestep_airspace::AirspaceWorld;
use sidestep_airspace::agents::contact::Contacts;
use sidestep_airspace::agents::network::Patience;
use sidestep_airspace::agents::{Decided, Endpoint, OwnShip, Radio, informed};
use sidestep_airspace::deploy::{brief, own_ship};
use sidestep_airspace::flight::Known;
use sidestep_airspace::objective::{Options, game};
use sidestep_airspace::scenario::Compiled;
use sidestep_collectives::optimize;
use sidestep_kernel::ports::{Envelope, Transport};
use sidestep_kernel::{Cycle, EntityId};
use sidestep_scenario::Source;
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

/// One agent's end of the channels between threads.
struct Wire {
    inbox: Receiver<Envelope>,
    others: BTreeMap<EntityId, Sender<Envelope>>,
}

impl Transport for Wire {
    fn send(&mut self, envelope: Envelope) {
        if let Some(other) = self.others.get(&envelope.receiver) {
            // Whoever has come to an end hears no more.
            let _ = other.send(envelope);
        }
    }

    fn receive(&mut self, _: EntityId, _: Cycle) -> Vec<Envelope> {
        let first = self.inbox.recv_timeout(Duration::from_secs(20)).ok();
        let mut arrived: Vec<Envelope> = first.into_iter().chain(self.inbox.try_iter()).collect();
        arrived.sort_unstable();
        arrived
    }
}

/// A wire for each of a group.
fn wires(ids: &[EntityId]) -> Vec<Wire> {
    let (senders, inboxes): (Vec<_>, Vec<_>) = ids.iter().map(|_| channel()).unzip();
    let others: BTreeMap<_, _> = ids.iter().copied().zip(senders).collect();
    inboxes.into_iter().map(|inbox| Wire { inbox, others: others.clone() }).collect()
}

/// Runs one agent to its end.
fn alone(own: OwnShip, mut wire: Wire) -> Option<Decided> {
    let radio = Radio {
        group: own.briefing.ids.clone(),
        me: own.me,
        patience: Patience {
            ticks: u64::MAX,
            bits_per_tick: f64::INFINITY,
            tries: 1,
            first_tries: 1,
        },
        ticks: u64::MAX,
        is_silent: false,
    };
    let mut endpoint = Endpoint::new(informed::Agent::new(own, true), radio);
    endpoint.start(&mut wire, 0);
    for tick in 1..100_000 {
        if endpoint.is_done() {
            break;
        }
        endpoint.step(&mut wire, tick);
    }
    endpoint.end().outcome.and_then(|outcome| outcome.decided)
}

fn group(world: &AirspaceWorld) -> Vec<Known> {
    let known = |(slot, airplane): (u32, &sidestep_airspace::flight::Airplane)| Known {
        slot,
        pose: airplane.start,
        next: 0,
        orders: 0,
        altitude_m: airplane.altitude_m,
    };
    (0..).zip(world.airplanes.iter()).map(known).collect()
}

#[test]
fn agents_in_threads_of_their_own_decide_as_one_process_does() {
    let text = "format = 1\nworld = \"airspace\"\n[airspace.generator]\nkind = \"superconflict\"\n\
                n = 5\nradius_m = 2500.0\n";
    let compiled = Compiled::new(&Source::new("threads", text, "")).expect("a scenario");
    let world = &*compiled.world;
    let known = group(world);
    let briefing = brief(world, 0, &known, &[]);
    let own = |me: usize| own_ship(world, &briefing, me, known[me], Contacts::new());
    let own: Vec<OwnShip> = (0..known.len()).map(own).collect();
    let options: Vec<Options> = own.iter().map(|own| own.options.clone()).collect();
    let threads: Vec<_> = own
        .into_iter()
        .zip(wires(&briefing.ids))
        .map(|(own, wire)| std::thread::spawn(move || alone(own, wire)))
        .collect();
    let decided = threads.into_iter().map(|thread| thread.join().expect("no panic"));
    let decided: Vec<Decided> = decided.map(|decided| decided.expect("a decision")).collect();
    let expected = optimize(&game(&world.objective, &options), &world.settings, |_, _| 0.0);
    let chosen: Vec<usize> = decided.iter().map(|decided| decided.chosen).collect();
    assert_eq!(chosen, expected.joint);
    assert!(decided.iter().all(|decided| decided.rounds == expected.rounds));
    assert!(decided.iter().zip(&expected.expected).all(|(a, b)| a.expected == *b));
}
