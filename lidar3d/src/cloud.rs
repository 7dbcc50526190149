//! Organised clouds: a ring a row, a column a direction.

/// A cloud of `RINGS` rings, ordered from the highest beam to the lowest, borrowed column by column.
#[derive(Clone, Copy, Debug)]
pub struct Cloud<'a> {
    points: &'a [Option<[f32; 3]>],
    rings: usize,
}

impl<'a> Cloud<'a> {
    /// Ring after ring, each with the same number of columns that go once round; None where nothing was seen, else
    /// x, y, z, m. None if the number of points is no multiple of `rings`.
    #[must_use]
    pub fn new(points: &'a [Option<[f32; 3]>], rings: usize) -> Option<Self> {
        (rings > 0 && points.len().is_multiple_of(rings)).then_some(Self { points, rings })
    }

    /// Number of rings.
    #[must_use]
    pub fn rings(&self) -> usize {
        self.rings
    }

    /// Number of columns.
    #[must_use]
    pub fn columns(&self) -> usize {
        self.points.len() / self.rings
    }

    /// The columns of a ring.
    #[must_use]
    pub fn ring(&self, ring: usize) -> &'a [Option<[f32; 3]>] {
        let columns = self.columns();
        self.points.get(ring * columns..(ring + 1) * columns).unwrap_or(&[])
    }

    /// All points that were seen.
    pub fn seen(&self) -> impl Iterator<Item = [f32; 3]> + use<'a> {
        self.points.iter().copied().flatten()
    }
}
