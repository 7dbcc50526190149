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
    /// Asks for the part, before work is begun that ends with it.
    ///
    /// # Errors
    /// If it was left out.
    pub const fn check(self) -> Result<(), Self> {
        if self.is_left_out { Err(self) } else { Ok(()) }
    }
}

/// Recordings of ROS 2.
pub const BAGS: LeftOut =
    LeftOut { what: "recordings of ROS 2 (MCAP, rosbag2)", feature: "bags", is_left_out: !cfg!(feature = "bags") };

/// Layouts as drawings.
pub const DRAWINGS: LeftOut =
    LeftOut { what: "drawings (.dxf)", feature: "drawings", is_left_out: !cfg!(feature = "drawings") };

/// Point clouds for other programs.
pub const POINT_CLOUDS: LeftOut = LeftOut {
    what: "point clouds (.pcd, .ply, .las)",
    feature: "point-clouds",
    is_left_out: !cfg!(feature = "point-clouds"),
};

/// Mapping without known poses.
pub const POSE_GRAPHS: LeftOut =
    LeftOut { what: "mapping from unknown poses", feature: "pose-graphs", is_left_out: !cfg!(feature = "pose-graphs") };

/// Results of campaigns as Parquet.
pub const TABLES: LeftOut =
    LeftOut { what: "tables (.parquet)", feature: "tables", is_left_out: !cfg!(feature = "tables") };

#[cfg(test)]
mod tests {
    use super::{BAGS, DRAWINGS, POINT_CLOUDS, POSE_GRAPHS, TABLES};

    #[test]
    fn what_is_left_out_names_a_feature_of_the_package() {
        let manifest: toml::Table = include_str!("../Cargo.toml").parse().unwrap();
        let features = manifest["features"].as_table().unwrap();
        let full = features["full"].as_array().unwrap();
        for part in [BAGS, DRAWINGS, POINT_CLOUDS, POSE_GRAPHS, TABLES] {
            assert!(features.contains_key(part.feature), "{part}");
            assert!(full.iter().any(|feature| feature.as_str() == Some(part.feature)), "{part}");
        }
        assert_eq!(full.len(), 5);
    }
}
