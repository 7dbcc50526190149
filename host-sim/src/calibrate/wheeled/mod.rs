//! One joint fit for vehicles of any wheels, from any source of poses, with the clocks of both sides.

pub mod clock;
pub mod drive;
pub mod fit;
pub mod fitted_vehicle;
pub mod log_drive;
pub mod mistakes;
pub mod path;
pub mod trajectory_error;
pub mod unknowns;
mod windows;
