//! Incidents over the service port: what there is, and the bytes of each.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use agv_settings::service::{INCIDENT_PIECE, LONGEST_MESSAGE, MessageError, Refusal, Request, Response, encode};

use super::log_ring::logs;

/// The response to a request for incidents, which are in a folder, if any are kept, and its length; None if the request is for something
/// else.
pub(super) fn answer(
    message: &[u8],
    folder: Option<&Path>,
    room: &mut [u8; LONGEST_MESSAGE],
) -> Option<Result<usize, MessageError>> {
    let (request, rest) = postcard::take_from_bytes::<Request>(message).ok()?;
    if !rest.is_empty() {
        return None;
    }
    let mut piece = [0; INCIDENT_PIECE];
    let name;
    let response = match (request, folder) {
        (Request::Incident(_) | Request::IncidentPiece { .. }, None) => Response::Refused(Refusal::NoIncidents),
        (Request::Incident(place), Some(folder)) => match listed(folder).into_iter().nth(usize::from(place)) {
            Some((found, length)) => {
                name = found;
                Response::Incident { name: &name, length }
            }
            None => Response::End,
        },
        (Request::IncidentPiece { name, first }, Some(folder)) => match read(folder, name, first, &mut piece) {
            Some(piece) => Response::IncidentPiece(piece),
            None => Response::Refused(Refusal::NoIncidents),
        },
        _ => return None,
    };
    Some(encode(&response, |_| None, room))
}

/// Names and lengths, the oldest first. One that is longer than can be told is not told.
fn listed(folder: &Path) -> Vec<(String, u32)> {
    let named = |path: &Path| Some(path.file_name()?.to_str()?.to_owned());
    logs(folder).iter().filter_map(|(path, length)| Some((named(path)?, u32::try_from(*length).ok()?))).collect()
}

/// Bytes of one of the incidents that there are: a name of anything else is none.
fn read<'a>(folder: &Path, name: &str, first: u32, piece: &'a mut [u8]) -> Option<&'a [u8]> {
    listed(folder).iter().find(|(known, _)| known == name)?;
    let mut file = File::open(folder.join(name)).ok()?;
    file.seek(SeekFrom::Start(first.into())).ok()?;
    let mut filled = 0;
    while filled < piece.len() {
        match file.read(&mut piece[filled..]).ok()? {
            0 => break,
            count => filled += count,
        }
    }
    Some(&piece[..filled])
}
