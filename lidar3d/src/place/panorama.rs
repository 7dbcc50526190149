//! What a place looks like from where the sensor stood: the least range in each direction.

use super::Floor;
use super::arctangent::{arctangent, sector_of};
use super::levelled::{Block, both};
use crate::cloud::Cloud;

/// Directions of a panorama.
const DIRECTIONS: usize = 7680;
/// A sensor of so few rings has half of the rows, and twice the columns.
const FEW_RINGS: usize = 16;
/// Columns of a panorama: of few rings, and of more.
pub const COLUMNS: usize = 480;
const FEW_COLUMNS: usize = 240;
/// Length of a count of range, m, and the greatest count: what is farther is seen there.
const COUNT: f32 = 0.02;
const MOST: f32 = 4095.0;
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
    /// Of lasers at these elevations, rad: half of the mean step farther than the outermost. None without two of them.
    #[must_use]
    pub fn of_elevations(elevations: impl Iterator<Item = f32>) -> Option<Self> {
        let (mut least, mut most, mut count) = (f32::MAX, f32::MIN, 0_u16);
        for elevation in elevations.filter(|elevation| elevation.is_finite()) {
            least = least.min(elevation);
            most = most.max(elevation);
            count += 1;
        }
        if count < 2 || least >= most {
            return None;
        }
        let half = 0.5 * (most - least) / f32::from(count - 1);
        Some(Self { least: least - half, most: most + half })
    }

    /// Of an HDL-64E.
    pub const HDL64E: Self = Self { least: -0.445, most: 0.0436 };
    /// Of a VLP-16.
    pub const VLP16: Self = Self { least: -0.28, most: 0.28 };
}

/// The least range in each direction from the sensor, levelled; none where nothing was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct Panorama {
    /// Row after row.
    counts: [u16; DIRECTIONS],
    columns: usize,
    span: Span,
    /// Of the sensor above the floor, m.
    height: f32,
}

impl Panorama {
    /// Bytes of the counts when they are stored: twelve bits each.
    pub const BYTES: usize = 3 * DIRECTIONS / 2;

    /// The panorama of a scan above its floor.
    #[must_use]
    pub fn new(cloud: &Cloud<'_>, floor: &Floor, span: Span) -> Self {
        let columns = Self::columns_of(cloud.rings());
        let mut panorama = Self { counts: [0; DIRECTIONS], columns, span, height: floor.height };
        for block in Block::all(cloud, floor) {
            let levels = block.levels();
            let above = block.up.map(|up| up - floor.height);
            let shares = both(&above, &levels, |z, level| panorama.share(z, level));
            let counts = both(&above, &levels, |z, level| (range(z, level) / COUNT + 0.5).min(MOST));
            for ((turn, share), count) in block.turns().iter().zip(shares).zip(counts).take(block.count) {
                let Some(row) = panorama.row_of(share) else { continue };
                let count = count as u16;
                if let Some(place) = panorama.counts.get_mut(row * columns + sector_of(*turn, columns))
                    && (*place == 0 || count < *place)
                {
                    *place = count;
                }
            }
        }
        panorama
    }

