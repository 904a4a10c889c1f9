//! The rules of access: the right host and origin on every request, and a token where others can reach the port.
//!
//! A foreign page may make a browser ask a server on this machine. So the `Host` must be one of ours (otherwise a
//! name rebound to this machine would do), and the `Origin`, which scripts cannot change, must be the page's own.
//! This is enough for a server that listens only on the machine itself; any other requires a token: it is in the
//! address's fragment, which is never sent, and the page exchanges it for a cookie that no script can read. Browsers
//! send that cookie only to the name under which they got it, so there any name of the machine will do.

use axum::http::HeaderMap;
use axum::http::header::{COOKIE, HOST, ORIGIN};
use std::net::{IpAddr, SocketAddr};

/// The name of the cookie, followed by the port: cookies are shared by all ports of a host.
const COOKIE_NAME: &str = "sidestep-studio-";

/// The header in which browsers report whether the requesting page is of the same origin.
const SEC_FETCH_SITE: &str = "sec-fetch-site";

/// The reason why a request is refused. Every request is checked for host and origin, and for the token only where it
/// asks for more than the page.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum AccessError {
    /// It was sent to a name that is not ours.
    Host,
    /// A foreign page sent it.
    Origin,
    /// It does not know the token.
    Token,
}

/// The rules of one server.
#[derive(Debug, Clone)]
pub(crate) struct AccessPolicy {
    port: u16,
    /// A name of this machine besides its IP addresses, if the server was given one.
    name: Option<String>,
    token: Option<String>,
}

impl AccessPolicy {
    /// Returns the rules of a server at an address; `name` is the host that its user gave.
    ///
    /// # Errors
    /// When the system gives no random numbers for the token.
    pub(crate) fn new(address: SocketAddr, name: &str) -> std::io::Result<Self> {
        let token = if address.ip().is_loopback() { None } else { Some(new_token()?) };
        let is_name = name.parse::<IpAddr>().is_err();
        let name = is_name.then(|| name.to_ascii_lowercase());
        Ok(Self { port: address.port(), name, token })
    }

    /// Returns the token; `None` where the server listens only on the machine itself.
    pub(crate) fn token(&self) -> Option<&str> {
        self.token.as_deref()
    }

    /// Checks that a request comes from our own page, or from no page at all.
    ///
    /// # Errors
    /// When it does not.
    pub(crate) fn check_origin(&self, headers: &HeaderMap) -> Result<(), AccessError> {
        let host = single_header(headers, &HOST).ok_or(AccessError::Host)?;
        if !self.is_own_host(host) {
            return Err(AccessError::Host);
        }
        if !headers.contains_key(ORIGIN) {
            return Ok(());
        }
        let origin =
            single_header(headers, &ORIGIN).and_then(|origin| origin.strip_prefix("http://"));
        if !origin.is_some_and(|origin| origin.eq_ignore_ascii_case(host)) {
            return Err(AccessError::Origin);
        }
        Ok(())
    }

    /// Checks that a request may do more than read the page.
    ///
    /// # Errors
    /// When it may not.
    pub(crate) fn authorize(&self, headers: &HeaderMap) -> Result<(), AccessError> {
        self.check_origin(headers)?;
        let Some(token) = &self.token else { return Ok(()) };
        let name = self.cookie_name();
        let cookies = headers.get_all(COOKIE).iter().filter_map(|value| value.to_str().ok());
        let mut values = cookies
            .flat_map(|all| all.split(';'))
            .filter_map(|cookie| cookie.trim().strip_prefix(name.as_str())?.strip_prefix('='));
        if !values.any(|value| constant_time_eq(value, token)) {
            return Err(AccessError::Token);
        }
        Ok(())
    }

    /// Checks that a request for something that costs work comes from our own page, even if it has no `Origin`:
    /// a foreign page may make a browser fetch an address, though it never sees the answer.
    ///
    /// # Errors
    /// When it does not.
    pub(crate) fn authorize_fetch(&self, headers: &HeaderMap) -> Result<(), AccessError> {
        self.authorize(headers)?;
        // Programs that are no browsers do not send it.
        let mut sites = headers.get_all(SEC_FETCH_SITE).iter();
        if !sites.all(|site| site == "same-origin" || site == "none") {
            return Err(AccessError::Origin);
        }
        Ok(())
    }

    /// Returns the cookie for a client that knows the token.
    ///
    /// # Errors
    /// When the client's token is wrong.
    pub(crate) fn sign_in(&self, given: &str) -> Result<String, AccessError> {
        let token = self.token.as_deref().unwrap_or_default();
        if self.token.is_some() && !constant_time_eq(given.trim(), token) {
            return Err(AccessError::Token);
        }
        let name = self.cookie_name();
        Ok(format!("{name}={token}; HttpOnly; SameSite=Strict; Path=/"))
    }

    fn cookie_name(&self) -> String {
        format!("{COOKIE_NAME}{}", self.port)
    }

    /// Returns whether a host may be this machine: an IP address, which cannot be rebound, `localhost`, the name that
    /// was given, or any name where a token is needed as well. Any port will do, because it may be forwarded.
    fn is_own_host(&self, host: &str) -> bool {
        let name = match host.strip_prefix('[') {
            Some(rest) => rest.split(']').next().unwrap_or_default(),
            None => host.split(':').next().unwrap_or_default(),
        };
        let name = name.to_ascii_lowercase();
        let is_number = name.parse::<IpAddr>().is_ok();
        is_number || name == "localhost" || self.name == Some(name) || self.token.is_some()
    }
}

