//! Whether one revolution makes it doubtful that the laser moves as the odometry says.
//!
//! A verdict takes two revolutions (see [`super::SlipCheck`]), and where a hall looks alike it may take more: until then the pose may be
//! wrong by whatever. So the bound is wider from the first revolution on that has lost sight of the landmarks before it, if surfaces are
//! elsewhere as well, or if what is seen instead is none of the map.

use serde::{Deserialize, Serialize};

/// Landmarks of the map that end it, in a revolution that has not lost sight of those before it.
const ENDING: usize = 2;

/// What was found in the last revolution, and in those before it.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct MotionDoubt {
    has_lost_sight: bool,
    do_all_fit: bool,
    is_raised: bool,
}

impl MotionDoubt {
    /// Takes a revolution: whether it has lost sight of the landmarks before it, how many it has seen, and how many of these the map has where
    /// they are.
    pub fn take_landmarks(&mut self, has_lost_sight: bool, seen: usize, fitting: usize) {
        self.has_lost_sight = has_lost_sight;
        self.do_all_fit = fitting >= ENDING && fitting == seen;
        if !has_lost_sight {
            self.is_raised &= fitting < ENDING;
        } else if seen > 0 && fitting == 0 {
            self.is_raised = true;
        }
    }

    /// Takes the scan of that revolution: whether its surfaces have stayed where they were.
    pub fn take_surfaces(&mut self, have_stayed: bool) {
        self.is_raised |= self.has_lost_sight && !have_stayed;
    }

    /// Whether the map has all landmarks of the last revolution where they are, and there are some.
    #[must_use]
    pub const fn do_all_fit(&self) -> bool {
        self.do_all_fit
    }

    /// Whether the motion is doubtful: until a revolution sees landmarks of the map again.
    #[must_use]
    pub const fn is_raised(&self) -> bool {
        self.is_raised
    }
}
