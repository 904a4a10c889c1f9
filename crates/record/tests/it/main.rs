//! What the crate promises about files, tested through its public face.

mod damage;
mod folder;
mod mcap;
mod readers;
mod support;
mod tables;
