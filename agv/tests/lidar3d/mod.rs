//! Multi-beam lidars, on recordings of real ones and in simulation.

mod bridge;
mod calibration;
mod command;
mod manual;
mod range_images;
mod refinement;
