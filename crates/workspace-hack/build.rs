//! Nothing: with a build script, cargo considers the dependencies of build scripts, too.

fn main() {}
