//! Tests of the real program from outside: its output, its files and its exit codes.

mod airspace;
mod book;
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
mod turned_maps;
