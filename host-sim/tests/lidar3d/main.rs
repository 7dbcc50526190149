//! Multi-beam lidars, on recordings of real ones and in simulation.

mod calibration;
mod manual;
mod range_images;
mod velodyne_decoder;
