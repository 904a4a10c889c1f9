//! Reading of requests: every message of a page gets an answer.

use crate::protocol::{ClientRequest, Method, Problem, SessionId};
use serde::Deserialize;

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
    serde_json::from_str(text).map_err(|error| {
        let id = request_number(text);
        let cause = format!("it cannot be read: {error}");
        Box::new((id, Problem::new("request", cause, "send JSON as the protocol has it")))
    })
}

/// Returns the number of a request that is not read as a whole, 0 if it has none.
fn request_number(text: &str) -> u32 {
    serde_json::from_str(text).map_or(0, |RequestNumber { id }| id)
}

impl Method {
    /// Returns the session asked, if it is a question to one.
    pub(crate) fn session(&self) -> Option<SessionId> {
        match *self {
            Self::Files { .. } | Self::Open { .. } | Self::Runs { .. } | Self::Schema { .. } => {
                None
            }
            Self::Close { session }
            | Self::Play { session, .. }
            | Self::Pause { session }
            | Self::Step { session, .. }
            | Self::Seek { session, .. }
            | Self::Restart { session, .. }
            | Self::SelectScans { session, .. }
            | Self::Credit { session, .. }
            | Self::Inspect { session, .. }
            | Self::Metrics { session, .. }
            | Self::Events { session, .. }
            | Self::Source { session }
            | Self::Tables { session }
            | Self::Check { session, .. }
            | Self::Edit { session, .. }
            | Self::Model { session, .. }
            | Self::Save { session, .. } => Some(session),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{OpenTarget, Speed};
    use proptest::prelude::*;

    #[test]
    fn requests_are_read_as_the_protocol_has_them() {
        for (text, call) in [
            (r#"{"do":"files"}"#, Method::Files { folder: None }),
            (
                r#"{"do":"open","target":{"kind":"new","world":"robots"},"seed":null}"#,
                Method::Open { target: OpenTarget::New { world: "robots".into() }, seed: None },
            ),
            (
                r#"{"do":"play","session":3,"speed":{"times":2.5}}"#,
                Method::Play { session: 3, speed: Speed::Times(2.5) },
            ),
            (
                r#"{"do":"play","session":3,"speed":"fastest"}"#,
                Method::Play { session: 3, speed: Speed::Fastest },
            ),
        ] {
            let request = decode(&format!(r#"{{"id":7,"call":{text}}}"#)).expect(text);
            assert_eq!(request, ClientRequest { id: 7, call });
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
            (r#"{"id":6,"call":{"do":"pause","session":1,"more":1}}"#, 6),
            (r#"{"id":7,"call":{"do":"seek","session":1,"cycle":-3}}"#, 7),
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
        let call = serde_json::json!({ "do": "save", "session": 1, "text": text, "to": null, "base": text, "overwrite": true });
        let request = serde_json::json!({ "id": 7, "call": call }).to_string();
        assert_eq!(decode(&request).map(|request| request.id), Ok(7));
    }

    proptest! {
        #[test]
        fn no_text_is_a_panic(text in "[{}\\[\\]\",:a-z0-9.-]{0,200}") {
            let _ = decode(&text);
        }
    }
}
