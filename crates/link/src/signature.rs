//! Signatures of the frames that nodes send to each other: the server relays these, and anybody may carry them.
//!
//! A link with certificates proves who is at its other end, and no more than that. So each node makes a key for the time
//! of its process (Ed25519), which the key of its certificate signs once ([`SessionCertificate`]); the server passes that
//! on with the list of members, and each node checks it by the authority before it believes a frame.
//!
//! What the server itself says needs no signature: it comes over a link with the server.

use crate::identity::{CertificateName, name_in_certificate};
use crate::protocol::{Incarnation, SessionCertificate};
use ring::rand::{SecureRandom, SystemRandom};
use ring::signature::{ED25519, Ed25519KeyPair, KeyPair, UnparsedPublicKey};
use rustls::crypto::CryptoProvider;
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, PrivateKeyDer, UnixTime};
use rustls::server::WebPkiClientVerifier;
use rustls::server::danger::ClientCertVerifier;
use rustls::{RootCertStore, SignatureScheme};
use sidestep::kernel::EntityId;
use sidestep_session::fleet::Tls;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;
use x509_parser::prelude::{FromDer, X509Certificate};

/// Bytes that a signature adds to a frame: as many as the budget of a radio counts.
pub use sidestep::kernel::network::SIGNATURE_BYTES;

/// First bytes of what a certificate's key signs, so that no other signature by it can be taken for one.
const CONTEXT: &[u8] = b"sidestep session key 1";

/// The kinds of signatures by certificates' keys, the preferred ones first. Each key is able to make one of them.
const SCHEMES: [SignatureScheme; 6] = [
    SignatureScheme::ED25519,
    SignatureScheme::ECDSA_NISTP256_SHA256,
    SignatureScheme::ECDSA_NISTP384_SHA384,
    SignatureScheme::RSA_PSS_SHA256,
    SignatureScheme::RSA_PSS_SHA384,
    SignatureScheme::RSA_PSS_SHA512,
];

/// Returns what a certificate's key signs.
fn statement(agent: EntityId, incarnation: Incarnation, key: &[u8]) -> Vec<u8> {
    let agent = u64::from(agent).to_be_bytes();
    [CONTEXT, &agent, &incarnation.0.to_be_bytes(), key].concat()
}

fn provider() -> Arc<CryptoProvider> {
    Arc::new(rustls::crypto::ring::default_provider())
}

/// The key by which a node signs its frames.
pub struct SessionKey {
    pair: Ed25519KeyPair,
    certificate: SessionCertificate,
}

impl fmt::Debug for SessionKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SessionKey").finish_non_exhaustive()
    }
}

impl SessionKey {
    /// Makes a key for the process of an agent's node, and signs it by the key of its certificate.
    ///
    /// # Errors
    /// When the files cannot be read, or their key cannot sign.
    pub fn new(tls: &Tls, agent: EntityId, incarnation: Incarnation) -> Result<Self, String> {
        let mut seed = [0; 32];
        let no_random = |_| "the system has no random numbers".to_string();
        SystemRandom::new().fill(&mut seed).map_err(no_random)?;
        let pair = Ed25519KeyPair::from_seed_unchecked(&seed).map_err(|e| e.to_string())?;
        let chain = CertificateDer::pem_file_iter(&tls.certificate).map_err(|e| e.to_string())?;
        let chain: Vec<CertificateDer<'_>> =
            chain.collect::<Result<_, _>>().map_err(|e| e.to_string())?;
        let own = PrivateKeyDer::from_pem_file(&tls.key).map_err(|e| e.to_string())?;
        let own = provider().key_provider.load_private_key(own).map_err(|e| e.to_string())?;
        let signer = own.choose_scheme(&SCHEMES).ok_or("its key is of an unknown kind")?;
        let mut key = [0; 32];
        key.copy_from_slice(pair.public_key().as_ref());
        let signature = signer.sign(&statement(agent, incarnation, &key));
        let certificate = SessionCertificate {
            key,
            chain: chain.iter().map(|certificate| certificate.to_vec()).collect(),
            scheme: signer.scheme().into(),
            signature: signature.map_err(|e| e.to_string())?,
        };
        Ok(Self { pair, certificate })
    }

    /// Returns the public key, signed.
    pub fn certificate(&self) -> &SessionCertificate {
        &self.certificate
    }

    /// Returns a frame with its signature.
    pub fn sign(&self, mut frame: Vec<u8>) -> Vec<u8> {
        let signature = self.pair.sign(&frame);
        frame.extend(signature.as_ref());
        frame
    }
}

/// A key that is believed to be of an agent's node.
#[derive(Debug)]
struct KnownKey {
    incarnation: Incarnation,
    key: [u8; 32],
    /// Whether the agent has a certificate of its own. One that has is not run by the server's.
    is_of_agent: bool,
}

/// The keys of other nodes, and the authority by which they are checked.
#[derive(Debug)]
pub struct KnownKeys {
    verifier: Arc<dyn ClientCertVerifier>,
    /// The common names of the agents' certificates, by their ids.
    names: Vec<String>,
    keys: BTreeMap<EntityId, KnownKey>,
    /// Processes that others have followed: their frames are not believed again.
    former: BTreeSet<(EntityId, Incarnation)>,
}

