//! Reading of requests: every message of a page gets an answer.

use crate::protocol::{ClientRequest, Problem, SessionId};
use serde::Deserialize;
use serde_json::Value;

/// Longest text of a request, in bytes: room for the longest scenario that can be read (16 MiB), and for the one that
/// it replaces, both as JSON.
pub const MAX_REQUEST_BYTES: usize = 40 << 20;

/// A request of which only the number can be read.
#[derive(Deserialize)]
struct RequestNumber {
    id: u32,
}

/// Returns the request in a text.
///
/// # Errors
/// With the number of the request, 0 if it cannot be found, and the problem.
pub fn decode(text: &str) -> Result<ClientRequest, Box<(u32, Problem)>> {
    if text.len() > MAX_REQUEST_BYTES {
        let cause = format!("it has more than {MAX_REQUEST_BYTES} bytes");
        let remedy = "make the text shorter, or change the file with another program";
        return Err(Box::new((request_number(text), Problem::new("request", cause, remedy))));
    }
    read(text).map_err(|error| {
        let id = request_number(text);
        let cause = format!("it cannot be read: {error}");
        Box::new((id, Problem::new("request", cause, "send JSON as the protocol has it")))
    })
}

/// Reads a request. Whether there is a session decides which methods there are, so the method is read last.
fn read(text: &str) -> serde_json::Result<ClientRequest> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Envelope {
        id: u32,
        session: Option<SessionId>,
        call: Value,
    }
    let Envelope { id, session, call } = serde_json::from_str(text)?;
    Ok(match session {
        None => ClientRequest::Server { id, call: serde_json::from_value(call)? },
        Some(session) => {
            ClientRequest::Session { id, session, call: serde_json::from_value(call)? }
        }
    })
}

/// Returns the number of a request that is not read as a whole, 0 if it has none.
fn request_number(text: &str) -> u32 {
    serde_json::from_str(text).map_or(0, |RequestNumber { id }| id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{OpenTarget, RunMethod, ServerMethod, SessionMethod, Speed};
    use proptest::prelude::*;

    #[test]
    fn requests_are_read_as_the_protocol_has_them() {
        for (text, call) in [
            (r#"{"do":"files"}"#, ServerMethod::Files { folder: None }),
            (
                r#"{"do":"open","target":{"kind":"new","world":"robots"},"seed":null}"#,
                ServerMethod::Open {
                    target: OpenTarget::New { world: "robots".into() },
                    seed: None,
                },
            ),
        ] {
            let request = decode(&format!(r#"{{"id":7,"call":{text}}}"#)).expect(text);
            assert_eq!(request, ClientRequest::Server { id: 7, call });
        }
        for (text, call) in [
            (r#"{"do":"close"}"#, SessionMethod::Close {}),
            (
                r#"{"do":"play","speed":{"times":2.5}}"#,
                SessionMethod::Run(RunMethod::Play { speed: Speed::Times(2.5) }),
            ),
            (
                r#"{"do":"play","speed":"fastest"}"#,
                SessionMethod::Run(RunMethod::Play { speed: Speed::Fastest }),
            ),
        ] {
            let request = decode(&format!(r#"{{"id":7,"session":3,"call":{text}}}"#)).expect(text);
            assert_eq!(request, ClientRequest::Session { id: 7, session: 3, call });
        }
    }

    #[test]
    fn what_cannot_be_read_is_answered_with_its_number_if_it_has_one() {
        for (text, id) in [
            ("", 0),
            ("[1,2", 0),
            ("null", 0),
            (r#"{"id":-1,"call":{}}"#, 0),
            (r#"{"id":5,"call":{"do":"explode"}}"#, 5),
            (r#"{"id":6,"session":1,"call":{"do":"pause","more":1}}"#, 6),
            (r#"{"id":4,"session":1,"call":{"do":"files"}}"#, 4),
            (r#"{"id":3,"call":{"do":"pause"}}"#, 3),
            (r#"{"id":7,"session":1,"call":{"do":"seek","cycle":-3}}"#, 7),
        ] {
            assert_eq!(decode(text).map_err(|unread| unread.0), Err(id), "{text}");
        }
        let long = format!(r#"{{"id":8,"call":{{"text":"{}"}}}}"#, " ".repeat(MAX_REQUEST_BYTES));
        let (id, problem) = *decode(&long).expect_err("too long");
        assert!(id == 8 && problem.cause.contains("bytes"));
    }

    #[test]
    fn the_longest_scenario_that_can_be_read_is_saved_over_another_one() {
        let text = "seed = 1\n\"a\" = 2\n".repeat((16 << 20) / 19);
        let call = serde_json::json!({ "do": "save", "text": text, "to": null, "base": text, "overwrite": true });
        let request = serde_json::json!({ "id": 7, "session": 1, "call": call }).to_string();
        assert!(decode(&request).is_ok());
    }

    proptest! {
        #[test]
        fn no_text_is_a_panic(text in "[{}\\[\\]\",:a-z0-9.-]{0,200}") {
            let _ = decode(&text);
        }
    }
}
