//! Packets of `velodyne_msgs/VelodyneScan` and `pandar_msgs/PandarScan` in a bag of ROS 2 (sqlite3, CDR).

use std::path::Path;

use rusqlite::{Connection, OpenFlags};

/// Scan by scan, the packets; `sized`: whether each states its length behind its bytes, as those of Hesai do.
pub fn packets_of_bag(path: &Path, room: usize, sized: bool) -> Vec<Vec<Vec<u8>>> {
    let name = format!("file:{}?immutable=1", path.display());
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    let bag = Connection::open_with_flags(name, flags).unwrap();
    let mut rows = bag.prepare("select data from messages order by timestamp").unwrap();
    let messages = rows.query_map([], |row| row.get::<_, Vec<u8>>(0)).unwrap();
    messages.map(|message| packets_of_message(&message.unwrap(), room, sized)).collect()
}

fn packets_of_message(message: &[u8], room: usize, sized: bool) -> Vec<Vec<u8>> {
    // Behind the encapsulation, everything is aligned to its own size.
    let mut body = Reader { bytes: &message[4..], at: 0 };
    body.skip(8);
    let frame = body.number();
    body.skip(frame);
    let count = body.number();
    let packets = (0..count).map(|_| {
        body.align();
        body.skip(8);
        let bytes = body.take(room);
        let length = if sized { body.number() } else { room };
        bytes[..length].to_vec()
    });
    packets.collect()
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    fn align(&mut self) {
        self.at = self.at.next_multiple_of(4);
    }

    fn skip(&mut self, bytes: usize) {
        self.at += bytes;
    }

    fn take(&mut self, bytes: usize) -> &'a [u8] {
        let taken = &self.bytes[self.at..self.at + bytes];
        self.at += bytes;
        taken
    }

    fn number(&mut self) -> usize {
        self.align();
        u32::from_le_bytes(self.take(4).try_into().unwrap()) as usize
    }
}