impl KnownKeys {
    /// Returns those of a fleet whose agents' certificates have these common names; none are known yet.
    ///
    /// # Errors
    /// When the authority's certificate cannot be read.
    pub fn new(tls: &Tls, names: Vec<String>) -> Result<Self, String> {
        let mut roots = RootCertStore::empty();
        for root in CertificateDer::pem_file_iter(&tls.authority).map_err(|e| e.to_string())? {
            roots.add(root.map_err(|e| e.to_string())?).map_err(|e| e.to_string())?;
        }
        let builder = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider());
        let verifier = builder.build().map_err(|e| e.to_string())?;
        Ok(Self { verifier, names, keys: BTreeMap::new(), former: BTreeSet::new() })
    }

    /// Checks that a key is of the node of an agent.
    ///
    /// # Errors
    /// With the reason why nobody can tell.
    pub fn check(
        &self,
        agent: EntityId,
        incarnation: Incarnation,
        session: Option<&SessionCertificate>,
    ) -> Result<(), String> {
        self.known_key(agent, incarnation, session).map(drop)
    }

    /// Believes frames that are signed by a key from now on, if it is of the node of an agent.
    ///
    /// # Errors
    /// With the reason why nobody can tell.
    pub fn learn(
        &mut self,
        agent: EntityId,
        incarnation: Incarnation,
        session: Option<&SessionCertificate>,
    ) -> Result<(), String> {
        let known = self.known_key(agent, incarnation, session)?;
        if let Some(before) = self.keys.insert(agent, known)
            && before.incarnation != incarnation
        {
            self.former.insert((agent, before.incarnation));
        }
        Ok(())
    }

    fn known_key(
        &self,
        agent: EntityId,
        incarnation: Incarnation,
        session: Option<&SessionCertificate>,
    ) -> Result<KnownKey, String> {
        let session = session.ok_or("it has no key that its certificate has signed")?;
        let name = self.common_name(session)?;
        let is_of_agent = match CertificateName::parse(&name) {
            Some(CertificateName::Server) => false,
            Some(_) if self.names.get(agent as usize) == Some(&name) => true,
            _ => return Err(format!("its certificate is for `{name}`")),
        };
        if !is_of_agent && self.keys.get(&agent).is_some_and(|known| known.is_of_agent) {
            return Err("it had a certificate of its own before, and has the server's now".into());
        }
        if self.former.contains(&(agent, incarnation)) {
            return Err("another process has followed this one".into());
        }
        let statement = statement(agent, incarnation, &session.key);
        check_signature(session, &statement)?;
        Ok(KnownKey { incarnation, key: session.key, is_of_agent })
    }

    /// Returns the common name in a certificate that the authority has signed.
    fn common_name(&self, session: &SessionCertificate) -> Result<String, String> {
        let chain: Vec<CertificateDer<'_>> =
            session.chain.iter().map(|der| CertificateDer::from(der.as_slice())).collect();
        let (own, between) = chain.split_first().ok_or("it has no certificate")?;
        self.verifier
            .verify_client_cert(own, between, UnixTime::now())
            .map_err(|e| format!("its certificate does not hold: {e}"))?;
        let (_, certificate) = X509Certificate::from_der(own).map_err(|e| e.to_string())?;
        name_in_certificate(&certificate).ok_or_else(|| "its certificate is for nobody".into())
    }

    /// Returns a frame without its signature; `None` if the key of its sender is unknown, an error if it has not made the
    /// signature.
    pub fn open<'a>(
        &self,
        agent: EntityId,
        incarnation: Incarnation,
        bytes: &'a [u8],
    ) -> Result<Option<&'a [u8]>, ForgedFrame> {
        let known = self.keys.get(&agent).filter(|known| known.incarnation == incarnation);
        let Some(known) = known else { return Ok(None) };
        let (frame, signature) = bytes.split_last_chunk::<SIGNATURE_BYTES>().ok_or(ForgedFrame)?;
        let key = UnparsedPublicKey::new(&ED25519, &known.key);
        key.verify(frame, signature).map_err(|_| ForgedFrame)?;
        Ok(Some(frame))
    }
}

/// A frame that its sender has not signed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ForgedFrame;

/// Checks that the key of a session's certificate has signed a statement.
fn check_signature(session: &SessionCertificate, statement: &[u8]) -> Result<(), String> {
    let own = session.chain.first().ok_or("it has no certificate")?;
    let (_, certificate) = X509Certificate::from_der(own).map_err(|e| e.to_string())?;
    let key = &certificate.public_key().subject_public_key.data;
    let scheme = SignatureScheme::from(session.scheme);
    let algorithms = provider().signature_verification_algorithms;
    let candidates = algorithms.mapping.iter().filter(|(known, _)| *known == scheme);
    // Keys of different kinds have different forms: of the candidates one can read it at most.
    let is_signed = candidates
        .flat_map(|(_, algorithms)| algorithms.iter())
        .any(|algorithm| algorithm.verify_signature(key, statement, &session.signature).is_ok());
    if is_signed { Ok(()) } else { Err("the key of its certificate has not signed its key".into()) }
}
