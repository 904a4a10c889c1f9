//! Identities: whom a certificate stands for, by the common name of its subject.
//!
//! `server` is the server of a fleet, which may also run any of its agents, `viewer` watches, and `airplane-3` or
//! `connector-0.3` runs this agent and no other.

use sidestep_session::fleet::AgentName;
use std::fmt;
use std::path::Path;
use x509_parser::pem::Pem;
use x509_parser::prelude::X509Certificate;

/// The common name of a server.
pub const SERVER_NAME: &str = "server";

/// The common name of a viewer.
pub const VIEWER_NAME: &str = "viewer";

/// Whom a certificate stands for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum CertificateName {
    /// The server of a fleet, with the nodes that it starts.
    Server,
    /// A viewer, which takes no part.
    Viewer,
    /// The node of an agent.
    Agent(AgentName),
}

impl CertificateName {
    /// Reads a common name; `None` for one that stands for nobody in a fleet.
    pub fn parse(name: &str) -> Option<Self> {
        match name {
            SERVER_NAME => return Some(Self::Server),
            VIEWER_NAME => return Some(Self::Viewer),
            _ => {}
        }
        let (noun, number) = name.split_once('-')?;
        let (body, part) = match number.split_once('.') {
            Some((body, part)) => (body, Some(part.parse().ok()?)),
            None => (number, None),
        };
        let agent = AgentName::new(noun.to_string(), body.parse().ok()?, part);
        let parsed = Self::Agent(agent);
        // `airplane-03` would be a second name of airplane 3.
        (parsed.to_string() == name).then_some(parsed)
    }

    /// Returns whether it may run an agent.
    pub fn may_run(&self, agent: &AgentName) -> bool {
        match self {
            Self::Server => true,
            Self::Viewer => false,
            Self::Agent(own) => own == agent,
        }
    }
}

impl fmt::Display for CertificateName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Server => f.write_str(SERVER_NAME),
            Self::Viewer => f.write_str(VIEWER_NAME),
            Self::Agent(agent) => write!(f, "{}-{agent}", agent.noun),
        }
    }
}

/// Returns the common name of the certificate in a file; `None` if there is none. The first one of the subject counts, as
/// for Zenoh.
pub fn common_name(file: &Path) -> Option<String> {
    let text = std::fs::read(file).ok()?;
    let pem = Pem::iter_from_buffer(&text).next()?.ok()?;
    name_in_certificate(&pem.parse_x509().ok()?)
}

/// Returns the common name in a certificate; `None` if there is none.
pub(crate) fn name_in_certificate(certificate: &X509Certificate<'_>) -> Option<String> {
    let name = certificate.subject().iter_common_name().next()?;
    Some(name.as_str().ok()?.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_common_name_stands_for_one_party_and_each_party_has_one() {
        let airplane = AgentName::new("airplane", 3, None);
        let connector = AgentName::new("connector", 0, Some(3));
        for (text, name) in [
            ("server", CertificateName::Server),
            ("viewer", CertificateName::Viewer),
            ("airplane-3", CertificateName::Agent(airplane.clone())),
            ("connector-0.3", CertificateName::Agent(connector.clone())),
        ] {
            assert_eq!(CertificateName::parse(text), Some(name.clone()), "{text}");
            assert_eq!(name.to_string(), text);
        }
        for text in
            ["", "Server", "airplane", "airplane-", "airplane-03", "airplane-3.", "-", "a-1.02"]
        {
            assert_eq!(CertificateName::parse(text), None, "{text}");
        }
        let own = CertificateName::Agent(airplane.clone());
        assert!(own.may_run(&airplane) && !own.may_run(&connector));
        assert!(CertificateName::Server.may_run(&connector));
        assert!(!CertificateName::Viewer.may_run(&airplane));
    }
}
