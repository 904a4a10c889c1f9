//! The real binary, from outside: what it prints, writes and ends with.

mod airspace;
mod browser;
mod chain;
mod chain_input;
mod commands;
mod contract;
mod determinism;
mod disk;
mod exact;
mod export;
mod fk;
mod help;
mod ik;
mod input;
mod learn;
mod pictures;
mod readers;
mod report;
mod reproduce;
mod slurm;
mod stops;
mod support;
mod sweep;
mod sweep_faults;