/// Returns a header that occurs exactly once, as text: of several, a proxy and we might take different ones.
fn single_header<'a>(headers: &'a HeaderMap, name: &axum::http::HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

/// Compares two texts in a time that does not depend on where they differ, so that a token cannot be guessed byte by byte.
fn constant_time_eq(given: &str, token: &str) -> bool {
    let differing = given.bytes().zip(token.bytes()).fold(0, |all, (a, b)| all | (a ^ b));
    given.len() == token.len() && differing == 0
}

/// Returns a new token of 128 random bits.
fn new_token() -> std::io::Result<String> {
    let mut bytes = [0_u8; 16];
    getrandom::fill(&mut bytes).map_err(std::io::Error::other)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn headers(all: &[(&'static str, &str)]) -> HeaderMap {
        let mut headers = HeaderMap::new();
        for (name, value) in all {
            headers.append(*name, value.parse().expect("a value"));
        }
        headers
    }

    fn local() -> AccessPolicy {
        AccessPolicy::new("127.0.0.1:7800".parse().expect("an address"), "127.0.0.1")
            .expect("a guard")
    }

    fn open() -> AccessPolicy {
        AccessPolicy::new("192.0.2.1:7800".parse().expect("an address"), "lab.example")
            .expect("a guard")
    }

    #[test]
    fn hosts_are_numbers_localhost_and_the_name_that_was_given() {
        let admits = |access: &AccessPolicy, host| access.check_origin(&headers(&[("host", host)]));
        for host in
            ["127.0.0.1:7800", "localhost:7800", "[::1]:7800", "localhost:9999", "LOCALHOST"]
        {
            assert_eq!(admits(&local(), host), Ok(()), "{host}");
        }
        for host in [
            "evil.example",
            "localhost.evil.example:7800",
            "lab.example:7800",
            "",
            "127.0.0.1.evil",
        ] {
            assert_eq!(admits(&local(), host), Err(AccessError::Host), "{host}");
        }
        for host in ["Lab.Example:7800", "another-name-of-it:7800"] {
            assert_eq!(admits(&open(), host), Ok(()), "{host}");
            let without_cookie = open().authorize(&headers(&[("host", host)]));
            assert_eq!(without_cookie, Err(AccessError::Token), "{host}");
        }
        assert_eq!(local().check_origin(&headers(&[])), Err(AccessError::Host));
        let two = headers(&[("host", "localhost"), ("host", "localhost")]);
        assert_eq!(local().check_origin(&two), Err(AccessError::Host));
    }

    #[test]
    fn only_our_own_page_may_ask() {
        let admits = |origin| {
            local().check_origin(&headers(&[("host", "localhost:7800"), ("origin", origin)]))
        };
        assert_eq!(admits("http://localhost:7800"), Ok(()));
        let others = [
            "http://evil.example",
            "http://localhost:3000",
            "http://127.0.0.1:7800",
            "https://localhost:7800",
            "null",
            "",
        ];
        for origin in others {
            assert_eq!(admits(origin), Err(AccessError::Origin), "{origin}");
        }
    }

    #[test]
    fn results_are_not_made_for_pages_of_others() {
        let fetches = |site| {
            local().authorize_fetch(&headers(&[("host", "localhost:7800"), (SEC_FETCH_SITE, site)]))
        };
        assert_eq!([fetches("same-origin"), fetches("none")], [Ok(()), Ok(())]);
        for site in ["cross-site", "same-site", ""] {
            assert_eq!(fetches(site), Err(AccessError::Origin), "{site}");
        }
        let without = headers(&[("host", "localhost:7800")]);
        assert_eq!(local().authorize_fetch(&without), Ok(()), "a program that is no browser");
        assert_eq!(open().authorize_fetch(&without), Err(AccessError::Token));
    }

    #[test]
    fn a_server_that_others_can_reach_wants_its_token() {
        let access = open();
        let token = access.token().expect("a token").to_string();
        assert_eq!(token.len(), 32);
        assert_ne!(Some(token.as_str()), open().token(), "a new one for each server");
        let trusts = |cookie: &str| {
            access.authorize(&headers(&[("host", "192.0.2.1:7800"), ("cookie", cookie)]))
        };
        assert_eq!(trusts(""), Err(AccessError::Token));
        assert_eq!(trusts("sidestep-studio-7800="), Err(AccessError::Token));
        assert_eq!(trusts(&format!("sidestep-studio-7801={token}")), Err(AccessError::Token));
        assert_eq!(trusts(&format!("a=b; sidestep-studio-7800={token}")), Ok(()));
        assert_eq!(access.sign_in(&token[1..]), Err(AccessError::Token));
        assert_eq!(access.sign_in(""), Err(AccessError::Token));
        let cookie = access.sign_in(&format!("{token}\n")).expect("known");
        assert!(cookie.contains("HttpOnly") && cookie.contains("SameSite=Strict"), "{cookie}");
        assert!(local().token().is_none() && local().sign_in("").is_ok());
    }
}
