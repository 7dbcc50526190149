//! What a place looks like from where the sensor stood: the least range in each direction.

use super::Floor;
use crate::cloud::Cloud;

/// Rows and columns of a panorama.
pub const ROWS: usize = 32;
pub const COLUMNS: usize = 240;
/// Length of a count of range, m.
const COUNT: f32 = 0.005;
const TAU: f32 = core::f32::consts::TAU;

/// Elevations between which a sensor looks, rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// The lowest.
    pub least: f32,
    /// The highest.
    pub most: f32,
}

impl Span {
    /// Of an HDL-64E.
    pub const HDL64E: Self = Self { least: -0.445, most: 0.0436 };
    /// Of a VLP-16.
    pub const VLP16: Self = Self { least: -0.28, most: 0.28 };
}

/// The least range in each direction from the sensor, levelled; none where nothing was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    counts: [[u16; COLUMNS]; ROWS],
    span: Span,
    /// Of the sensor above the floor, m.
    height: f32,
}

impl Panorama {
    /// Bytes of the counts when they are stored.
    pub const BYTES: usize = 2 * ROWS * COLUMNS;

    /// The panorama of a scan above its floor.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, floor: &Floor, span: Span) -> Self {
        let mut panorama = Self { counts: [[0; COLUMNS]; ROWS], span, height: floor.height };
        for point in cloud.seen() {
            let point = floor.levelled(point);
            let Some((row, column, range)) = panorama.direction(point) else { continue };
            let count = (range / COUNT + 0.5) as u16;
            if let Some(place) = panorama.counts.get_mut(row).and_then(|row| row.get_mut(column))
                && (*place == 0 || count < *place)
            {
                *place = count;
            }
        }
        panorama
    }

    /// Row, column and range at which a point is seen that lies at a height above the floor; None if it is not between the
    /// elevations.
    #[must_use]
    pub fn direction(&self, [x, y, up]: [f32; 3]) -> Option<(usize, usize, f32)> {
        let level = libm::sqrtf(x * x + y * y);
        let z = up - self.height;
        let share = (self.span.most - libm::atan2f(z, level)) / (self.span.most - self.span.least);
        if !(0.0..1.0).contains(&share) {
            return None;
        }
        let turn = libm::atan2f(y, x) / TAU;
        let turn = if turn < 0.0 { turn + 1.0 } else { turn };
        let column = ((turn * COLUMNS as f32) as usize).min(COLUMNS - 1);
        Some(((share * ROWS as f32) as usize, column, libm::sqrtf(level * level + z * z)))
    }

    /// Range in a direction, m; columns go on round.
    #[must_use]
    pub fn range(&self, row: usize, column: usize) -> Option<f32> {
        let count = *self.counts.get(row)?.get(column % COLUMNS)?;
        (count > 0).then(|| f32::from(count) * COUNT)
    }

    /// Its points, with their heights above the floor, m: each in the middle of its direction.
    pub fn points(&self) -> impl Iterator<Item = [f32; 3]> + use<'_> {
        (0..ROWS).flat_map(move |row| {
            let share = (row as f32 + 0.5) / ROWS as f32;
            let (sin, cos) = libm::sincosf(self.span.most - share * (self.span.most - self.span.least));
            (0..COLUMNS).filter_map(move |column| {
                let range = self.range(row, column)?;
                let (y, x) = libm::sincosf((column as f32 + 0.5) / COLUMNS as f32 * TAU);
                Some([range * cos * x, range * cos * y, range * sin + self.height])
            })
        })
    }
}
