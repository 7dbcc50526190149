//! Choosing some of many, spread over all of them.

/// Which of a sequence of `count` things are taken if there is room for `room`: all, or so many at even distances, the
/// first one among them.
#[derive(Clone, Copy, Debug)]
pub struct Evenly {
    room: usize,
    count: usize,
    sum: usize,
}

impl Evenly {
    /// Chooses as many as there is room for.
    #[must_use]
    pub const fn new(room: usize, count: usize) -> Self {
        Self { room, count, sum: count.saturating_sub(room) }
    }

    /// Takes everything.
    #[must_use]
    pub const fn all() -> Self {
        Self::new(0, 0)
    }

    /// Whether something must be left out.
    #[must_use]
    pub const fn has_cut(&self) -> bool {
        self.count > self.room
    }

    /// Whether the next one is taken.
    pub fn takes(&mut self) -> bool {
        if !self.has_cut() {
            return true;
        }
        // A line of slope room / count, as Bresenham draws it.
        self.sum = self.sum.saturating_add(self.room);
        let is_due = self.sum >= self.count;
        if is_due {
            self.sum -= self.count;
        }
        is_due
    }
}
