//! A node that follows a script, written from the standard and not from the code under test.

use std::collections::BTreeMap;

use agv_wire::can::frame::Frame;

use super::frames::frame;

pub const NO_SUCH_OBJECT: u32 = 0x0602_0000;

/// One encoder node on a bus of literal bytes.
#[derive(Clone)]
pub struct Node {
    pub number: u8,
    /// Values by index and subindex, with their lengths.
    pub objects: BTreeMap<(u16, u8), (u32, u8)>,
    /// What the node refuses to take, and why.
    pub refusals: BTreeMap<(u16, u8), u32>,
    pub is_deaf: bool,
    pub is_operational: bool,
    /// Everything that the master wrote.
    pub written: Vec<(u16, u8, u32)>,
    pub resets: usize,
}

impl Node {
    /// The objects of a 24-bit encoder of the profile's tables; the range is told as all ones.
    pub fn new(number: u8) -> Self {
        let pdo = 0x180 + u32::from(number);
        let objects = [
            ((0x1000, 0), (0x0002_0196, 4)),
            ((0x1017, 0), (0, 2)),
            ((0x1800, 1), (pdo, 4)),
            ((0x1800, 2), (254, 1)),
            ((0x1800, 3), (0, 2)),
            ((0x1800, 5), (0, 2)),
            ((0x1A00, 0), (1, 1)),
            ((0x1A00, 1), (0x6004_0020, 4)),
            ((0x6001, 0), (4096, 4)),
            ((0x6002, 0), (0x00FF_FFFF, 4)),
            ((0x6004, 0), (0, 4)),
            ((0x6501, 0), (4096, 4)),
        ];
        Self {
            number,
            objects: objects.into(),
            refusals: BTreeMap::new(),
            is_deaf: false,
            is_operational: false,
            written: Vec::new(),
            resets: 0,
        }
    }

    pub fn without(mut self, index: u16) -> Self {
        self.objects.retain(|(known, _), _| *known != index);
        self
    }

    pub fn boot_up(&self) -> Frame {
        frame(&format!("{:03X}#00", 0x700 + u16::from(self.number)))
    }

    pub fn heartbeat(&self) -> Frame {
        let state = if self.is_operational { 5 } else { 0x7F };
        frame(&format!("{:03X}#{state:02X}", 0x700 + u16::from(self.number)))
    }

    pub fn position(&self, position: u32) -> Frame {
        let [a, b, c, d] = position.to_le_bytes();
        frame(&format!("{:03X}#{a:02X}{b:02X}{c:02X}{d:02X}", 0x180 + u16::from(self.number)))
    }

    fn answer(number: u8, bytes: [u8; 8]) -> Frame {
        let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
        frame(&format!("{:03X}#{digits}", 0x580 + u16::from(number)))
    }

    /// What the node answers to a frame of the master.
    pub fn handle(&mut self, sent: &Frame) -> Vec<Frame> {
        if self.is_deaf {
            return Vec::new();
        }
        let is_mine = |base: u16| {
            *sent == Frame::new(frame(&format!("{:03X}#", base + u16::from(self.number))).id(), sent.data()).unwrap()
        };
        if let (true, [command, node]) = (sent.id() == frame("000#").id(), sent.data()) {
            if ![0, self.number].contains(node) {
                return Vec::new();
            }
            match command {
                0x01 => self.is_operational = true,
                0x02 | 0x80 => self.is_operational = false,
                0x81 | 0x82 => {
                    self.is_operational = false;
                    self.resets += 1;
                    return vec![self.boot_up()];
                }
                _ => panic!("no such command"),
            }
            return Vec::new();
        }
        if !is_mine(0x600) {
            return Vec::new();
        }
        let [command, low, high, sub, data @ ..] = <[u8; 8]>::try_from(sent.data()).unwrap();
        let key = (u16::from_le_bytes([low, high]), sub);
        let number = self.number;
        let abort = |code: u32| {
            let [a, b, c, d] = code.to_le_bytes();
            vec![Self::answer(number, [0x80, low, high, sub, a, b, c, d])]
        };
        if let Some(code) = self.refusals.get(&key) {
            return abort(*code);
        }
        let Some((value, length)) = self.objects.get_mut(&key) else {
            return abort(NO_SUCH_OBJECT);
        };
        let lengths = [0x4F, 0x4B, 0x47, 0x43];
        match command {
            0x40 => {
                let [a, b, c, d] = value.to_le_bytes();
                let first = lengths[usize::from(*length) - 1];
                vec![Self::answer(number, [first, low, high, sub, a, b, c, d])]
            }
            0x23 | 0x27 | 0x2B | 0x2F => {
                assert_eq!(4 - ((command >> 2) & 3), *length, "{key:04X?} has another length");
                *value = u32::from_le_bytes(data);
                self.written.push((key.0, key.1, *value));
                vec![Self::answer(number, [0x60, low, high, sub, 0, 0, 0, 0])]
            }
            _ => panic!("no expedited transfer: {command:02X}"),
        }
    }
}
