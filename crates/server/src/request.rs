//! Reading of requests: every message of a page gets a reply, which says what is wrong with one that cannot be read.

use crate::protocol::{ClientRequest, Problem, RunMethod, ServerMethod, SessionId, SessionMethod};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

/// Maximum length of a request, in bytes: room for the longest scenario that can be read (16 MiB), and for the one that
/// it replaces, both as JSON.
pub const MAX_REQUEST_BYTES: usize = 40 << 20;

/// A request whose other parts may be malformed: the answer needs its number.
#[derive(Deserialize)]
struct RequestNumber {
    id: u32,
}

/// A request before its call is read: the presence of a session decides which methods there are.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RequestEnvelope {
    id: u32,
    session: Option<SessionId>,
    call: Map<String, Value>,
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
    let envelope: RequestEnvelope = serde_json::from_str(text).map_err(|error| {
        let cause = format!("it cannot be read: {error}");
        let remedy =
            r#"send {"id": 1, "call": {"do": "files"}}, with "session": 2 for a call to session 2"#;
        Box::new((request_number(text), Problem::new("request", cause, remedy)))
    })?;
    let id = envelope.id;
    read_call(envelope).map_err(|problem| Box::new((id, problem)))
}

/// Reads the call of a request to the server or to a session.
fn read_call(
    RequestEnvelope { id, session, call }: RequestEnvelope,
) -> Result<ClientRequest, Problem> {
    let name = method_name(id, &call)?;
    let Some(session) = session else {
        if !ServerMethod::NAMES.contains(&name.as_str()) {
            let remedy = format!(
                "call one of {}; a method of a session needs the session's number as \"session\"",
                ServerMethod::NAMES.join(", ")
            );
            return Err(no_such_method(id, "the server", &name, remedy));
        }
        let call = read_arguments::<ServerMethod>(id, &name, &call)?;
        return Ok(ClientRequest::Server { id, call });
    };
    let call = if SessionMethod::NAMES.contains(&name.as_str()) {
        read_arguments::<SessionMethod>(id, &name, &call)?
    } else if RunMethod::NAMES.contains(&name.as_str()) {
        SessionMethod::Run(read_arguments::<RunMethod>(id, &name, &call)?)
    } else {
        let names = [&SessionMethod::NAMES[..], &RunMethod::NAMES].concat().join(", ");
        return Err(no_such_method(id, "a session", &name, format!("call one of {names}")));
    };
    Ok(ClientRequest::Session { id, session, call })
}

fn method_name(id: u32, call: &Map<String, Value>) -> Result<String, Problem> {
    let name = call.get("do").and_then(Value::as_str);
    name.map(String::from).ok_or_else(|| {
        let cause = "its call has no method";
        let remedy = r#"add the method's name to the call: {"do": "files"}"#;
        Problem::new(format!("request {id}"), cause, remedy)
    })
}

fn no_such_method(id: u32, callee: &str, name: &str, remedy: String) -> Problem {
    Problem::new(format!("request {id}"), format!("{callee} has no method `{name}`"), remedy)
}

/// Reads a call whose method exists.
fn read_arguments<M: DeserializeOwned>(
    id: u32,
    name: &str,
    call: &Map<String, Value>,
) -> Result<M, Problem> {
    M::deserialize(call).map_err(|error| {
        let error = error.to_string();
        let field = find_wrong_field::<M>(call, &error);
        let cause = field.map_or_else(|| error.clone(), |field| format!("`{field}`: {error}"));
        let remedy = format!("give `{name}` the arguments that its type in protocol/types.ts has");
        Problem::new(format!("request {id}, call `{name}`"), cause, remedy)
    })
}

/// Returns the argument that an error is about. Messages of serde describe a wrong value without its field; they change if
/// that field is left out.
fn find_wrong_field<'a, M: DeserializeOwned>(
    call: &'a Map<String, Value>,
    error: &str,
) -> Option<&'a str> {
    if !error.starts_with("invalid") {
        // The message names a missing or unknown field itself.
        return None;
    }
    let fields = call.keys().filter(|field| *field != "do");
    fields.map(String::as_str).find(|field| {
        let mut rest = call.clone();
        rest.remove(*field);
        M::deserialize(&rest).map_or_else(|other| other.to_string() != error, |_| true)
    })
}

/// Returns the number of a request that is not read as a whole, 0 if it has none.
fn request_number(text: &str) -> u32 {
    serde_json::from_str(text).map_or(0, |RequestNumber { id }| id)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::{OpenTarget, Speed};
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
    fn the_problem_of_a_wrong_call_says_which_part_is_wrong_and_what_would_be_right() {
        for (call, place, cause, remedy) in [
            (
                r#"{"do":"explode"}"#,
                "request 7",
                "a session has no method `explode`",
                "close, check",
            ),
            (r#"{"do":"files"}"#, "request 7", "a session has no method `files`", "inspect"),
            (r#"{}"#, "request 7", "its call has no method", "\"do\""),
            (
                r#"{"do":"seek","cycle":-3}"#,
                "request 7, call `seek`",
                "`cycle`: invalid value: integer `-3`, expected u64",
                "types.ts",
            ),
            (
                r#"{"do":"events","from":0,"until":9,"limit":"all"}"#,
                "request 7, call `events`",
                "`limit`: invalid type: string \"all\", expected u32",
                "types.ts",
            ),
            (r#"{"do":"seek"}"#, "request 7, call `seek`", "missing field `cycle`", "types.ts"),
            (
                r#"{"do":"pause","more":1}"#,
                "request 7, call `pause`",
                "unknown field `more`",
                "`pause`",
            ),
            (
                r#"{"do":"check","text":1}"#,
                "request 7, call `check`",
                "`text`: invalid type",
                "`check`",
            ),
        ] {
            let text = format!(r#"{{"id":7,"session":3,"call":{call}}}"#);
            let (id, problem) = *decode(&text).expect_err(call);
            assert_eq!((id, &*problem.place), (7, place), "{call}");
            assert!(problem.cause.contains(cause), "{call}: {}", problem.cause);
            assert!(problem.remedy.contains(remedy), "{call}: {}", problem.remedy);
        }
        let (_, problem) = *decode(r#"{"id":7,"call":{"do":"pause"}}"#).expect_err("no session");
        assert_eq!(&*problem.cause, "the server has no method `pause`");
        assert!(problem.remedy.contains("needs the session's number"), "{}", problem.remedy);
    }

    #[test]
    fn the_listed_names_are_those_of_all_methods() {
        fn names_in_error<M: DeserializeOwned>() -> Vec<String> {
            let call = serde_json::json!({ "do": "" });
            let error = M::deserialize(&call).err().expect("no method").to_string();
            error.split('`').skip(3).step_by(2).map(String::from).collect()
        }
        assert_eq!(names_in_error::<ServerMethod>(), ServerMethod::NAMES);
        assert_eq!(names_in_error::<SessionMethod>(), SessionMethod::NAMES);
        assert_eq!(names_in_error::<RunMethod>(), RunMethod::NAMES);
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
