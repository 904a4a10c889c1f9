//! Tells in the log what certificates do not allow: each kind once, and then at each doubling of its count, because
//! whoever is denied could else fill the log.

use crate::identity::{SERVER_NAME, VIEWER_NAME};
use crate::wire::access::{Credentials, Denials, take_denials};
use crate::wire::link_log::{LinkEvents, RejectionKind, Rejections, take_link_events};
use sidestep::kernel::terminal::escape_controls;
use std::collections::BTreeMap;

/// Maximum number of names that are told: an authority that signs more of them is no authority of a fleet.
const MAX_NAMES: usize = 1_000;

/// Maximum number of characters of a name that are told.
const MAX_NAME_LENGTH: usize = 64;

/// The counts of what was denied so far.
#[derive(Debug, Default)]
pub(super) struct DenialLog {
    /// The common names of the agents' certificates.
    agents: Vec<String>,
    messages: u64,
    /// Links by certificates that are for nobody in the fleet, by their common names as they are told.
    strangers: BTreeMap<String, u64>,
    rejected: BTreeMap<RejectionKind, u64>,
}

impl DenialLog {
    pub(super) fn new(credentials: Option<&Credentials>) -> Self {
        Self {
            agents: credentials.map(|own| own.agents.clone()).unwrap_or_default(),
            messages: 0,
            strangers: BTreeMap::new(),
            rejected: BTreeMap::new(),
        }
    }

    /// Logs what was denied since the last call.
    pub(super) fn report(&mut self) {
        if let Some(denials) = take_denials() {
            self.report_messages(&denials);
        }
        let LinkEvents { opened, rejected } = take_link_events();
        for (name, count) in opened {
            if let Some(stranger) = self.count_stranger(name, count) {
                let Stranger { count, cause, remedy } = stranger;
                tracing::warn!(count, cause, remedy, "a party is denied everything");
            }
        }
        for (kind, rejections) in rejected {
            self.report_rejections(kind, &rejections);
        }
    }

    fn report_messages(&mut self, Denials { count, last }: &Denials) {
        if add(&mut self.messages, *count) {
            tracing::warn!(
                count = self.messages,
                last = &*escape_controls(last),
                "messages are denied: a party does what its certificate does not allow"
            );
        }
    }

    /// Counts links by a certificate, and returns what is to be said of it, if it is for nobody in the fleet.
    fn count_stranger(&mut self, name: String, count: u64) -> Option<Stranger> {
        if [SERVER_NAME, VIEWER_NAME].contains(&&*name) || self.agents.contains(&name) {
            return None;
        }
        let start: String = name.chars().take(MAX_NAME_LENGTH).collect();
        let name = escape_controls(&start).into_owned();
        if self.strangers.len() >= MAX_NAMES && !self.strangers.contains_key(&name) {
            return None;
        }
        let cause = format!(
            "its certificate is for `{name}` (its common name), which is nobody in this fleet"
        );
        let total = self.strangers.entry(name).or_default();
        if !add(total, count) {
            return None;
        }
        Some(Stranger { count: *total, cause, remedy: self.stranger_remedy() })
    }

    fn stranger_remedy(&self) -> String {
        let agents = match &*self.agents {
            [] => "no agents".into(),
            [only] => format!("`{only}`"),
            [first, .., last] => format!("`{first}` to `{last}`"),
        };
        format!(
            "the fleet has {agents}, `{VIEWER_NAME}` and `{SERVER_NAME}`: have its certificate made for one of them, or \
             give the server the scenario that has its agent"
        )
    }

    fn report_rejections(&mut self, kind: RejectionKind, Rejections { count, last }: &Rejections) {
        let total = self.rejected.entry(kind).or_default();
        if !add(total, *count) {
            return;
        }
        let Explanation { cause, remedy } = explanation(kind);
        let count = *total;
        let reason = &*escape_controls(last);
        tracing::warn!(count, cause, reason, remedy, "links are not opened");
    }
}

/// What was denied at the very end is told, too, however the process ends in good order.
impl Drop for DenialLog {
    fn drop(&mut self) {
        self.report();
    }
}

/// What is said of a party that is nobody in the fleet.
#[derive(Debug, PartialEq, Eq)]
struct Stranger {
    count: u64,
    cause: String,
    remedy: String,
}

struct Explanation {
    cause: &'static str,
    remedy: &'static str,
}

fn explanation(kind: RejectionKind) -> Explanation {
    match kind {
        RejectionKind::OutOfDate => Explanation {
            cause: "the certificate of the other end is out of date",
            remedy: "renew it, or correct the date of its machine or of this one",
        },
        RejectionKind::OtherAuthority => Explanation {
            cause: "the certificate of the other end does not hold by the authority of this party (--tls-ca)",
            remedy: "have the certificates of all parties made by one authority",
        },
        RejectionKind::NoCertificate => Explanation {
            cause: "the other end has shown no certificate",
            remedy: "give it --tls-ca, --tls-cert and --tls-key",
        },
        RejectionKind::Distrusted => Explanation {
            cause: "the other end does not take the certificate of this party",
            remedy: "give the other end the authority of this party by --tls-ca, and see the dates of both machines",
        },
        RejectionKind::NoFiles => Explanation {
            cause: "this process can open no more files",
            remedy: "allow it more before it starts: ulimit -n 65536",
        },
        RejectionKind::Other => Explanation {
            cause: "no encrypted link was agreed on",
            remedy: "see what connects to this address: a program without certificates, or a scan of ports",
        },
    }
}

/// Adds to a count, and returns whether that is to be told.
fn add(total: &mut u64, count: u64) -> bool {
    let before = *total;
    *total += count;
    has_doubled(before, *total)
}

/// Returns whether a count has reached 1, or a power of two, on its way.
fn has_doubled(before: u64, now: u64) -> bool {
    before.checked_ilog2() != now.checked_ilog2()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_is_told_once_and_at_each_doubling() {
        let told: Vec<u64> = (0..20).filter(|&before| has_doubled(before, before + 1)).collect();
        assert_eq!(told, [0, 1, 3, 7, 15]);
        assert!(has_doubled(5, 100) && !has_doubled(4, 7));
    }

    #[test]
    fn a_certificate_for_nobody_is_named_and_escaped_with_who_there_is() {
        let agents = vec!["airplane-0".to_string(), "airplane-2".into()];
        let mut log = DenialLog::default();
        log.agents.extend(agents);
        for known in ["server", "viewer", "airplane-0", "airplane-2"] {
            assert_eq!(log.count_stranger(known.into(), 9), None, "{known}");
        }
        let said = log.count_stranger("air\u{1b}[2Jplane-7".into(), 1).expect("told");
        assert_eq!(said.count, 1);
        assert!(said.cause.contains("plane-7`") && !said.cause.contains('\u{1b}'), "{said:?}");
        assert!(said.remedy.contains("`airplane-0` to `airplane-2`"), "{said:?}");
        assert!(log.count_stranger("air\u{1b}[2Jplane-7".into(), 1).is_some(), "doubled");
        assert!(log.count_stranger("air\u{1b}[2Jplane-7".into(), 1).is_none());
        assert!(
            log.count_stranger("b".repeat(9_999), 1).is_some_and(|said| said.cause.len() < 200)
        );
    }
}
