//! Multi-beam lidars, on recordings of real ones and in simulation.

mod bridge;
mod calibration;
mod command;
mod manual;
mod mount;
mod point_cloud2;
mod range_images;
mod refinement;
mod vlp16;
