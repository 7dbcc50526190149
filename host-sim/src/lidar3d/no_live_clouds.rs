//! Stands for clouds of a running ROS where these were left out.

use std::sync::atomic::AtomicBool;

use agv_lidar3d::calibration::Laser;

use super::revolution::Revolution;
use crate::left_out::{BAGS, POINT_CLOUDS};

/// There is none.
pub enum LiveClouds {}

impl LiveClouds {
    /// Says that they were.
    ///
    /// # Errors
    /// Always.
    pub fn subscribe(address: &str, _: Option<&str>, _: &AtomicBool) -> Result<Self, String> {
        let what = BAGS.check().and(POINT_CLOUDS.check());
        Err(format!("ws://{address}: {}", what.err().map_or(String::new(), |error| error.to_string())))
    }

    /// Never called.
    ///
    /// # Errors
    /// None.
    pub fn receive(&mut self) -> Result<Option<(Revolution, Vec<Laser>)>, String> {
        match *self {}
    }

    /// Never called.
    #[must_use]
    pub fn name(&self) -> &str {
        match *self {}
    }
}
