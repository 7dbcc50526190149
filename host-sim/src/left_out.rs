//! What this program can do only if it was built with a feature of its package.

/// A part that may have been left out when the program was built.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("this program was built without {what}: build it with --features {feature}, or --features full for everything")]
pub struct LeftOut {
    what: &'static str,
    feature: &'static str,
    is_left_out: bool,
}

impl LeftOut {
    /// What is there only with a feature of the command's package.
    #[must_use]
    pub const fn unless(is_built: bool, what: &'static str, feature: &'static str) -> Self {
        Self { what, feature, is_left_out: !is_built }
    }

    /// The feature that builds it.
    #[must_use]
    pub const fn feature(&self) -> &'static str {
        self.feature
    }

    /// Asks for the part, before work is begun that ends with it.
    ///
    /// # Errors
    /// If it was left out.
    pub const fn check(self) -> Result<(), Self> {
        if self.is_left_out { Err(self) } else { Ok(()) }
    }
}

/// Recordings of ROS 2.
pub const BAGS: LeftOut = LeftOut::unless(cfg!(feature = "bags"), "recordings of ROS 2 (MCAP, rosbag2)", "bags");

/// Layouts as drawings.
pub const DRAWINGS: LeftOut = LeftOut::unless(cfg!(feature = "drawings"), "drawings (.dxf)", "drawings");

/// Point clouds for other programs.
pub const POINT_CLOUDS: LeftOut =
    LeftOut::unless(cfg!(feature = "point-clouds"), "point clouds (.pcd, .ply, .las)", "point-clouds");

/// Mapping without known poses.
pub const POSE_GRAPHS: LeftOut =
    LeftOut::unless(cfg!(feature = "pose-graphs"), "mapping from unknown poses", "pose-graphs");
