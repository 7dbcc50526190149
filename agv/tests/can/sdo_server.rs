//! The emulated encoder's objects, as any master of CANopen asks for them: expedited, in segments, and in ways that it refuses.

use agv_core::measurement::Time;
use agv_core::odometry::CounterRange;
use agv_host_sim::emulate::encoder::EmulatedEncoder;
use agv_wire::can::canopen::{Message, NodeId};
use agv_wire::can::nmt::NmtCommand;

struct Master {
    encoder: EmulatedEncoder,
    node: NodeId,
}

type Bytes = [u8; 8];

impl Master {
    fn new() -> Self {
        let node = NodeId::new(5).unwrap();
        let mut encoder = EmulatedEncoder::new(node, CounterRange::BITS_16);
        // It boots.
        assert!(encoder.poll(Time::default()).is_some());
        encoder.set_position(1000);
        Self { encoder, node }
    }

    fn ask(&mut self, bytes: Bytes) -> Option<Bytes> {
        let answer = self.encoder.handle(&Message::SdoRequest { node: self.node, bytes }.encode())?;
        let Ok(Message::SdoResponse { bytes, .. }) = Message::decode(&answer) else { panic!("{answer:?}") };
        Some(bytes)
    }

    fn request(&mut self, first: u8, index: u16, sub: u8, data: [u8; 4]) -> Bytes {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = data;
        self.ask([first, low, high, sub, a, b, c, d]).expect("a master never waits for ever")
    }

    /// Reads an object by segments if it comes so; an abort code otherwise.
    fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let begin = self.request(0x40, index, sub, [0; 4]);
        let data = [begin[4], begin[5], begin[6], begin[7]];
        if begin[0] == 0x80 {
            return Err(u32::from_le_bytes(data));
        }
        if begin[0] & 2 != 0 {
            return Ok(data[..4 - usize::from(begin[0] >> 2 & 3)].to_vec());
        }
        let (mut bytes, mut toggle) = (Vec::new(), 0);
        loop {
            let piece = self.ask([0x60 | toggle, 0, 0, 0, 0, 0, 0, 0]).unwrap();
            assert_eq!(piece[0] & 0xF0, toggle, "the answer to a segment");
            bytes.extend_from_slice(&piece[1..8 - usize::from(piece[0] >> 1 & 7)]);
            toggle ^= 0x10;
            if piece[0] & 1 != 0 {
                assert_eq!(bytes.len() as u32, u32::from_le_bytes(data));
                return Ok(bytes);
            }
        }
    }

    /// Writes expedited; 0 or the abort code.
    fn write(&mut self, index: u16, sub: u8, value: &[u8]) -> u32 {
        let mut data = [0; 4];
        data[..value.len()].copy_from_slice(value);
        let answer = self.request(0x23 | (4 - value.len() as u8) << 2, index, sub, data);
        if answer[0] == 0x60 { 0 } else { u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]) }
    }

    fn number(&mut self, index: u16, sub: u8) -> u32 {
        self.read(index, sub).unwrap().iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
    }

    fn sync(&mut self) -> Option<Vec<u8>> {
        let sync = Message::Sync { counter: None }.encode();
        self.encoder.handle(&sync).map(|frame| frame.data().to_vec())
    }
}

#[test]
fn what_every_master_looks_at_is_there() {
    let mut master = Master::new();
    for (index, sub, expected) in [
        (0x1000, 0, 0x0002_0196),
        (0x1001, 0, 0),
        (0x1018, 0, 4),
        (0x1018, 4, 5),
        (0x1800, 0, 5),
        (0x6000, 0, 0),
        (0x6002, 0, 65_535),
        (0x6003, 0, 0),
        (0x6004, 0, 1000),
        (0x6502, 0, 16),
    ] {
        assert_eq!(master.number(index, sub), expected, "{index:04X}:{sub}");
    }
    assert_eq!(master.read(0x2000, 0), Err(0x0602_0000));
    assert_eq!(master.read(0x1018, 9), Err(0x0609_0011));
    assert_eq!(master.write(0x6004, 0, &[0; 4]), 0x0601_0002);
    assert_eq!(master.write(0x1017, 0, &[0; 4]), 0x0607_0010);
}

