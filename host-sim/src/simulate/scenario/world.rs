//! What stands where.

use agv_core::geometry::{Point, Pose};
use serde::{Deserialize, Serialize};

use crate::simulate::block_storage::BlockStorage;
use crate::simulate::shape::{Circle, Rectangle, Reflector, Sector};
use crate::simulate::warehouse_hall::WarehouseHall;
use crate::simulate::world::World;

/// What stands where.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum WorldOptions {
    /// The standard block storage.
    BlockStorage(BlockStorage),
    /// A hall with racks.
    WarehouseHall(WarehouseHall),
    /// Shapes one by one.
    Shapes(Shapes),
}

impl Default for WorldOptions {
    fn default() -> Self {
        Self::BlockStorage(BlockStorage::default())
    }
}

/// A world of given shapes, in W.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Shapes {
    /// Walls: x and y of one end, x and y of the other, m.
    pub walls: Vec<[f64; 4]>,
    /// Boxes.
    pub rectangles: Vec<RectangleOptions>,
    /// Round columns.
    pub circles: Vec<CircleOptions>,
    /// Reflectors.
    pub reflectors: Vec<ReflectorShape>,
}

/// A box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectangleOptions {
    /// Centre in W, m.
    pub x: f64,
    /// Centre in W, m.
    pub y: f64,
    /// Direction of the length in W.
    #[serde(default)]
    pub heading_deg: f64,
    /// Length, m.
    pub length: f64,
    /// Width, m.
    pub width: f64,
}

/// A round column.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CircleOptions {
    /// Centre in W, m.
    pub x: f64,
    /// Centre in W, m.
    pub y: f64,
    /// Radius, m.
    pub radius: f64,
}

/// A reflector.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReflectorShape {
    /// Axis in W, m.
    pub x: f64,
    /// Axis in W, m.
    pub y: f64,
    /// Radius, m.
    #[serde(default = "ReflectorShape::standard_radius")]
    pub radius: f64,
    /// Detected up to this distance, m.
    #[serde(default = "ReflectorShape::standard_farthest")]
    pub farthest: f64,
    /// Middle of the directions from which it is seen; all directions if absent.
    pub facing_deg: Option<f64>,
    /// Half of the width of these directions.
    #[serde(default = "ReflectorShape::standard_half_width")]
    pub half_width_deg: f64,
}

impl ReflectorShape {
    /// One of the usual size that is seen from all directions.
    #[must_use]
    pub fn seen_all_round(x: f64, y: f64) -> Self {
        let (radius, farthest) = (Self::standard_radius(), Self::standard_farthest());
        Self { x, y, radius, farthest, facing_deg: None, half_width_deg: Self::standard_half_width() }
    }

    fn standard_radius() -> f64 {
        0.04
    }
    fn standard_farthest() -> f64 {
        30.0
    }
    fn standard_half_width() -> f64 {
        60.0
    }
}

impl Shapes {
    /// The four walls of a rectangular hall: its low and its high corner in W, m.
    #[must_use]
    pub fn hall([left, low]: [f64; 2], [right, high]: [f64; 2]) -> Vec<[f64; 4]> {
        vec![[left, low, right, low], [right, low, right, high], [right, high, left, high], [left, high, left, low]]
    }

    /// The world of these shapes.
    #[must_use]
    pub fn world(&self) -> World {
        let mut world = World::default();
        for &[x, y, other_x, other_y] in &self.walls {
            world.add_wall(Point::new(x, y), Point::new(other_x, other_y));
        }
        for shape in &self.rectangles {
            let pose = Pose::new(shape.x, shape.y, shape.heading_deg.to_radians());
            world.add_rectangle(&Rectangle { pose, length: shape.length, width: shape.width });
        }
        for shape in &self.circles {
            world.circles.push(Circle { centre: Point::new(shape.x, shape.y), radius: shape.radius });
        }
        for shape in &self.reflectors {
            world.reflectors.push(Reflector {
                body: Circle { centre: Point::new(shape.x, shape.y), radius: shape.radius },
                farthest: shape.farthest,
                sector: shape.facing_deg.map(|middle| Sector {
                    middle: middle.to_radians(),
                    half_width: shape.half_width_deg.to_radians(),
                }),
            });
        }
        world
    }
}
