//! Promise: learning from the public logs gives the same results as independent programs, within
//! their stated tolerances: counts to 2, events to 1, probabilities to 0.002, moments to 0.001.

mod effector;
mod sensor;

use serde_json::Value;
use sidestep_testing::shared_data as shared;

/// The results of the independent program.
fn expected(name: &str) -> Value {
    let path = shared("expected").expect("the data are here").join(name);
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// Asserts that two JSON numbers, arrays or objects agree; `found` may have further keys.
fn assert_close(found: &Value, expected: &Value, tolerance: f64, what: &str) {
    match expected {
        Value::Object(entries) => {
            for (key, value) in entries {
                assert_close(&found[key.as_str()], value, tolerance, &format!("{what}.{key}"));
            }
        }
        Value::Array(items) => {
            assert_eq!(found.as_array().map(Vec::len), Some(items.len()), "{what}");
            for (i, value) in items.iter().enumerate() {
                assert_close(&found[i], value, tolerance, &format!("{what}[{i}]"));
            }
        }
        Value::Number(number) => {
            let (found, number) = (found.as_f64(), number.as_f64().unwrap());
            let close = found.is_some_and(|found| (found - number).abs() <= tolerance);
            assert!(close, "{what}: {found:?} instead of {number}");
        }
        other => assert_eq!(found, other, "{what}"),
    }
}

/// Moments agree within 0.001, their number of values within `n`.
fn assert_moments(found: &Value, expected: &Value, n: f64, what: &str) {
    assert_close(&found["n"], &expected["n"], n, what);
    let mut rest = expected.clone();
    rest.as_object_mut().unwrap().remove("n");
    assert_close(found, &rest, 0.001, what);
}
