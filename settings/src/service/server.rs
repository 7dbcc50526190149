//! The controller's side of a connection, without sockets.

use agv_core::geometry::Pose;
use agv_core::localizer::PoseFix;
use agv_core::maps::Landmark;
use agv_core::measurement::Time;
use heapless::Vec;

use super::authentication::{self, Nonce, TAG};
use super::frame::{LONGEST_MESSAGE, MessageError, encode};
use super::message::{Change, PROTOCOL, Refusal, Request, Response};
use crate::contour_store::{CONTOUR_PIECE, ContourStore};
use crate::leaf::{Leaf, LeafError};
use crate::patient_flash::PatientFlash;
use crate::store::{KEY, MapWriter, PIECE, Store, StoreError};
use crate::{LEAVES, Settings};

/// What requests are about. All of it belongs to the controller, not to a connection.
pub struct Controller<F: PatientFlash> {
    /// Name and version of the software.
    pub software: &'static str,
    /// The settings as they will be after the next start, if they are stored.
    pub settings: Settings,
    /// Where they are kept. None if the board's flash cannot be used.
    pub store: Option<Store<F>>,
    /// The map that the vehicle uses.
    pub landmarks: &'static [Landmark],
    /// The key that changes need. None if none was provisioned.
    pub key: Option<[u8; KEY]>,
    /// Starts so far.
    pub starts: u32,
    /// Nonces so far.
    pub nonces: u32,
    /// What the last panic said.
    pub panic: &'static str,
    /// A map that is being written.
    pub map: Option<MapWriter>,
    /// Where the map of contours is kept. None if the board has no room for one.
    pub contours: Option<ContourStore<F>>,
}

/// What is left to do when a request was answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// Nothing.
    None,
    /// The vehicle is where it was said to be.
    SetPose(PoseFix),
    /// Forget the last panic.
    ForgetPanic,
    /// Start again, after the response was sent.
    Reboot,
}

/// What comes of a message.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
#[derive(Clone, Debug, PartialEq)]
pub enum Answer<'a> {
    /// A response of so many bytes, and what is left to do.
    Whole(usize, Action),
    /// This is to be kept before there is a response.
    ToKeep(Kept<'a>),
}

/// One connection.
pub struct Session {
    nonce: Option<Nonce>,
    changes: u32,
}

impl Session {
    /// A connection on which nothing was said.
    #[must_use]
    pub const fn new() -> Self {
        Self { nonce: None, changes: 0 }
    }

    /// Answers a message: puts the response into `room`, gives its length and what is left to do.
    ///
    /// `time` is now. A vehicle that does not stand is not changed.
    ///
    /// # Errors
    /// If the message means nothing. The connection is of no more use.
    pub async fn answer<F: PatientFlash>(
        &mut self,
        message: &[u8],
        controller: &mut Controller<F>,
        is_standing: bool,
        time: Time,
        room: &mut [u8; LONGEST_MESSAGE],
    ) -> Result<(usize, Action), MessageError> {
        // By reference: whoever waits for the flash holds it once.
        let answer = self.decide(message, controller, is_standing, time, room)?;
        let kept = match &answer {
            Answer::Whole(length, action) => return Ok((*length, *action)),
            Answer::ToKeep(kept) => kept,
        };
        let outcome = keep(kept, controller).await;
        Ok((answer_kept(outcome, room)?, Action::None))
    }

