//! A scan as places are recognised by: its image from above, its panorama, and its points above the floor.

use agv_lidar3d::cloud::Cloud;
use agv_lidar3d::place::{Floor, Panorama, PlaceImage, Span};

/// What is stored of a place to recognise it.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// From above.
    pub image: PlaceImage,
    /// From where the sensor stood.
    pub panorama: Panorama,
}

/// Where the floor is under the sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Standing {
    /// So high above a level floor, m.
    Given(f32),
    /// It is found in each scan; so high where it cannot be found, m.
    Found(f32),
}

impl Standing {
    /// The floor of a scan.
    #[must_use]
    pub fn floor(self, cloud: &Cloud<'_>) -> Floor {
        match self {
            Self::Given(height) => Floor::level(height),
            Self::Found(height) => Floor::find(cloud).map_or(Floor::level(height), Floor::without_small_slope),
        }
    }

    /// Height above the floor, m, where it is not found.
    #[must_use]
    pub const fn height(self) -> f32 {
        match self {
            Self::Given(height) | Self::Found(height) => height,
        }
    }
}

impl View {
    /// Of a scan above its floor, by a sensor that looks between these elevations.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, floor: &Floor, span: Span) -> Self {
        Self { image: PlaceImage::new(cloud, floor), panorama: Panorama::new(cloud, floor, span) }
    }
}
