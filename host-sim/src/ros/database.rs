//! The older container of ROS 2's recordings, SQLite.

use std::path::Path;

use rusqlite::{Connection, OpenFlags};

use super::bag::unpacked;
use super::bag_message::BagMessage;

/// Why a database cannot be read.
pub type DatabaseError = rusqlite::Error;

/// Calls `take` with each message.
pub(super) fn read(path: &Path, take: &mut impl FnMut(&BagMessage, &str)) -> Result<(), DatabaseError> {
    let database = Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY)?;
    let mut query = database.prepare(
        "SELECT topics.name, topics.type, messages.timestamp, messages.data, topics.serialization_format FROM messages \
         JOIN topics ON messages.topic_id = topics.id ORDER BY messages.id",
    )?;
    let mut rows = query.query([])?;
    while let Some(row) = rows.next()? {
        let time: i64 = row.get(2)?;
        let data = unpacked(row.get_ref(3)?.as_blob()?);
        let found = BagMessage {
            topic: row.get_ref(0)?.as_str()?,
            kind: row.get_ref(1)?.as_str()?,
            time: u64::try_from(time).unwrap_or_default(),
            data: &data,
        };
        take(&found, row.get_ref(4)?.as_str()?);
    }
    Ok(())
}
