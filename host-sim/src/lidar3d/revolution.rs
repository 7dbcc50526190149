//! Points of one turn of the head.

use agv_core::measurement::Time;
use agv_lidar3d::cloud::RingOrder;
use agv_lidar3d::packet::{Point, Tally, counts_between};

use super::decoder::AnyDecoder;
use super::kind::Datagram;
use super::setup::Setup;

/// The points of one turn.
#[derive(Clone, Debug, Default)]
pub struct Revolution {
    /// When its first packet came.
    pub start: Time,
    /// In the order of the returns; their times are after `start`, as far as the times of the packets are known.
    pub points: Vec<Point>,
    /// Whether the turn begins and ends within what was received.
    pub is_whole: bool,
}

impl Revolution {
    /// The points as an organised cloud: ring after ring from the highest beam, each with so many columns.
    #[must_use]
    pub fn organised(&self, order: &RingOrder, columns: usize) -> Vec<Option<[f32; 3]>> {
        let mut cloud = vec![None; order.rings() * columns];
        for point in &self.points {
            order.put(&mut cloud, point);
        }
        cloud
    }

    /// Different angles of the head at which something was seen: as many columns as an organised cloud can fill.
    #[must_use]
    pub fn columns(&self) -> usize {
        let mut count = 0;
        let mut last = None;
        // The first laser that is seen often stands for all.
        let laser = self.points.get(self.points.len() / 2).map(|point| point.laser);
        for point in self.points.iter().filter(|point| Some(point.laser) == laser) {
            if last != Some(point.azimuth) {
                count += 1;
                last = Some(point.azimuth);
            }
        }
        count
    }
}

/// Hundredths of a degree in a turn of the head.
const TURN: u16 = 36_000;

/// Puts packets together to revolutions. A revolution begins where the angle of the head passes zero.
pub struct Revolutions {
    decoder: AnyDecoder,
    /// Angle at which a revolution begins, 0.01 degrees.
    beginning: u16,
    current: Revolution,
    has_begun: bool,
    last: Option<u16>,
    /// Points in a row that lie before the beginning of the current revolution.
    late: usize,
}

/// More points in a row that seem to come late are those behind a gap, about a packet of each of the densest sensors.
const MOST_LATE: usize = 5000;

impl Revolutions {
    /// Of a sensor.
    #[must_use]
    pub fn new(setup: &Setup) -> Self {
        Self {
            decoder: AnyDecoder::new(setup),
            current: Revolution::default(),
            has_begun: false,
            last: None,
            late: 0,
            beginning: 0,
        }
    }

    /// Lets revolutions begin at that angle of the head, 0.01 degrees. There the next packet begins one.
    pub fn begin_at(&mut self, azimuth: u16) {
        self.beginning = azimuth % TURN;
        self.has_begun = true;
    }

    /// Takes a packet; `take` is called with each revolution that it ends.
    pub fn datagram(&mut self, time: Time, datagram: &Datagram<'_>, mut take: impl FnMut(Revolution)) {
        let Self { decoder, beginning, current, has_begun, last, late } = self;
        if current.points.is_empty() {
            current.start = time;
        }
        decoder.datagram(datagram, |point| {
            let turned = counts_between(*beginning, point.azimuth);
            if last.is_some_and(|last| last > turned && last - turned > TURN / 2) {
                let next = Revolution {
                    start: time,
                    points: Vec::with_capacity(current.points.len() + current.points.len() / 8),
                    is_whole: false,
                };
                let mut whole = std::mem::replace(current, next);
                whole.is_whole = *has_begun;
                *has_begun = true;
                take(whole);
            }
            // A packet that came late begins no revolution, and the next one does not end it again.
            let is_late = last.is_some_and(|last| turned > last && turned - last > TURN / 2);
            *late = if is_late { *late + 1 } else { 0 };
            if !is_late || *late > MOST_LATE {
                *last = Some(turned);
            }
            let after = (1e9 * time.since(current.start)).round() as i32;
            current.points.push(Point { time: after.saturating_add(point.time), ..point });
        });
    }

    /// What is left at the end: a revolution that is not whole. None if there is no point.
    #[must_use]
    pub fn finish(self) -> (Option<Revolution>, Tally) {
        let tally = self.decoder.tally();
        ((!self.current.points.is_empty()).then_some(self.current), tally)
    }

    /// What became of all returns so far.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.decoder.tally()
    }
}
