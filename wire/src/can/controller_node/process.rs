//! What the controller knows of its pose, as objects that can be read and mapped.

use agv_core::integrity::AlertLimits;
use agv_core::state::PoseOutput;

use super::dictionary;
use crate::can::canopen::NodeId;
use crate::can::controller::{Health, contents, number};
use crate::can::sdo::Object;

/// What is said of a pose, in its telegrams and one by one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessData {
    /// The pose.
    pub pose: PoseOutput,
    /// What it rests on.
    pub health: Health,
    /// What the vehicle can live with.
    pub limits: AlertLimits,
}

/// The contents of all telegrams, made once for all PDOs of a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Telegrams([u64; 5]);

/// Whether an object is of this kind.
pub(super) fn is_process_data(object: Object) -> bool {
    matches!(object.index, 0x2001..=0x2004 | 0x2008 | 0x2010..=0x2013) && object_is_value(object)
}

fn object_is_value(object: Object) -> bool {
    dictionary::find(object).is_ok_and(|entry| entry.is_mappable)
}

impl ProcessData {
    /// The telegrams with that counter.
    pub(super) fn telegrams(&self, node: NodeId, counter: u8) -> Telegrams {
        let contents = contents(&self.pose, &self.health, &self.limits);
        Telegrams(contents.map(|content| u64::from_le_bytes(content.encode(node, counter).padded())))
    }

    /// The bits of an object; none if it is not of this kind.
    pub(super) fn value(&self, object: Object, telegrams: &Telegrams) -> Option<u64> {
        let Telegrams([position, heading, covariance, status, integrity]) = *telegrams;
        match (object.index, object.sub) {
            (0x2001, 0) => Some(position),
            (0x2002, 0) => Some(heading),
            (0x2003, 0) => Some(covariance),
            (0x2004, 0) => Some(status),
            (0x2008, 0) => Some(integrity),
            (0x2010, sub) => self.pose(sub),
            (0x2011, sub) => self.deviation(sub),
            (0x2012, sub) => self.integrity(sub),
            (0x2013, sub) => self.state(sub),
            _ => None,
        }
    }

    fn pose(&self, sub: u8) -> Option<u64> {
        let PoseOutput { pose, time, dead_reckoning_distance, .. } = self.pose;
        Some(match sub {
            1 => number::LENGTH.put(0, pose.x),
            2 => number::LENGTH.put(0, pose.y),
            3 => number::ANGLE.put(0, pose.theta),
            4 => (time.micros() / 1000) & 0xFFFF_FFFF,
            5 => number::DISTANCE.put_deviation(0, dead_reckoning_distance),
            _ => return None,
        })
    }

    fn deviation(&self, sub: u8) -> Option<u64> {
        let [xx, _, yy, _, _, heading] = self.pose.covariance;
        Some(match sub {
            1 => number::DEVIATION.put_deviation(0, libm::sqrt(xx)),
            2 => number::DEVIATION.put_deviation(0, libm::sqrt(yy)),
            3 => number::SMALL_ANGLE.put_deviation(0, libm::sqrt(heading)),
            _ => return None,
        })
    }

    fn integrity(&self, sub: u8) -> Option<u64> {
        let (level, limit) = (self.pose.level, self.limits.travel);
        Some(match sub {
            1 => number::BOUND.put_bound(0, level.position),
            2 => number::SMALL_ANGLE.put_bound(0, level.heading),
            3 => number::BOUND.put(0, limit.position),
            4 => number::SMALL_ANGLE.put(0, limit.heading),
            5 => number::of_alarm(self.limits.alarm(self.pose.mode, &level)),
            _ => return None,
        })
    }

    fn state(&self, sub: u8) -> Option<u64> {
        let Self { pose, health, .. } = self;
        Some(match sub {
            1 => number::of_mode(pose.mode),
            2 => number::of_reason(pose.reason),
            3 => number::of_fault(health.drive),
            4 => number::of_fault(health.steering),
            5 => number::of_laser(health.laser),
            6 => number::of_search(health.start_search),
            7 => u64::from(pose.is_good()),
            8 => u64::from(pose.has_jumped()),
            9 => u64::from(pose.resets),
            10 => u64::from(pose.overflows),
            _ => return None,
        })
    }
}
