//! Files that an MCAP recording keeps beside its messages.

use std::borrow::Cow;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

use mcap::records::AttachmentIndex;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader};
use mcap::{Attachment, McapResult};

use super::bag::LARGEST_RECORD;

/// The log that a recording was made of: messages of ROS have no place for the map's landmarks, the vehicle and the observations as the
/// sensor told them.
pub const ATTACHED_LOG: &str = "drive.agvlog";

/// Bytes behind the data of an attachment (MCAP specification, "Attachment").
const CHECKSUM: u64 = 4;

/// A file as an attachment. None of one that is longer than a record may be.
#[must_use]
pub fn attachment(name: &str, data: Vec<u8>) -> Option<Attachment<'static>> {
    // Half of it leaves room for what stands around the data.
    let is_short = data.len() <= LARGEST_RECORD / 2;
    is_short.then(|| Attachment {
        log_time: 0,
        create_time: 0,
        name: name.to_owned(),
        media_type: "application/octet-stream".to_owned(),
        data: Cow::Owned(data),
    })
}

/// The bytes that are attached under a name. None in a file that was cut, or has none.
pub(super) fn attached(path: &Path, name: &str) -> Option<Vec<u8>> {
    let mut file = File::open(path).ok()?;
    let index = find(&mut file, name).ok()??;
    data(&mut file, &index).ok()?
}

/// Where the attachment lies.
fn find(file: &mut File, name: &str) -> McapResult<Option<AttachmentIndex>> {
    let mut reader = SummaryReader::new();
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(count) => {
                let read = file.read(reader.insert(count))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(place) => {
                let place = file.seek(place)?;
                reader.notify_seeked(place);
            }
        }
    }
    let found = reader.finish().map(|summary| summary.attachment_indexes);
    Ok(found.into_iter().flatten().find(|index| index.name == name))
}

/// What an attachment holds; it ends with a checksum behind that. The log has its own.
fn data(file: &mut File, index: &AttachmentIndex) -> io::Result<Option<Vec<u8>>> {
    let end = index.offset.checked_add(index.length).filter(|end| file.metadata().is_ok_and(|data| *end <= data.len()));
    let begin = end.and_then(|end| end.checked_sub(CHECKSUM)?.checked_sub(index.data_size));
    let Some(begin) = begin.filter(|begin| *begin >= index.offset) else { return Ok(None) };
    file.seek(SeekFrom::Start(begin))?;
    let mut data = Vec::new();
    file.take(index.data_size).read_to_end(&mut data)?;
    Ok(Some(data))
}

#[cfg(test)]
mod tests {
    use super::{LARGEST_RECORD, attachment};

    #[test]
    fn what_no_record_holds_is_not_attached() {
        assert!(attachment("log", vec![0; LARGEST_RECORD / 2]).is_some());
        assert!(attachment("log", vec![0; LARGEST_RECORD / 2 + 1]).is_none());
    }
}
