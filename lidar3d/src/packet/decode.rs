//! From packets to points.

use super::{BLOCKS, Filter, OtherSensor, Packet, Point, RETURNS, Return, ReturnKind, ReturnMode, Sensor, Tail, Tally};
use super::{Block, rings};
use crate::geometry::{self, FAR_POINT, Offsets, near_corrections};
use crate::laser::Laser;

/// Most lasers of a sensor.
const LASERS: usize = 128;
/// Most banks of [`RETURNS`] lasers.
const BANKS: usize = 4;
/// Hundredths of a degree in a turn.
const TURN: u32 = 36_000;
/// A hundredth of a degree, rad.
const COUNT: f32 = core::f32::consts::TAU / TURN as f32;

/// A sensor as its packets are decoded.
#[derive(Clone, Copy, Debug)]
pub struct Model<'a> {
    /// Kind of sensor.
    pub sensor: Sensor,
    /// As many lasers as the sensor has.
    pub lasers: &'a [Laser],
    /// Length of one count of distance, m.
    pub distance_resolution: f64,
    /// How the offsets of the beams are measured.
    pub offsets: Offsets,
    /// Whether the maker's two-point correction is used where a laser states it.
    pub two_points: bool,
}

/// The constants of a laser, as decoding needs them. Without its turn, a point is linear in its distance.
#[derive(Clone, Copy, Default)]
struct Beam {
    distance: f32,
    /// Distance from the axis, and its change with the distance.
    forward: [f32; 2],
    /// Height, and its change with the distance.
    height: [f32; 2],
    horizontal_offset: f32,
    rotation: f32,
    is_enabled: bool,
    ring: u8,
    /// Corrections at the two near points.
    near: Option<[f64; 2]>,
}

/// An angle by its sine and cosine.
#[derive(Clone, Copy, Default)]
struct Direction {
    sin: f32,
    cos: f32,
}

impl Direction {
    fn of(angle: f32) -> Self {
        let (sin, cos) = libm::sincosf(angle);
        Self { sin, cos }
    }

    /// The sum of two angles.
    fn plus(self, other: Self) -> Self {
        Self { sin: self.sin * other.cos + self.cos * other.sin, cos: self.cos * other.cos - self.sin * other.sin }
    }
}

/// How far the head has turned since the angle of the block when a return is measured.
#[derive(Clone, Copy, Default)]
struct Turned {
    /// 0.01 degrees.
    counts: u32,
    /// After the angle that is stated, ns.
    time: u32,
    /// With the rotation of the laser in the head.
    direction: Direction,
}

/// Decodes the packets of one sensor.
pub struct Decoder {
    sensor: Sensor,
    filter: Filter,
    resolution: f32,
    beams: [Beam; LASERS],
    tally: Tally,
    /// By the bank and the place in the block.
    turned: [[Turned; RETURNS]; BANKS],
    /// Hundredths of a degree that the head turns in `step.1` firings; `turned` is for these.
    step: (u32, u32),
    /// First angle of the packet before.
    before: Option<u16>,
}

/// What the blocks of a packet have in common.
#[derive(Clone, Copy)]
struct Firing {
    /// Blocks of one angle.
    blocks: usize,
    /// Returns of each laser.
    returns: usize,
    mode: Option<ReturnMode>,
}

impl Decoder {
    /// A decoder.
    #[must_use]
    pub fn new(model: &Model<'_>, filter: Filter) -> Self {
        let lasers = model.lasers;
        let rings: [u8; LASERS] = rings(lasers.iter().map(|laser| laser.is_enabled.then_some(laser.elevation)));
        let mut beams = [Beam::default(); LASERS];
        for ((beam, laser), ring) in beams.iter_mut().zip(lasers).zip(rings) {
            // Both coordinates are linear in the distance.
            let still = Laser { distance: 0.0, rotation: 0.0, horizontal_offset: 0.0, ..*laser };
            let ([forward, _, height], [end, _, top]) =
                (geometry::point(&still, model.offsets, 0.0, 0.0), geometry::point(&still, model.offsets, 0.0, 1.0));
            let full = laser.full.filter(|full| model.two_points && full.has_two_points);
            *beam = Beam {
                distance: laser.distance as f32,
                forward: [forward as f32, (end - forward) as f32],
                height: [height as f32, (top - height) as f32],
                horizontal_offset: laser.horizontal_offset as f32,
                rotation: laser.rotation as f32,
                is_enabled: laser.is_enabled,
                ring,
                near: full.map(|full| [full.distance_x, full.distance_y]),
            };
        }
        let mut decoder = Self {
            sensor: model.sensor,
            filter,
            resolution: model.distance_resolution as f32,
            beams,
            tally: Tally::default(),
            turned: [[Turned::default(); RETURNS]; BANKS],
            step: (0, 1),
            before: None,
        };
        decoder.set_step(0, 1);
        decoder
    }

    /// What became of all returns.
    #[must_use]
    pub fn tally(&self) -> Tally {
        self.tally
    }

    /// The head turns by `counts` hundredths of a degree in so many firings.
    fn set_step(&mut self, counts: u32, firings: u32) {
        self.step = (counts, firings);
        let whole = u64::from(self.sensor.period()) * u64::from(firings);
        for (bank, places) in self.turned.iter_mut().enumerate() {
            for (place, turned) in places.iter_mut().enumerate() {
                turned.time = self.sensor.firing_time(bank, place);
                turned.counts = ((u64::from(counts) * u64::from(turned.time) + whole / 2) / whole) as u32;
                let rotation = self.beams.get(self.sensor.laser(bank, place)).map_or(0.0, |beam| beam.rotation);
                turned.direction = Direction::of(turned.counts as f32 * COUNT - rotation);
            }
        }
    }

