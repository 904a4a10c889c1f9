//! Tests of the guarantees of the crate about files, through its public interface.

mod damage;
mod folder;
mod mcap;
mod readers;
mod support;
mod tables;
