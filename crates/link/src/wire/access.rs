//! Access control of Zenoh: who may publish and subscribe what at an endpoint, by the common names of certificates.
//! Everything else is denied.
//!
//! A key names sender, receiver and the receiver's session, `sidestep/FROM/TO/SESSION`. It is published for whatever
//! session, `sidestep/FROM/TO/*`, and each session subscribes to a key that no other one has: Zenoh (1.10) keeps what it
//! knows of a closed connection, some kilobytes, for as long as anyone else has subscribed to one of its keys.
//!
//! A node may publish under its own name only, and receive only what is for it or for all nodes; queries for views are for
//! viewers. Zenoh drops what is denied and says so only in its most detailed log: [`DenialLayer`] counts that.

use crate::identity::{SERVER_NAME, VIEWER_NAME};
use crate::peer::PeerId;
use serde_json::{Value, json};
use sidestep::kernel::EntityId;
use sidestep_session::fleet::Tls;
use std::cell::RefCell;
use std::fmt::{self, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use tracing::field::{Field, Visit};
use tracing::{Event, Subscriber};
use tracing_subscriber::layer::{Context, Layer};

/// The receiver of a frame for all other nodes. No peer has that name.
pub(super) const ALL: &str = "all";

/// The keys of views.
const VIEWS: [&str; 2] = ["sidestep/scene", "sidestep/view"];

/// Everything of a fleet.
const EVERYTHING: &str = "sidestep/**";

/// The certificates of a party, and the names in those of others.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Credentials {
    /// The certificates of the party itself.
    pub tls: Tls,
    /// The common names of the certificates of all agents, by their ids.
    pub agents: Vec<String>,
}

/// An endpoint at which access is controlled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Guarded {
    /// Of the server, to which all nodes and viewers connect.
    Server,
    /// Of a node, by which it connects to the server.
    Node(EntityId),
    /// Of a node, to which other nodes connect.
    Mesh(EntityId),
    /// Of a viewer, by which it connects to the server.
    Viewer,
}

/// What a party may do at an endpoint: each is a list of keys.
#[derive(Debug, Default)]
struct Rights {
    /// What it may publish there.
    puts_in: Vec<String>,
    /// What is published to it from there.
    puts_out: Vec<String>,
    /// What it may subscribe to there.
    subscribes_in: Vec<String>,
    /// What the endpoint itself subscribes to.
    subscribes_out: Vec<String>,
    /// What it may query there, and is answered.
    queries_in: Vec<String>,
    /// What is queried from there, and it may answer.
    queries_out: Vec<String>,
}

/// Whatever session a peer has.
const ANY_SESSION: &str = "*";

/// Returns the key under which a frame from one peer to another is published.
pub(super) fn frame_key(from: PeerId, to: impl fmt::Display) -> String {
    format!("sidestep/{from}/{to}/{ANY_SESSION}")
}

/// Returns the keys of frames for a peer, whoever sends them.
fn keys_to(to: PeerId) -> Vec<String> {
    keys_to_session(to, ANY_SESSION)
}

/// Returns the keys to which a session of a peer subscribes. No other session has them.
pub(super) fn keys_to_session(to: PeerId, session: impl fmt::Display) -> Vec<String> {
    let mut keys = vec![format!("sidestep/*/{to}/{session}")];
    if to != PeerId::Server {
        // Other sessions learn of the subscriptions in this order: so one that can reach this peer by its own key reaches
        // it with broadcasts, too. Broadcasts are for nodes only.
        keys.insert(0, format!("sidestep/*/{ALL}/{session}"));
    }
    keys
}

/// Returns the sender of a frame by the key under which it was published; `None` for another key.
pub(super) fn sender_of(key: &str) -> Option<PeerId> {
    let (from, _) = key.strip_prefix("sidestep/")?.split_once('/')?;
    match from {
        SERVER_NAME => Some(PeerId::Server),
        id => id.parse().ok().map(PeerId::Node),
    }
}

impl Rights {
    /// Of a peer at the endpoint of another one: it publishes under its own name, for one or for many.
    fn of_peer(peer: PeerId, at: PeerId) -> Self {
        let subscribes_in = keys_to(peer);
        match at {
            // The server relays.
            PeerId::Server => Self {
                puts_in: vec![frame_key(peer, "*")],
                puts_out: keys_to(peer),
                subscribes_in,
                subscribes_out: vec![EVERYTHING.into()],
                ..Self::default()
            },
            PeerId::Node(_) => Self {
                puts_in: vec![frame_key(peer, at), frame_key(peer, ALL)],
                puts_out: vec![frame_key(at, peer), frame_key(at, ALL)],
                subscribes_in,
                subscribes_out: keys_to(at),
                ..Self::default()
            },
        }
    }

