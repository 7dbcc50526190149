//! Files that are exchanged with the programs of others.

mod evo;
mod hall;
mod layouts;
mod ros;
mod views;