#[test]
fn a_text_comes_in_segments() {
    let mut master = Master::new();
    assert_eq!(master.read(0x1008, 0).unwrap(), b"emulated encoder");
    // A toggle that does not change ends the transfer.
    master.request(0x40, 0x1008, 0, [0; 4]);
    assert_eq!(master.ask([0x70, 0, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0503_0000_u32.to_le_bytes());
    assert_eq!(master.ask([0x60, 0, 0, 0, 0, 0, 0, 0]).unwrap()[4..], 0x0504_0001_u32.to_le_bytes());
}

#[test]
fn a_value_can_be_written_in_segments() {
    let mut master = Master::new();
    assert_eq!(master.request(0x21, 0x1017, 0, [2, 0, 0, 0])[0], 0x60);
    assert_eq!(master.ask([0x0B, 0x2C, 0x01, 0, 0, 0, 0, 0]).unwrap()[0], 0x20);
    assert_eq!(master.number(0x1017, 0), 300);
    // Too long for the object.
    assert_eq!(master.request(0x21, 0x1017, 0, [9, 0, 0, 0])[4..], 0x0607_0010_u32.to_le_bytes());
}

#[test]
fn block_transfers_are_refused_at_once() {
    let mut master = Master::new();
    for first in [0xA0, 0xA4, 0xC0, 0xC6, 0xE0] {
        let answer = master.request(first, 0x1008, 0, [0; 4]);
        assert_eq!((answer[0], &answer[1..4]), (0x80, &[0x08, 0x10, 0][..]));
        assert_eq!(answer[4..], 0x0504_0001_u32.to_le_bytes());
    }
    // A master that gives up wants no answer.
    assert_eq!(master.ask([0x80, 0x08, 0x10, 0, 0, 0, 0, 0]), None);
}

#[test]
fn process_data_are_mapped_as_the_standard_says() {
    let mut master = Master::new();
    let node = Some(master.node);
    master.encoder.handle(&Message::Nmt { command: NmtCommand::Start, node }.encode());
    assert_eq!(master.write(0x1800, 2, &[1]), 0);
    assert_eq!(master.sync().unwrap(), [0xE8, 3, 0, 0]);
    // Not while there are entries, and nothing that is no process value.
    assert_eq!(master.write(0x1A00, 1, &0x6500_0010_u32.to_le_bytes()), 0x0601_0000);
    assert_eq!(master.write(0x1A00, 0, &[0]), 0);
    assert_eq!(master.write(0x1A00, 1, &0x1000_0020_u32.to_le_bytes()), 0x0604_0041);
    assert_eq!(master.write(0x1A00, 1, &0x6500_0010_u32.to_le_bytes()), 0);
    assert_eq!(master.write(0x1A00, 2, &0x6004_0020_u32.to_le_bytes()), 0);
    assert_eq!(master.write(0x1A00, 3, &0x6004_0020_u32.to_le_bytes()), 0);
    assert_eq!(master.write(0x1A00, 0, &[3]), 0x0604_0042);
    assert_eq!(master.write(0x1A00, 0, &[2]), 0);
    assert_eq!(master.sync().unwrap(), [0, 0, 0xE8, 3, 0, 0]);
    // Off, and on again at another identifier.
    assert_eq!(master.write(0x1800, 1, &0x0000_0190_u32.to_le_bytes()), 0x0609_0030);
    assert_eq!(master.write(0x1800, 1, &0x8000_0185_u32.to_le_bytes()), 0);
    assert_eq!(master.sync(), None);
    assert_eq!(master.write(0x1800, 1, &0x0000_0190_u32.to_le_bytes()), 0);
    assert_eq!(master.sync().unwrap().len(), 6);
}

#[test]
fn preset_and_counting_direction_do_what_they_say() {
    let mut master = Master::new();
    assert_eq!(master.write(0x6003, 0, &42_u32.to_le_bytes()), 0);
    assert_eq!(master.number(0x6004, 0), 42);
    master.encoder.set_position(1010);
    assert_eq!(master.number(0x6004, 0), 52);
    assert_eq!(master.write(0x6000, 0, &1_u16.to_le_bytes()), 0);
    let before = master.number(0x6004, 0);
    master.encoder.set_position(1015);
    assert_eq!((master.number(0x6004, 0) + 5) % 65_536, before);
    assert_eq!(master.number(0x6500, 0), 1);
}