    /// Of the server at the endpoint of a node: it relays what others have sent, and nodes that it has started have its
    /// certificate.
    fn of_server(at: PeerId) -> Self {
        Self {
            puts_in: keys_to(at),
            puts_out: vec![frame_key(at, "*")],
            subscribes_in: vec![EVERYTHING.into()],
            subscribes_out: keys_to(at),
            ..Self::default()
        }
    }

    /// Of all that has the server's certificate at the server.
    fn of_own_party() -> Self {
        let everything = || vec![EVERYTHING.to_string()];
        Self {
            puts_in: everything(),
            puts_out: everything(),
            subscribes_in: everything(),
            subscribes_out: everything(),
            queries_in: everything(),
            queries_out: Vec::new(),
        }
    }

    /// Returns the rules in the form of Zenoh's configuration, with the names of those that there are.
    fn rules(&self, party: &str) -> (Vec<Value>, Vec<String>) {
        let all = [
            ("ingress", &["put"][..], &self.puts_in),
            ("egress", &["put"], &self.puts_out),
            ("ingress", &["declare_subscriber"], &self.subscribes_in),
            ("egress", &["declare_subscriber"], &self.subscribes_out),
            ("ingress", &["query"], &self.queries_in),
            ("egress", &["reply", "declare_queryable"], &self.queries_in),
            ("egress", &["query"], &self.queries_out),
            ("ingress", &["reply", "declare_queryable"], &self.queries_out),
        ];
        let mut rules = Vec::new();
        let mut names = Vec::new();
        for (flow, messages, keys) in all.into_iter().filter(|(.., keys)| !keys.is_empty()) {
            let id = format!("{party} {flow} {}", messages[0]);
            rules.push(json!({
                "id": id, "flows": [flow], "messages": messages, "permission": "allow", "key_exprs": keys,
            }));
            names.push(id);
        }
        (rules, names)
    }
}

/// Returns Zenoh's access control at an endpoint, in the form of its configuration.
pub(super) fn access_control(at: Guarded, agents: &[String]) -> Value {
    let views = || VIEWS.map(String::from).to_vec();
    let mut rights: Vec<(&str, Rights)> = Vec::new();
    let nodes = || (0..).zip(agents).map(|(id, name)| (PeerId::Node(id), name.as_str()));
    match at {
        Guarded::Server => {
            rights.push((SERVER_NAME, Rights::of_own_party()));
            rights.push((VIEWER_NAME, Rights { queries_in: views(), ..Rights::default() }));
            rights
                .extend(nodes().map(|(node, name)| (name, Rights::of_peer(node, PeerId::Server))));
        }
        Guarded::Node(me) => rights.push((SERVER_NAME, Rights::of_server(PeerId::Node(me)))),
        Guarded::Mesh(me) => {
            let me = PeerId::Node(me);
            rights.push((SERVER_NAME, Rights::of_server(me)));
            let others = nodes().filter(|(node, _)| *node != me);
            rights.extend(others.map(|(node, name)| (name, Rights::of_peer(node, me))));
        }
        Guarded::Viewer => {
            rights.push((SERVER_NAME, Rights { queries_out: views(), ..Rights::default() }));
        }
    }
    let mut rules = Vec::new();
    let mut subjects = Vec::new();
    let mut policies = Vec::new();
    for (party, rights) in rights {
        let (own, names) = rights.rules(party);
        rules.extend(own);
        subjects.push(json!({ "id": party, "cert_common_names": [party] }));
        policies.push(json!({ "rules": names, "subjects": [party] }));
    }
    json!({
        "enabled": true, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies,
    })
}

/// What was denied since it was last asked for.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Denials {
    /// Number of messages.
    pub count: u64,
    /// The last one, in Zenoh's words: who, what, and under which key.
    pub last: String,
}

/// Number of messages that were denied in all, as far as they were taken.
static DENIED_TOTAL: AtomicU64 = AtomicU64::new(0);

/// Returns the number of messages that were denied so far.
pub fn denied_total() -> u64 {
    DENIED_TOTAL.load(Ordering::Relaxed)
}

static DENIALS: Mutex<Denials> = Mutex::new(Denials { count: 0, last: String::new() });

fn denials() -> MutexGuard<'static, Denials> {
    DENIALS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns what Zenoh's access control has denied since the last call; `None` if it has denied nothing.
pub fn take_denials() -> Option<Denials> {
    let denied = std::mem::take(&mut *denials());
    DENIED_TOTAL.fetch_add(denied.count, Ordering::Relaxed);
    (denied.count > 0).then_some(denied)
}

/// The target of the log of Zenoh's access control.
pub const ACCESS_TARGET: &str = "zenoh::net::routing::interceptor::access_control";

/// A layer of the log that counts what access control denies: Zenoh itself tells nobody.
#[derive(Debug)]
pub struct DenialLayer;

impl<S: Subscriber> Layer<S> for DenialLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = MessageText::default();
        event.record(&mut message);
        let is_denied = PREVIEW.with_borrow_mut(|preview| preview.is_denied_act(&message.0));
        if is_denied || message.0.contains("did not match any") {
            let mut denials = denials();
            denials.count += 1;
            denials.last = message.0;
        }
    }
}

