//! All scenarios of the repository, and what is told of them: schemas and problems.

mod problems;
mod schema;
mod shipped;
mod valid;
