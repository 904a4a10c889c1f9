//! What Zenoh says of encrypted links in its log, and nowhere else: which were opened by whose certificate, and which
//! were not, and why.
//!
//! The common name of a link that was opened is proven by the authority. Of a link that was not opened Zenoh says the
//! reason alone, and neither the name in the certificate nor the address.

use super::access::MessageText;
use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use tracing::{Event, Level, Subscriber};
use tracing_subscriber::layer::{Context, Layer};

/// The target of the log of Zenoh's encrypted links.
pub const LINK_TARGET: &str = "zenoh_link_tls";

/// What Zenoh advises whenever a link cannot be accepted, whatever the reason.
pub const FILE_LIMIT_HINT: &str = "Hint: increase the system open file limit.";

/// Maximum number of different names or kinds of reasons that are kept until they are taken.
const MAX_KEPT: usize = 64;

/// Why a link was not opened.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum RejectionKind {
    /// The certificate of the other end has expired, or is not valid yet.
    OutOfDate,
    /// It does not hold for another reason: mostly it is of another authority.
    OtherAuthority,
    /// The other end has shown none.
    NoCertificate,
    /// The other end does not take the certificate of this one.
    Distrusted,
    /// This process can open no more files.
    NoFiles,
    /// Something else: the other end speaks another protocol, or has gone away.
    Other,
}

/// Links that were not opened for the same kind of reason.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Rejections {
    /// The number of links.
    pub count: u64,
    /// The reason of the last one, in the words of Zenoh.
    pub last: String,
}

/// What was said of links since it was last asked for.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct LinkEvents {
    /// The number of links that other ends have opened, by the common names of their certificates.
    pub opened: BTreeMap<String, u64>,
    /// The links that were not opened.
    pub rejected: BTreeMap<RejectionKind, Rejections>,
}

static EVENTS: Mutex<LinkEvents> =
    Mutex::new(LinkEvents { opened: BTreeMap::new(), rejected: BTreeMap::new() });

fn events() -> MutexGuard<'static, LinkEvents> {
    EVENTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns what Zenoh has said of links since the last call.
pub fn take_link_events() -> LinkEvents {
    std::mem::take(&mut *events())
}

impl RejectionKind {
    /// Reads the words of Zenoh, which are those of rustls.
    fn of(reason: &str) -> Self {
        let says = |words: &[&str]| words.iter().any(|word| reason.contains(word));
        match () {
            // Before the others: an alert is the other end's word on the certificate of this one.
            () if says(&["fatal alert"]) => Self::Distrusted,
            () if says(&["xpired", "not valid yet", "NotValidYet"]) => Self::OutOfDate,
            () if says(&["invalid peer certificate"]) => Self::OtherAuthority,
            () if says(&["sent no certificate"]) => Self::NoCertificate,
            () if says(&["Too many open files", "os error 24"]) => Self::NoFiles,
            () => Self::Other,
        }
    }
}

impl LinkEvents {
    fn record(&mut self, level: Level, text: &str) {
        // Warnings and errors; the order of levels is that of detail.
        if level <= Level::WARN {
            let reason = text.replace(FILE_LIMIT_HINT, "");
            let rejections = self.rejected.entry(RejectionKind::of(&reason)).or_default();
            rejections.count += 1;
            rejections.last = reason.trim_end_matches([' ', '.']).to_string();
        } else if let Some(name) = opened_name(text) {
            let is_kept = self.opened.len() < MAX_KEPT || self.opened.contains_key(name);
            if is_kept {
                *self.opened.entry(name.to_string()).or_default() += 1;
            }
        }
    }
}

/// Returns the common name of the certificate by which a link was opened, if a line says that one was. The name is the
/// rest of the line, so it cannot be taken for another part of it.
fn opened_name(text: &str) -> Option<&str> {
    let rest = text.strip_prefix("Accepted TLS connection on ")?;
    let (_, name) = rest.split_once("Common Name: ")?;
    Some(name.strip_suffix('.').unwrap_or(name))
}

/// A layer of the log that reads what Zenoh says of encrypted links.
#[derive(Debug)]
pub struct LinkLayer;

impl<S: Subscriber> Layer<S> for LinkLayer {
    fn on_event(&self, event: &Event<'_>, _: Context<'_, S>) {
        let mut message = MessageText::default();
        event.record(&mut message);
        events().record(*event.metadata().level(), &message.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_name_of_a_link_is_all_that_its_certificate_says() {
        let line = |name: &str| {
            format!("Accepted TLS connection on 127.0.0.1:1: 127.0.0.1:2. Common Name: {name}.")
        };
        for name in ["airplane-3", "a. Common Name: server", "a.b.", "\u{1b}[31mred"] {
            assert_eq!(opened_name(&line(name)), Some(name));
        }
        assert_eq!(opened_name("Ready to accept TLS connections on: 127.0.0.1:1"), None);
    }

    #[test]
    fn links_are_counted_by_the_kind_of_reason_for_which_they_were_not_opened() {
        let mut events = LinkEvents::default();
        let kinds = [
            (
                "invalid peer certificate: certificate expired: verification time 3",
                RejectionKind::OutOfDate,
            ),
            ("invalid peer certificate: UnknownIssuer", RejectionKind::OtherAuthority),
            ("peer sent no certificates", RejectionKind::NoCertificate),
            ("received fatal alert: CertificateExpired", RejectionKind::Distrusted),
            ("Too many open files (os error 24)", RejectionKind::NoFiles),
            ("tls handshake eof", RejectionKind::Other),
        ];
        for (reason, kind) in kinds {
            events.record(Level::WARN, &format!("{reason}. {FILE_LIMIT_HINT}"));
            let rejections = Rejections { count: 1, last: reason.into() };
            assert_eq!(events.rejected[&kind], rejections);
        }
        events.record(Level::WARN, "tls handshake eof");
        assert_eq!(events.rejected[&RejectionKind::Other].count, 2);
        assert_eq!(events.opened, BTreeMap::new());
    }

    #[test]
    fn many_names_are_not_kept() {
        let mut events = LinkEvents::default();
        for name in 0..2 * MAX_KEPT {
            let line = format!("Accepted TLS connection on 1: 2. Common Name: {name}.");
            events.record(Level::DEBUG, &line);
            events.record(Level::DEBUG, &line);
        }
        assert_eq!(events.opened.len(), MAX_KEPT);
        assert_eq!(events.opened["0"], 2);
    }
}
