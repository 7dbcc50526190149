//! Files that are exchanged with the programs of others.

#[path = "../support/mod.rs"]
mod support;

mod evo;
mod layouts;
mod python;
mod ros;
mod views;
