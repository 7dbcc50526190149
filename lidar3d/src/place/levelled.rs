//! The points of a scan above its floor, several at once: what is computed alike for each, vector registers do together.

use super::Floor;
use super::arctangent::turn;
use crate::cloud::Cloud;

/// Points of a block.
pub(super) const LANES: usize = 16;

/// A number for each point of a block.
pub(super) type Lanes = [f32; LANES];

/// Some points of a scan, turned so that the floor is level; the last block of a scan has fewer than [`LANES`], and is filled up
/// with zeros.
#[derive(Clone, Debug)]
pub(super) struct Block {
    /// Where they are, m.
    pub x: Lanes,
    pub y: Lanes,
    /// Heights above the floor, m.
    pub up: Lanes,
    /// How many they are.
    pub count: usize,
}

impl Block {
    /// All that were seen in a scan, in order.
    pub(super) fn all<'a>(cloud: &Cloud<'a>, floor: &Floor) -> impl Iterator<Item = Self> + use<'a> {
        let (mut points, floor) = (cloud.seen(), *floor);
        core::iter::from_fn(move || {
            let mut block = Self { x: [0.0; LANES], y: [0.0; LANES], up: [0.0; LANES], count: 0 };
            let places = block.x.iter_mut().zip(&mut block.y).zip(&mut block.up);
            for (((x, y), z), point) in places.zip(&mut points) {
                [*x, *y, *z] = point;
                block.count += 1;
            }
            for ((x, y), up) in block.x.iter_mut().zip(&mut block.y).zip(&mut block.up) {
                [*x, *y, *up] = floor.levelled([*x, *y, *up]);
            }
            (block.count > 0).then_some(block)
        })
    }

    /// How far they lie away on the level, m.
    pub(super) fn levels(&self) -> Lanes {
        both(&self.x, &self.y, |x, y| libm::sqrtf(x * x + y * y))
    }

    /// Which part of a turn their directions are counter-clockwise from straight ahead, 0 to 1.
    pub(super) fn turns(&self) -> Lanes {
        both(&self.y, &self.x, turn)
    }
}

/// A function of two numbers for each point.
#[inline(always)]
pub(super) fn both(one: &Lanes, other: &Lanes, function: impl Fn(f32, f32) -> f32) -> Lanes {
    let mut results = [0.0; LANES];
    for ((result, one), other) in results.iter_mut().zip(one).zip(other) {
        *result = function(*one, *other);
    }
    results
}
