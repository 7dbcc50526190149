//! Where a scan lies in the frame of a place, or in a map.

/// x, y and heading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// x, y, m.
    pub place: [f32; 2],
    /// Counter-clockwise, rad.
    pub heading: f32,
}

impl Pose {
    /// Brings points of the scan into the frame.
    pub(super) fn out(&self) -> impl Fn([f32; 3]) -> [f32; 3] + use<> {
        let ((sin, cos), [x0, y0]) = (libm::sincosf(self.heading), self.place);
        move |[x, y, up]| [x * cos - y * sin + x0, x * sin + y * cos + y0, up]
    }

    /// Brings points of the frame into the scan.
    pub(super) fn back(&self) -> impl Fn([f32; 3]) -> [f32; 3] + use<> {
        let ((sin, cos), [x0, y0]) = (libm::sincosf(self.heading), self.place);
        move |[x, y, up]| [(x - x0) * cos + (y - y0) * sin, (y - y0) * cos - (x - x0) * sin, up]
    }

    /// This pose, given in the frame of another one, in that one's own frame.
    #[must_use]
    pub fn within(&self, frame: &Self) -> Self {
        let [x, y, _] = frame.out()([self.place[0], self.place[1], 0.0]);
        Self { place: [x, y], heading: frame.heading + self.heading }
    }

    /// This pose in the frame of another one that is given in the same frame: undoes [`Self::within`].
    #[must_use]
    pub fn seen_from(&self, frame: &Self) -> Self {
        let [x, y, _] = frame.back()([self.place[0], self.place[1], 0.0]);
        Self { place: [x, y], heading: self.heading - frame.heading }
    }

    /// Distance between two poses, m.
    #[must_use]
    pub fn apart(&self, other: &Self) -> f32 {
        libm::hypotf(self.place[0] - other.place[0], self.place[1] - other.place[1])
    }
}