    /// As [`Self::answer`], but what is to be kept in flash is left to [`keep`], and its answer to [`answer_kept`]: without the
    /// storage, the rest can be looked at on its own.
    ///
    /// # Errors
    /// If the message means nothing. The connection is of no more use.
    pub fn decide<'a, F: PatientFlash>(
        &mut self,
        message: &'a [u8],
        controller: &mut Controller<F>,
        is_standing: bool,
        time: Time,
        room: &mut [u8; LONGEST_MESSAGE],
    ) -> Result<Answer<'a>, MessageError> {
        let (request, tag) = postcard::take_from_bytes::<Request>(message).map_err(|_| MessageError)?;
        let is_change = matches!(request, Request::Change(_));
        if tag.len() != if is_change { TAG } else { 0 } {
            return Err(MessageError);
        }
        let mut action = Action::None;
        let mut piece = [0; CONTOUR_PIECE];
        let response = match request {
            Request::Version => {
                Response::Version { software: controller.software, protocol: PROTOCOL, starts: controller.starts, time }
            }
            Request::Nonce => self.begin(controller, time),
            Request::Get(name) => {
                Leaf::named(name).map_or(Response::Refused(Refusal::Name), |leaf| describe(leaf, &controller.settings))
            }
            Request::Leaf(place) => {
                LEAVES.get(usize::from(place)).map_or(Response::End, |leaf| describe(leaf, &controller.settings))
            }
            Request::Map(first) => map_piece(controller.landmarks, first),
            Request::Panic => Response::Panic(controller.panic),
            Request::Contours(first) => contour_piece(controller.contours.as_mut(), first, &mut piece),
            // Who keeps some answers before.
            Request::Incident(_) | Request::IncidentPiece { .. } => Response::Refused(Refusal::NoIncidents),
            Request::Change(change) => {
                let signed = message.get(..message.len() - TAG).unwrap_or_default();
                let outcome = self.permit(controller, signed, tag, is_standing);
                match outcome.and_then(|()| perform(change, controller, time)) {
                    Ok(Performed::Done(left)) => {
                        action = left;
                        Response::Done
                    }
                    Ok(Performed::ToKeep(kept)) => return Ok(Answer::ToKeep(kept)),
                    Err(refusal) => Response::Refused(refusal),
                }
            }
        };
        Ok(Answer::Whole(encode(&response, |_| None, room)?, action))
    }

    fn begin<F: PatientFlash>(&mut self, controller: &mut Controller<F>, time: Time) -> Response<'static> {
        let Some(key) = &controller.key else { return Response::Refused(Refusal::NoKey) };
        controller.nonces = controller.nonces.wrapping_add(1);
        let nonce = authentication::nonce(key, controller.starts, controller.nonces, time.micros());
        self.nonce = Some(nonce);
        self.changes = 0;
        Response::Nonce(nonce)
    }

    /// Whether a change may be made. A change with the right tag takes its number, whatever becomes of it.
    fn permit<F: PatientFlash>(
        &mut self,
        controller: &Controller<F>,
        request: &[u8],
        tag: &[u8],
        is_standing: bool,
    ) -> Result<(), Refusal> {
        let key = controller.key.as_ref().ok_or(Refusal::NoKey)?;
        let nonce = self.nonce.as_ref().ok_or(Refusal::Tag)?;
        if !authentication::is_right(key, nonce, self.changes, request, tag) {
            return Err(Refusal::Tag);
        }
        self.changes = self.changes.wrapping_add(1);
        if is_standing { Ok(()) } else { Err(Refusal::Moving) }
    }
}

impl Default for Session {
    fn default() -> Self {
        Self::new()
    }
}

fn describe(leaf: &Leaf, settings: &Settings) -> Response<'static> {
    match leaf.get(settings) {
        Some(value) => Response::Leaf { name: leaf.name, unit: leaf.unit, value },
        None => Response::NoLeaf,
    }
}

fn map_piece(landmarks: &[Landmark], first: u16) -> Response<'static> {
    let rest = landmarks.get(usize::from(first)..).unwrap_or_default();
    let piece = rest.get(..rest.len().min(PIECE)).unwrap_or_default();
    Response::Map { count: landmarks.len() as u16, piece: Vec::from_slice(piece).unwrap_or_default() }
}

fn contour_piece<'a, F: PatientFlash>(
    store: Option<&mut ContourStore<F>>,
    first: u32,
    room: &'a mut [u8; CONTOUR_PIECE],
) -> Response<'a> {
    let Some(store) = store else { return Response::Refused(Refusal::Store(StoreError::NoContours)) };
    let length = store.found().map_or(0, |found| found.length);
    match store.read(first, room) {
        Ok(piece) => Response::Contours { length, piece },
        Err(error) => Response::Refused(Refusal::Store(error)),
    }
}