    /// Calls `take` with each point of a packet, in the order of the returns. The head's speed is the mean one of the
    /// packet.
    ///
    /// # Errors
    /// [`OtherSensor`] if the packet states another sensor; nothing of it is decoded.
    pub fn packet(&mut self, packet: &Packet<'_>, mut take: impl FnMut(Point)) -> Result<(), OtherSensor> {
        self.sensor.accept(packet)?;
        let step = if packet.tail() == Tail::AT_ONCE { (0, 1) } else { self.sensor.step(packet, self.before) };
        if step != self.step {
            self.set_step(step.0, step.1);
        }
        self.before = packet.azimuth(0);
        let firing = Firing {
            blocks: self.sensor.blocks(),
            returns: self.sensor.returns(packet),
            mode: packet.tail().return_mode().filter(|_| self.sensor != Sensor::Hdl64e),
        };
        let first = self.sensor.first_firing();
        for (index, block) in packet.blocks().enumerate().take(BLOCKS) {
            let start = first + (index / (firing.blocks * firing.returns)) as i32 * self.sensor.period() as i32;
            let other = firing.other(self.sensor, index).and_then(|(other, role)| Some((packet.block(other)?, role)));
            self.block(block, start, firing.mode, other, &mut take);
        }
        Ok(())
    }

    /// The points of one block; `other` has the other returns of its firings.
    fn block(
        &mut self,
        block: Block<'_>,
        start: i32,
        mode: Option<ReturnMode>,
        other: Option<(Block<'_>, Role)>,
        take: &mut impl FnMut(Point),
    ) {
        let Self { sensor, filter, resolution, ref beams, ref turned, ref mut tally, .. } = *self;
        let azimuth = u32::from(block.azimuth());
        let head = Direction::of(azimuth as f32 * COUNT);
        let bank = block.bank();
        let Some(places) = turned.get(bank) else { return };
        for (place, (value, turned)) in block.returns().zip(places).enumerate() {
            let laser = sensor.laser(bank, place);
            let Some(beam) = beams.get(laser).filter(|beam| beam.is_enabled) else {
                tally.unused += 1;
                continue;
            };
            if value.distance == 0 {
                tally.empty += 1;
                continue;
            }
            let other = other.and_then(|(block, role)| Some((block.one(place)?, role)));
            let Some(kind) = kind(mode, value, other) else {
                tally.equal += 1;
                continue;
            };
            let distance = f32::from(value.distance) * resolution + beam.distance;
            if distance < filter.near {
                tally.near += 1;
                continue;
            }
            if distance > filter.far {
                tally.far += 1;
                continue;
            }
            let at = azimuth + turned.counts;
            tally.points += 1;
            take(Point {
                position: beam.point(head.plus(turned.direction), distance),
                time: start + turned.time as i32,
                intensity: u16::from(value.intensity),
                azimuth: (at % TURN) as u16,
                laser: laser as u8,
                ring: beam.ring,
                kind,
            });
        }
    }
}

/// Which of two blocks of the same lasers and firings it is.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Before,
    Behind,
}

impl Firing {
    /// The block that holds the other returns of a block's firings, and which of the two the block itself is: one next
    /// to the other, but at an HDL-64E upper and lower block go together.
    fn other(self, sensor: Sensor, index: usize) -> Option<(usize, Role)> {
        if self.returns < 2 {
            return None;
        }
        let apart = if sensor == Sensor::Hdl64e { self.blocks } else { 1 };
        if (index / apart).is_multiple_of(2) {
            Some((index + apart, Role::Before))
        } else {
            Some((index - apart, Role::Behind))
        }
    }
}

/// Which of the returns of its firing a return is; None if it is the other one again. In dual return mode the block
/// before holds the last return and the one behind the strongest, or the second strongest if the last is the strongest
/// (VLP-16 manual, dual return mode). An HDL-64E states nothing.
fn kind(mode: Option<ReturnMode>, value: Return, other: Option<(Return, Role)>) -> Option<ReturnKind> {
    if let Some((other, role)) = other {
        return match role {
            Role::Behind if other.distance == value.distance => None,
            _ if mode.is_none() => Some(ReturnKind::Unknown),
            Role::Before if other.distance == value.distance || other.distance == 0 => Some(ReturnKind::Both),
            Role::Before => Some(ReturnKind::Last),
            Role::Behind if other.intensity > value.intensity => Some(ReturnKind::SecondStrongest),
            Role::Behind => Some(ReturnKind::Strongest),
        };
    }
    Some(match mode {
        Some(ReturnMode::Strongest) => ReturnKind::Strongest,
        Some(ReturnMode::Last) => ReturnKind::Last,
        Some(ReturnMode::Dual) | None => ReturnKind::Unknown,
    })
}

impl Beam {
    /// The point at a corrected distance, where the beam looks in a direction.
    fn point(&self, Direction { sin, cos }: Direction, distance: f32) -> [f32; 3] {
        let forward = self.forward[0] + self.forward[1] * distance;
        let offset = self.horizontal_offset;
        let height = self.height[0] + self.height[1] * distance;
        let [x, y, z] = [forward * cos + offset * sin, offset * cos - forward * sin, height];
        let Some(near) = self.near.filter(|_| f64::from(distance) < FAR_POINT) else { return [x, y, z] };
        let far = f64::from(self.distance);
        let [along_x, along_y] =
            near_corrections(far, near, [x, y].map(f64::from)).map(|correction| (correction - far) as f32);
        [x + along_y * self.forward[1] * cos, y - along_x * self.forward[1] * sin, z + along_y * self.height[1]]
    }
}
