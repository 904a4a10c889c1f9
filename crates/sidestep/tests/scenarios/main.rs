//! All scenarios of the repository, and the answers about them: schemas and problems.

mod problems;
mod schema;
mod shipped;
mod valid;