/// What is to be kept in flash.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
#[derive(Clone, Debug, PartialEq)]
pub enum Kept<'a> {
    /// All settings.
    Settings,
    /// A map of so many landmarks, which begins.
    MapBegin(u16),
    /// Its next landmarks.
    MapPiece(Vec<Landmark, PIECE>),
    /// Its end.
    MapEnd,
    /// A map of contours of so many bytes with that checksum, which begins.
    ContourBegin(u32, u32),
    /// Its next bytes.
    ContourPiece(&'a [u8]),
    /// Its end.
    ContourEnd,
}

/// What comes of a change.
#[allow(clippy::large_enum_variant, reason = "there is no allocator, and there is one message at a time")]
enum Performed<'a> {
    Done(Action),
    ToKeep(Kept<'a>),
}

fn perform<'a, F: PatientFlash>(
    change: Change<'a>,
    controller: &mut Controller<F>,
    time: Time,
) -> Result<Performed<'a>, Refusal> {
    let kept = match change {
        Change::Store => Kept::Settings,
        Change::BeginMap(count) => Kept::MapBegin(count),
        Change::MapPiece(piece) => Kept::MapPiece(piece),
        Change::FinishMap => Kept::MapEnd,
        Change::BeginContours { length, checksum } => Kept::ContourBegin(length, checksum),
        Change::ContourPiece(piece) => Kept::ContourPiece(piece),
        Change::FinishContours => Kept::ContourEnd,
        Change::Set(name, value) => {
            let leaf = Leaf::named(name).ok_or(Refusal::Name)?;
            leaf.change(&mut controller.settings, value).map_err(|error| match error {
                LeafError::Kind => Refusal::Kind,
                LeafError::Bounds => Refusal::Bounds,
                LeafError::BusLoad => Refusal::BusLoad,
                LeafError::Other(key) => Refusal::Other(key),
            })?;
            return Ok(Performed::Done(Action::None));
        }
        Change::SetPose { pose: [x, y, theta], deviations: [position_deviation, heading_deviation] } => {
            let pose = Pose { x, y, theta };
            let is_sensible = |deviation: f64| deviation.is_finite() && deviation > 0.0;
            if !(pose.is_finite() && is_sensible(position_deviation) && is_sensible(heading_deviation)) {
                return Err(Refusal::Pose);
            }
            let fix = PoseFix { time, pose, position_deviation, heading_deviation };
            return Ok(Performed::Done(Action::SetPose(fix)));
        }
        Change::ForgetPanic => {
            controller.panic = "";
            return Ok(Performed::Done(Action::ForgetPanic));
        }
        Change::Reboot => return Ok(Performed::Done(Action::Reboot)),
    };
    Ok(Performed::ToKeep(kept))
}

/// Keeps something in flash.
///
/// # Errors
/// If the flash refuses or is full, or it does not go with what was kept before.
pub async fn keep<F: PatientFlash>(kept: &Kept<'_>, controller: &mut Controller<F>) -> Result<(), StoreError> {
    let Controller { settings, store, map, contours, .. } = controller;
    let store = store.as_mut().ok_or(StoreError::Flash);
    let contours = contours.as_mut().ok_or(StoreError::NoContours);
    match kept {
        Kept::Settings => store?.store_leaves(settings).await,
        Kept::MapBegin(count) => {
            *map = Some(store?.begin_map(*count).await?);
            Ok(())
        }
        Kept::MapPiece(piece) => {
            let writer = map.as_mut().ok_or(StoreError::Map)?;
            store?.write_piece(writer, piece).await
        }
        Kept::MapEnd => {
            let writer = map.take().ok_or(StoreError::Map)?;
            store?.finish_map(&writer).await
        }
        Kept::ContourBegin(length, checksum) => contours?.begin(*length, *checksum).await,
        Kept::ContourPiece(piece) => contours?.write(piece).await,
        Kept::ContourEnd => contours?.finish().await,
    }
}

/// The answer to a request to keep something: puts the response into `room`, and says how long it is.
///
/// # Errors
/// If there is no room for it.
pub fn answer_kept(outcome: Result<(), StoreError>, room: &mut [u8; LONGEST_MESSAGE]) -> Result<usize, MessageError> {
    let response = match outcome {
        Ok(()) => Response::Done,
        Err(error) => Response::Refused(Refusal::Store(error)),
    };
    encode(&response, |_| None, room)
}
