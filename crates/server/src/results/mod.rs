//! Results of recorded runs and sweeps: their reports, their exports, and the runs of a sweep.
//!
//! They are fetched by plain addresses, so that a browser shows a report in a frame and keeps an export as a file:
//! ```text
//! /report?path=DIR                       the page of `sidestep report`
//! /report?path=DIR&as=html|markdown|NN-figure   the same as a file, its text, or one of its figures
//! /export?path=DIR&as=csv&table=NAME     the output of `sidestep export`; of pictures, with &cycle=N
//! ```
//! Requests must come from our own page, and each path must be below the folders given at start. One result
//! is made at a time, in a thread of its own; it is cancelled when its browser disconnects.

mod export;
mod job_queue;
mod query;
mod report;
mod runs;

pub(crate) use export::answer as export;
pub(crate) use job_queue::JobQueue;
pub(crate) use query::QueryFields;
pub(crate) use report::answer as report;
pub(crate) use runs::list_sweep_runs;

use crate::protocol::Problem;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};

/// The reason why there is no result: the status for the browser, and the problem that the page shows.
pub(crate) struct HttpError(StatusCode, Problem);

impl HttpError {
    fn new(status: StatusCode, problem: Problem) -> Self {
        Self(status, problem)
    }
}

impl From<Problem> for HttpError {
    fn from(problem: Problem) -> Self {
        Self(StatusCode::UNPROCESSABLE_ENTITY, problem)
    }
}

impl IntoResponse for HttpError {
    fn into_response(self) -> Response {
        let Self(status, Problem { place, cause, remedy, .. }) = self;
        (status, format!("{place}: {cause}\nhelp: {remedy}\n")).into_response()
    }
}