    /// As it is stored: two counts in three bytes, row after row.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; Self::BYTES] {
        let mut bytes = [0; Self::BYTES];
        let pairs = self.counts.as_chunks::<2>().0;
        for (bytes, [one, other]) in bytes.as_chunks_mut::<3>().0.iter_mut().zip(pairs) {
            let [low, high] = one.to_le_bytes();
            let [other_low, other_high] = (other << 4).to_le_bytes();
            *bytes = [low, high | other_low, other_high];
        }
        bytes
    }

    /// What [`Self::to_bytes`] has made, of a sensor with so many rings and that span, so high above the floor, m.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; Self::BYTES], rings: usize, span: Span, height: f32) -> Self {
        let mut counts = [0; DIRECTIONS];
        let pairs = counts.as_chunks_mut::<2>().0;
        for (pair, [low, middle, high]) in pairs.iter_mut().zip(bytes.as_chunks::<3>().0) {
            *pair = [u16::from_le_bytes([*low, middle & 0xf]), u16::from_le_bytes([*middle, *high]) >> 4];
        }
        Self { counts, columns: Self::columns_of(rings), span, height }
    }

    const fn columns_of(rings: usize) -> usize {
        if rings <= FEW_RINGS { COLUMNS } else { FEW_COLUMNS }
    }

    const fn rows(&self) -> usize {
        DIRECTIONS / self.columns
    }

    /// Number of columns.
    #[cfg(feature = "std")]
    pub(super) const fn columns(&self) -> usize {
        self.columns
    }

    /// Between which elevations it looks.
    #[must_use]
    pub const fn span(&self) -> Span {
        self.span
    }

    /// Height of the sensor above the floor, m.
    #[must_use]
    pub const fn height(&self) -> f32 {
        self.height
    }

    /// Column of a point, and how far it lies away on the level, m.
    #[cfg(feature = "std")]
    pub(super) fn column(&self, [x, y, _]: [f32; 3]) -> (usize, f32) {
        (super::arctangent::sector(y, x, self.columns), libm::sqrtf(x * x + y * y))
    }

    /// Row and range, m, of a point that lies so far away on the level, with its height above the floor; None if it is not
    /// between the elevations.
    #[cfg(feature = "std")]
    pub(super) fn row(&self, [_, _, up]: [f32; 3], level: f32) -> Option<(usize, f32)> {
        let z = up - self.height;
        Some((self.row_of(self.share(z, level))?, range(z, level)))
    }

    /// How far below the highest elevation a point lies that is so far away on the level and so much above the sensor, m, as a part
    /// of the span.
    #[inline(always)]
    fn share(&self, z: f32, level: f32) -> f32 {
        (self.span.most - arctangent(z, level)) / (self.span.most - self.span.least)
    }

    /// Row of such a part; None if it is not between the elevations.
    #[inline(always)]
    fn row_of(&self, share: f32) -> Option<usize> {
        (0.0..1.0).contains(&share).then(|| (share * self.rows() as f32) as usize)
    }

    /// The point in the middle of a column, so far away on the level, m; columns go on round.
    #[cfg(feature = "std")]
    pub(super) fn on_level(&self, column: usize, level: f32) -> [f32; 2] {
        let (sin, cos) = libm::sincosf((column as f32 + 0.5) / self.columns as f32 * TAU);
        [level * cos, level * sin]
    }

    /// In which of 480 directions something is seen, in two rows at least of the column or those beside it.
    #[cfg(feature = "std")]
    pub(super) fn known_directions(&self) -> [bool; COLUMNS] {
        let wide = COLUMNS / self.columns;
        core::array::from_fn(|direction| {
            let column = direction / wide + self.columns;
            let seen = |row: &usize| (column - 1..=column + 1).any(|column| self.range(*row, column).is_some());
            (0..self.rows()).filter(seen).nth(1).is_some()
        })
    }

    /// Range in a direction, m; columns go on round.
    #[must_use]
    pub fn range(&self, row: usize, column: usize) -> Option<f32> {
        let count = *self.counts.get(row * self.columns + column % self.columns)?;
        (count > 0).then(|| f32::from(count) * COUNT)
    }

    /// Its points, with their heights above the floor, m: each in the middle of its direction.
    pub fn points(&self) -> impl Iterator<Item = [f32; 3]> + use<'_> {
        let direction = |column: usize| libm::sincosf((column as f32 + 0.5) / self.columns as f32 * TAU);
        let directions: [(f32, f32); COLUMNS] = core::array::from_fn(direction);
        (0..self.rows()).flat_map(move |row| {
            let share = (row as f32 + 0.5) / self.rows() as f32;
            let (sin, cos) = libm::sincosf(self.span.most - share * (self.span.most - self.span.least));
            directions.into_iter().take(self.columns).enumerate().filter_map(move |(column, (y, x))| {
                let range = self.range(row, column)?;
                Some([range * cos * x, range * cos * y, range * sin + self.height])
            })
        })
    }
}

/// Range of a point that lies so far away on the level and so much above the sensor, m.
#[inline(always)]
fn range(z: f32, level: f32) -> f32 {
    libm::sqrtf(level * level + z * z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_has_the_least_range_of_the_points_in_each_direction() {
        // Not whole blocks, with gaps, and some beside the span and at the seam.
        let ring = |number: usize| {
            let (turn, lift) = (number as f32 * 0.37, ((number + 15) % 29) as f32 * 0.03 - 0.5);
            let range = 2.0 + (number * 7 % 45) as f32;
            (number % 11 != 3).then(|| [range * libm::cosf(turn), range * libm::sinf(turn), range * lift])
        };
        let points: [_; 1001] = core::array::from_fn(ring);
        for count in [1, 15, 16, 17, 1001] {
            let (cloud, floor) =
                (Cloud::new(&points[..count], 1).unwrap(), Floor { height: 1.7, slope: [0.03, -0.05] });
            let panorama = Panorama::new(&cloud, &floor, Span::VLP16);
            let mut counts = [0; DIRECTIONS];
            for point in cloud.seen().map(|point| floor.levelled(point)) {
                let (column, level) = panorama.column(point);
                let Some((row, range)) = panorama.row(point, level) else { continue };
                let (count, place) = ((range / COUNT + 0.5).min(MOST) as u16, &mut counts[row * COLUMNS + column]);
                *place = if *place == 0 { count } else { count.min(*place) };
            }
            assert!(counts.iter().any(|count| *count > 0));
            assert!(panorama.counts == counts, "{count} points");
        }
    }

    #[test]
    fn a_stored_panorama_is_the_same() {
        let counts = core::array::from_fn(|number| (number as u16).wrapping_mul(2741) % 4096);
        for (rings, columns) in [(16, 480), (64, 240)] {
            let panorama = Panorama { counts, columns, span: Span::VLP16, height: 1.9 };
            assert_eq!(Panorama::from_bytes(&panorama.to_bytes(), rings, Span::VLP16, 1.9), panorama);
        }
        assert!(counts.contains(&4095) && counts.contains(&0));
    }
}
