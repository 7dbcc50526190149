//! The simulation against independent truth: geometry, statistics of the stated noise, and determinism.

mod determinism;
mod gyro;
mod laser;
mod odometry;
mod ray_casting;
mod reflectors;
mod scenario;
mod scenario_reference;
mod support;
mod systematic;
mod wheels;
mod world;
