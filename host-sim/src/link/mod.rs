//! Connections to sensors and controllers.

pub mod clock;
pub mod encoder_listener;
pub mod encoders;
pub mod nav350;
pub mod nav350_listener;
pub mod service;
