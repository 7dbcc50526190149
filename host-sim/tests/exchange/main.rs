//! Files that are exchanged with the programs of others.

#[path = "../support/mod.rs"]
mod support;

mod evo;
mod hall;
mod layouts;
mod ros;
mod views;
