//! Why there is no drive.

use agv_core::state::Mode;

use crate::emulate::board::BoardError;
use crate::emulate::motion::MotionError;
use crate::log::LogError;
use crate::provision::ProvisionError;
use crate::serve::nav350::DriveError;

/// Why there is no drive.
#[derive(Debug, thiserror::Error)]
pub enum VehicleError {
    /// The board does not run.
    #[error(transparent)]
    Board(#[from] BoardError),
    /// The recording has nothing for the laser to see.
    #[error(transparent)]
    Drive(#[from] DriveError),
    /// The recording has nothing that tells how the vehicle moves.
    #[error(transparent)]
    Motion(#[from] MotionError),
    /// The settings do not fit.
    #[error(transparent)]
    Provision(#[from] ProvisionError),
    /// A file or a socket fails.
    #[error(transparent)]
    Io(#[from] std::io::Error),
    /// The log stream fails.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The emulated chip runs no more.
    #[error("the emulated chip has stopped: {0}")]
    Chip(String),
    /// The controller does not localise though it was told where it is.
    #[error("the controller does not localise: {0:?}")]
    NotLocalised(Option<Mode>),
}
