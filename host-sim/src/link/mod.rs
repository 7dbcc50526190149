//! Connections to sensors and controllers.

pub mod clock;
pub mod encoder_listener;
pub mod nav350;
pub mod nav350_listener;
pub mod service;

/// `host` with that port if it states none.
#[must_use]
pub fn with_port(host: &str, port: u16) -> String {
    if host.contains(':') { host.to_owned() } else { format!("{host}:{port}") }
}
