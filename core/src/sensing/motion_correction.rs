//! Correction of a scan for the motion of the vehicle within the revolution.

use heapless::Vec;

use super::PointScan;
use crate::geometry::{Point, Pose, ScanPoint, Transform};
use crate::measurement::{Scan, Time};

/// Beams that are corrected at once.
const BLOCK: usize = 8;

/// Nodes of a path. If there are more, every second one is left out.
const NODES: usize = 48;

/// Nodes closer in time than this, s, add nothing at first.
const LEAST_SPACING: f64 = 2e-3;

/// Where the sensor was during a scan, relative to where it was at the first beam; linear between nodes.
#[derive(Clone, Debug, Default)]
pub struct SensorPath {
    nodes: Vec<Node, NODES>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    time: f64,
    transform: Transform<f64>,
}

impl SensorPath {
    /// The path of a sensor at `laser` in R, from the displacements of R since `start`.
    pub fn set(&mut self, start: Time, laser: &Pose, displacements: impl Iterator<Item = (Time, Pose)>) {
        self.nodes.clear();
        let back = laser.inverse();
        let mut last = f64::NEG_INFINITY;
        let mut spacing = LEAST_SPACING;
        let node = |time: f64, displacement: &Pose| Node {
            time,
            transform: Transform::exact(&back.compose(&displacement.compose(laser))),
        };
        let mut skipped = None;
        for (time, displacement) in displacements {
            let time = time.since(start);
            if time - last < spacing {
                skipped = Some((time, displacement));
                continue;
            }
            if self.nodes.is_full() {
                self.thin_out();
                spacing *= 2.0;
            }
            (last, skipped) = (time, None);
            // There is room.
            let _ = self.nodes.push(node(time, &displacement));
        }
        // Its end is as near as the first spacing would leave it.
        if let Some((time, displacement)) = skipped.filter(|(time, _)| time - last >= LEAST_SPACING) {
            if self.nodes.is_full() {
                self.thin_out();
            }
            let _ = self.nodes.push(node(time, &displacement));
        }
    }

    /// Leaves out every second node.
    fn thin_out(&mut self) {
        let mut is_kept = false;
        self.nodes.retain(|_| {
            is_kept = !is_kept;
            is_kept
        });
    }

    /// Where the sensor was `time` seconds after the first beam, in its frame at the first beam.
    #[must_use]
    pub fn place(&self, time: f64) -> Pose {
        self.transform(time).exact_pose()
    }

    /// Where a point that was seen `time` seconds after the first beam is in the frame of the first beam, m.
    #[must_use]
    pub fn to_start(&self, time: f64, point: &Point) -> Point {
        self.transform(time).apply(point)
    }

    /// Where a point of the frame of the first beam is seen from the sensor `time` seconds later, m.
    #[must_use]
    pub fn from_start(&self, time: f64, point: &Point) -> Point {
        self.transform(time).apply_inverse(point)
    }

    /// Moves all points of a scan into the frame of its first beam.
    pub fn correct<const BEAMS: usize>(&self, scan: &Scan, points: &mut PointScan<BEAMS>) {
        let interval = scan.beam_interval * PointScan::<BEAMS>::stride(scan) as f64;
        let mut segment = self.segment(0);
        let (blocks, last_beams) = points.points.as_chunks_mut::<BLOCK>();
        let (ranges, last_ranges) = points.ranges.as_chunks::<BLOCK>();
        let mut beam = 0;
        for (block, ranges) in blocks.iter_mut().zip(ranges) {
            self.go_on(&mut segment, beam as f64 * interval);
            if segment.end >= (beam + BLOCK - 1) as f64 * interval {
                segment.correct(beam, interval, block, ranges);
            } else {
                self.correct_each(&mut segment, (beam, interval), block, ranges);
            }
            beam += BLOCK;
        }
        self.correct_each(&mut segment, (beam, interval), last_beams, last_ranges);
    }

    /// Moves points one by one, from that of beam `first` on, which is not before the segment; the segment goes on with them.
    fn correct_each(
        &self,
        segment: &mut Segment,
        (first, interval): (usize, f64),
        points: &mut [ScanPoint],
        ranges: &[f32],
    ) {
        for (beam, (point, range)) in (first..).zip(points.iter_mut().zip(ranges)) {
            if *range > 0.0 {
                let time = beam as f64 * interval;
                self.go_on(segment, time);
                *point = segment.transform(time).single().apply(point);
            }
        }
    }

    /// Goes on from a segment to that of a time which is not before it.
    #[inline]
    fn go_on(&self, segment: &mut Segment, time: f64) {
        while segment.end < time {
            *segment = self.segment(segment.index + 1);
        }
    }

    /// The sensor's pose `time` seconds after the first beam.
    fn transform(&self, time: f64) -> Transform<f64> {
        let mut segment = self.segment(0);
        self.go_on(&mut segment, time);
        segment.transform(time)
    }

    /// The path from a node to the one after it; behind the last one it stays.
    fn segment(&self, index: usize) -> Segment {
        let still = |at| Segment { index, end: f64::INFINITY, start: 0.0, duration: 1.0, from: at, to: at };
        match (self.nodes.get(index), self.nodes.get(index + 1)) {
            (Some(before), Some(after)) => Segment {
                index,
                end: after.time,
                start: before.time,
                duration: after.time - before.time,
                from: before.transform,
                to: after.transform,
            },
            (Some(only), None) => still(only.transform),
            _ => still(Transform::IDENTITY),
        }
    }
}

/// A part of a path: linear from `start` on, s since the first beam, up to its end.
#[derive(Clone, Copy, Debug)]
struct Segment {
    index: usize,
    end: f64,
    start: f64,
    duration: f64,
    from: Transform<f64>,
    to: Transform<f64>,
}

impl Segment {
    /// Moves points all of whose beams are of this segment.
    #[inline]
    fn correct(&self, first: usize, interval: f64, points: &mut [ScanPoint; BLOCK], ranges: &[f32; BLOCK]) {
        let mut beam = first as f64;
        let transforms = [(); BLOCK].map(|()| {
            let transform = self.transform(beam * interval).single();
            beam += 1.0;
            transform
        });
        for ((point, range), transform) in points.iter_mut().zip(ranges).zip(&transforms) {
            let moved = transform.apply(point);
            *point = if *range > 0.0 { moved } else { *point };
        }
    }

    #[inline]
    fn transform(&self, time: f64) -> Transform<f64> {
        let share = ((time - self.start) / self.duration).clamp(0.0, 1.0);
        self.from.towards(&self.to, share)
    }
}