thread_local! {
    static PREVIEW: RefCell<Preview> = const { RefCell::new(Preview { last: None, text: String::new() }) };
}

/// What Zenoh asks itself of a key as soon as a party gives it a number, in this order: so it has the answers at hand. Its
/// log has them in the same words as what a party does.
const PREVIEWED: [&str; 9] = [
    "to Query (ingress)",
    "to Reply (ingress)",
    "to Put (ingress)",
    "to Delete (ingress)",
    "to Declare/Undeclare Subscriber (ingress)",
    "to Declare/Undeclare Queryable (ingress)",
    "to Declare/Undeclare Liveliness Token (ingress)",
    "to Liveliness Query (ingress)",
    "to Declare Liveliness Subscriber (ingress)",
];

/// The course of these questions in a thread.
#[derive(Debug, Default)]
struct Preview {
    /// The number of the last of them, plus 1; `None` where none are asked.
    last: Option<usize>,
    /// The line that answered it.
    text: String,
}

impl Preview {
    /// Returns whether a line of the log says that a party has done what it may not.
    fn is_denied_act(&mut self, text: &str) -> bool {
        // What an endpoint keeps back of its own, on the way out, is no act of another party.
        if !text.contains("(ingress)") {
            return false;
        }
        if text.contains("caching permissions") {
            self.last = Some(0);
            return false;
        }
        if !text.starts_with("Using cached result") && self.is_next(text) {
            return false;
        }
        self.last = None;
        // Sessions of Zenoh watch each other's liveliness by themselves, which no code of a fleet uses.
        text.contains("is unauthorized to") && !text.contains("Liveliness")
    }

    /// Returns whether a line answers the next question. A party that has several names is asked for by each.
    fn is_next(&mut self, text: &str) -> bool {
        let Some(last) = self.last else { return false };
        let Some(k) = PREVIEWED.iter().position(|asked| text.contains(asked)) else { return false };
        let is_next = k + 1 > last || (k + 1 == last && self.text != text);
        if is_next {
            self.last = Some(k + 1);
            self.text = text.into();
        }
        is_next
    }
}

/// The message of an event of a log.
#[derive(Default)]
pub(super) struct MessageText(pub(super) String);

impl Visit for MessageText {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            let _ = write!(self.0, "{value:?}");
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_zenoh_asks_itself_is_no_act_and_what_a_party_does_is() {
        let mut preview = Preview::default();
        assert!(preview.is_denied_act("1f on lo is unauthorized to Put (ingress) on sidestep/3/0"));
        assert!(!preview.is_denied_act("ACL (ingress): caching permissions for `sidestep` ..."));
        for asked in PREVIEWED {
            let line = format!("1f on lo is unauthorized {asked} on sidestep");
            assert!(!preview.is_denied_act(&line), "{line}");
        }
        for act in ["Put (ingress)", "Declare Subscriber (ingress)"] {
            assert!(
                preview.is_denied_act(&format!("1f on lo is unauthorized to {act} on a/b")),
                "{act}"
            );
        }
        assert!(
            preview.is_denied_act("Using cached result: 1f is unauthorized to Put (ingress) on a")
        );
        assert!(!preview.is_denied_act("1f on lo is authorized to Put (ingress) on sidestep/1/0"));
        assert!(!preview.is_denied_act("1f on lo is unauthorized to Query (egress) on sidestep"));
    }

    #[test]
    fn two_sessions_of_a_peer_subscribe_to_keys_of_their_own_and_the_frames_for_it_match_both() {
        use zenoh::key_expr::keyexpr;
        for to in [PeerId::Server, PeerId::Node(3)] {
            let sessions = ["1f", "2f"].map(|session| keys_to_session(to, session));
            assert!(sessions[0].iter().all(|key| !sessions[1].contains(key)), "{sessions:?}");
            let frame = frame_key(PeerId::Node(1), to);
            let frame = keyexpr::new(&frame).expect("a key");
            let is_reached = |key: &String| keyexpr::new(key).expect("a key").intersects(frame);
            assert!(sessions.iter().all(|keys| keys.iter().any(is_reached)), "{to}");
            let other = keys_to_session(PeerId::Node(4), "3f");
            assert!(!other.iter().any(is_reached), "{to}");
        }
    }

    #[test]
    fn the_key_of_a_frame_names_its_sender() {
        for peer in [PeerId::Server, PeerId::Node(12)] {
            assert_eq!(sender_of(&frame_key(peer, ALL)), Some(peer));
            assert_eq!(sender_of(&frame_key(peer, PeerId::Node(3))), Some(peer));
        }
        for key in ["sidestep/view", "sidestep/x/3", "other/3/4", "sidestep/-1/3"] {
            assert_eq!(sender_of(key), None, "{key}");
        }
    }
}
