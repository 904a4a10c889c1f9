//! Nothing: this crate exists for the features that its manifest gives to packages of others.
