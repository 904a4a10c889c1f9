//! The endpoint at which a node serves its vehicle.

use super::WIRE_VERSION;
use crate::wire::endpoint::WireSetupError;
use crate::wire::zenoh::open_vehicle_session;
use sidestep_session::fleet::AgentName;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::query::Queryable;
use zenoh::{Session, Wait};

/// Most controls that wait to be read. A vehicle sends one a cycle; of one that sends more, later ones are dropped.
const MAX_WAITING: usize = 64;

/// Most bytes of a control: ten times what the largest one has.
const MAX_CONTROL_BYTES: usize = 1_000;

/// The link of a node with its vehicle. Both sides may be gone at any time: what is put into it may be lost.
pub trait VehiclePort: Send {
    /// Sets the description that a vehicle is told when it asks.
    fn set_description(&mut self, bytes: Vec<u8>);

    /// Sends a percept.
    fn send(&mut self, percept: &[u8]);

    /// Returns the next control that has arrived, without waiting; an empty one in place of one that is too long.
    fn receive(&mut self) -> Option<Vec<u8>>;

    /// Returns the number of controls that found no room, because too many came.
    fn overflow_count(&self) -> u64;
}

/// A link by Zenoh, with a key for each sort of message: `sidestep/v1/robot/3/percept`, `control` and `description`.
pub(crate) struct ZenohPort {
    percepts: Publisher<'static>,
    controls: Receiver<Vec<u8>>,
    overflows: Arc<AtomicU64>,
    description: Arc<Mutex<Vec<u8>>>,
    _subscriber: Subscriber<()>,
    _queryable: Queryable<()>,
    _session: Session,
}

impl ZenohPort {
    /// Serves the vehicle of an agent at an endpoint.
    ///
    /// # Errors
    /// When the endpoint cannot be bound.
    pub(crate) fn serve(agent: &AgentName, endpoint: &str) -> Result<Self, WireSetupError> {
        let session = open_vehicle_session(endpoint)?;
        let failed = |error: zenoh::Error| WireSetupError::NoEndpoint {
            endpoint: endpoint.to_string(),
            reason: error.to_string(),
        };
        let key = |part: &str| {
            let AgentName { noun, number, .. } = agent;
            format!("sidestep/v{WIRE_VERSION}/{noun}/{number}/{part}")
        };
        let percepts = session.declare_publisher(key("percept")).wait().map_err(failed)?;
        let (sender, controls) = sync_channel(MAX_WAITING);
        let overflows = Arc::new(AtomicU64::new(0));
        let counted = overflows.clone();
        let subscriber = session
            .declare_subscriber(key("control"))
            .callback(move |sample| {
                let payload = sample.payload();
                let is_short = payload.len() <= MAX_CONTROL_BYTES;
                // Without its bytes it is counted as damaged, and takes no memory.
                let bytes = if is_short { payload.to_bytes().into_owned() } else { Vec::new() };
                if sender.try_send(bytes).is_err() {
                    counted.fetch_add(1, Ordering::Relaxed);
                }
            })
            .wait()
            .map_err(failed)?;
        let description = Arc::new(Mutex::new(Vec::new()));
        let described = description.clone();
        let own_key = key("description");
        let queryable = session
            .declare_queryable(own_key.clone())
            .callback(move |query| {
                let bytes = described.lock().unwrap_or_else(PoisonError::into_inner).clone();
                // Who has asked may be gone.
                let _ = query.reply(own_key.clone(), bytes).wait();
            })
            .wait()
            .map_err(failed)?;
        Ok(Self {
            percepts,
            controls,
            overflows,
            description,
            _subscriber: subscriber,
            _queryable: queryable,
            _session: session,
        })
    }
}

impl VehiclePort for ZenohPort {
    fn set_description(&mut self, bytes: Vec<u8>) {
        *self.description.lock().unwrap_or_else(PoisonError::into_inner) = bytes;
    }

    fn send(&mut self, percept: &[u8]) {
        // A link that is down loses it; it is sent again until it is answered.
        let _ = self.percepts.put(percept).wait();
    }

    fn receive(&mut self) -> Option<Vec<u8>> {
        self.controls.try_recv().ok()
    }

    fn overflow_count(&self) -> u64 {
        self.overflows.load(Ordering::Relaxed)
    }
}
