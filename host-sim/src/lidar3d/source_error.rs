//! Why a source has no points.

use std::io;

use super::capture::CaptureError;
use super::setup_options::SetupError;
use crate::import::range_image::RangeImageError;

/// Why there are no points.
#[derive(Debug, thiserror::Error)]
pub enum SourceError {
    /// The capture.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The range images.
    #[error(transparent)]
    Images(#[from] RangeImageError),
    /// The sensor or its calibration.
    #[error(transparent)]
    Setup(#[from] SetupError),
    /// A point cloud.
    #[error("{0}")]
    Cloud(String),
    /// The network.
    #[error("UDP port {port}: {problem}")]
    Network {
        /// The port.
        port: u16,
        /// What the operating system says.
        problem: io::Error,
    },
    /// Nothing was received.
    #[error("nothing was received on UDP port {port}")]
    Silent {
        /// The port.
        port: u16,
    },
    /// No return of any packet is a point.
    #[error("{name}: nothing was seen: {detail}")]
    Blind {
        /// The source.
        name: String,
        /// What became of the returns.
        detail: String,
    },
}
