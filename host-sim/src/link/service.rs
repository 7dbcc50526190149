//! The service port of a controller.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use agv_core::contours::KeptMapError;
use agv_core::geometry::Pose;
use agv_core::maps::Landmark;
use agv_settings::contour_store::{CONTOUR_PIECE, checksum};
use agv_settings::leaf::{Leaf, Value};
use agv_settings::service::authentication::{Nonce, tag};
use agv_settings::service::{Change, Frames, LONGEST_MESSAGE, PROTOCOL, Refusal, Request, Response, encode};
use agv_settings::store::{KEY, PIECE, StoreError};
use serde::Serialize;

use crate::contour_map::ContourMap;

/// Port of the service.
pub const PORT: u16 = 5351;

/// How long an answer may take: flash takes long to erase.
const PATIENCE: Duration = Duration::from_secs(15);

/// Why a controller does not do what it was asked.
#[derive(Debug, thiserror::Error)]
pub enum ServiceError {
    /// It cannot be reached, or does not answer.
    #[error("{host}: {source}")]
    Io {
        /// The controller.
        host: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// It says what it should not.
    #[error("{host}: answers in another language; is this the service port of a controller?")]
    Language {
        /// The controller.
        host: String,
    },
    /// It speaks another version.
    #[error("{host}: speaks version {version} of the service, this program version {PROTOCOL}")]
    Version {
        /// The controller.
        host: String,
        /// Its version.
        version: u16,
    },
    /// It gives another map than it says.
    #[error("{host}: the map has {count} landmarks, and {got} came")]
    Map {
        /// The controller.
        host: String,
        /// Landmarks of its map, as it says.
        count: usize,
        /// Landmarks that came.
        got: usize,
    },
    /// It gives another map of contours than it says, or something else than one.
    #[error("{host}: the map of contours has {length} bytes, and what came is none")]
    Contours {
        /// The controller.
        host: String,
        /// Bytes of its map, as it says.
        length: usize,
    },
    /// It refuses.
    #[error("{}", explain(*.0))]
    Refused(Refusal),
    /// Its vehicle is of a kind that has no such setting.
    #[error("the vehicle has no such setting: vehicle.kind says that it is of another kind")]
    OtherKind,
    /// A change without a key.
    #[error("changing something needs the controller's key; state --key FILE")]
    NoKey,
}

fn explain(refusal: Refusal) -> String {
    let text = match refusal {
        Refusal::Name => "there is no setting of that name; agv ctl HOST list shows them",
        Refusal::Kind => "the setting holds another kind of value",
        Refusal::Bounds => "the value is out of bounds",
        Refusal::Other(key) => {
            let name = Leaf::keyed(key).map_or("another setting", |leaf| leaf.name);
            return format!("{name} does not go with the value; it is to be changed first");
        }
        Refusal::Moving => "the vehicle moves; it must stand for a second before it is changed",
        Refusal::Tag => "the key is not that of the controller",
        Refusal::NoKey => "no key was provisioned on the controller, so nobody may change it",
        Refusal::BusLoad => {
            "the CAN bus would be loaded by more than 60 % of its bit rate; it needs a longer can.publishing_period or \
             can.encoder_period, or a higher can.bit_rate"
        }
        Refusal::NoIncidents => {
            "the controller keeps no such incident: a board keeps none, and agv run keeps them if its file has [recording]"
        }
        Refusal::Pose => "the pose or its deviations are no sensible numbers",
        Refusal::Store(StoreError::Full) => "the flash is full",
        Refusal::Store(StoreError::Map) => "the map is too large, or was not sent as a whole",
        Refusal::Store(StoreError::Flash) => "the flash does not work",
        Refusal::Store(StoreError::NoContours) => "the board has no room for a map of contours",
    };
    text.to_owned()
}

/// A setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What it is set to.
    pub value: Value,
}

/// An incident that a controller keeps.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct KeptIncident {
    /// The name of its log.
    pub name: String,
    /// Bytes of the log.
    pub length: u32,
}

/// What runs on a controller.
#[derive(Clone, Debug, PartialEq)]
pub struct Version {
    /// Name and version of the software.
    pub software: String,
    /// Starts so far.
    pub starts: u32,
    /// Time since the start, s.
    pub uptime: f64,
}

/// A connection to a controller.
pub struct Client {
    host: String,
    stream: TcpStream,
    frames: Box<Frames>,
    key: Option<[u8; KEY]>,
    nonce: Option<Nonce>,
    changes: u32,
}

impl Client {
    /// Connects to `host:port`. Changes need the controller's key.
    ///
    /// # Errors
    /// If there is no controller that speaks this version of the service.
    pub fn connect(host: &str, key: Option<[u8; KEY]>) -> Result<Self, ServiceError> {
        let connect = || -> io::Result<TcpStream> {
            let mut outcome = Err(io::Error::from(io::ErrorKind::NotFound));
            for address in host.to_socket_addrs()? {
                outcome = TcpStream::connect_timeout(&address, Duration::from_secs(5));
                if outcome.is_ok() {
                    break;
                }
            }
            let stream = outcome?;
            stream.set_nodelay(true)?;
            stream.set_read_timeout(Some(PATIENCE))?;
            stream.set_write_timeout(Some(PATIENCE))?;
            Ok(stream)
        };
        let stream = connect().map_err(|source| ServiceError::Io { host: host.to_owned(), source })?;
        let frames = Box::new(Frames::new());
        let mut client = Self { host: host.to_owned(), stream, frames, key, nonce: None, changes: 0 };
        let version = client.ask(&Request::Version, |response| match response {
            Response::Version { protocol, .. } => Some(*protocol),
            _ => None,
        })?;
        if version != PROTOCOL {
            return Err(ServiceError::Version { host: host.to_owned(), version });
        }
        Ok(client)
    }

    fn io(&self, source: io::Error) -> ServiceError {
        ServiceError::Io { host: self.host.clone(), source }
    }

    fn language(&self) -> ServiceError {
        ServiceError::Language { host: self.host.clone() }
    }

    /// Sends a request and gives what `pick` takes from the response.
    fn ask<T>(&mut self, request: &Request, pick: impl FnOnce(&Response) -> Option<T>) -> Result<T, ServiceError> {
        let mut room = vec![0; LONGEST_MESSAGE];
        let signature = match (request, &self.key, &self.nonce) {
            (Request::Change(_), Some(key), Some(nonce)) => Some((*key, *nonce)),
            (Request::Change(_), ..) => return Err(ServiceError::NoKey),
            _ => None,
        };
        let sign = |bytes: &[u8]| signature.map(|(key, nonce)| tag(&key, &nonce, self.changes, bytes));
        let length = encode(request, sign, &mut room).map_err(|_| self.language())?;
        if signature.is_some() {
            self.changes += 1;
        }
        self.stream.write_all(&room[..length]).map_err(|source| self.io(source))?;
        self.frames.clear();
        loop {
            // An answer follows its question: nothing comes behind it.
            let count = match self.stream.read(&mut room) {
                Ok(0) => return Err(self.io(io::ErrorKind::ConnectionAborted.into())),
                Ok(count) => count,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                Err(error) => return Err(self.io(error)),
            };
            let (_, is_whole) = self.frames.push(&room[..count]).map_err(|_| self.language())?;
            if is_whole {
                break;
            }
        }
        match postcard::from_bytes(self.frames.message()) {
            Ok(Response::Refused(refusal)) => Err(ServiceError::Refused(refusal)),
            Ok(response) => pick(&response).ok_or_else(|| self.language()),
            Err(_) => Err(self.language()),
        }
    }

    fn change(&mut self, change: Change) -> Result<(), ServiceError> {
        if self.key.is_some() && self.nonce.is_none() {
            self.nonce = Some(self.ask(&Request::Nonce, |response| match response {
                Response::Nonce(nonce) => Some(*nonce),
                _ => None,
            })?);
        }
        self.ask(&Request::Change(change), |response| matches!(response, Response::Done).then_some(()))
    }

    /// What runs there.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn version(&mut self) -> Result<Version, ServiceError> {
        self.ask(&Request::Version, |response| match response {
            Response::Version { software, starts, time, .. } => {
                Some(Version { software: (*software).to_owned(), starts: *starts, uptime: time.seconds() })
            }
            _ => None,
        })
    }

    /// A setting.
    ///
    /// # Errors
    /// If there is none of that name, or none for the kind of the vehicle.
    pub fn get(&mut self, name: &str) -> Result<Setting, ServiceError> {
        let setting = self.ask(&Request::Get(name), |response| match response {
            Response::Leaf { name, unit, value } => {
                Some(Some(Setting { name: (*name).to_owned(), unit: (*unit).to_owned(), value: *value }))
            }
            Response::NoLeaf => Some(None),
            _ => None,
        })?;
        setting.ok_or(ServiceError::OtherKind)
    }

    /// All settings that matter for the kind of the vehicle.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn list(&mut self) -> Result<Vec<Setting>, ServiceError> {
        let mut settings = Vec::new();
        for place in 0..=u16::MAX {
            let is_end = self.ask(&Request::Leaf(place), |response| match response {
                Response::Leaf { name, unit, value } => {
                    let setting = Setting { name: (*name).to_owned(), unit: (*unit).to_owned(), value: *value };
                    settings.push(setting);
                    Some(false)
                }
                Response::NoLeaf => Some(false),
                Response::End => Some(true),
                _ => None,
            })?;
            if is_end {
                break;
            }
        }
        Ok(settings)
    }

    /// The map that the vehicle uses.
    ///
    /// # Errors
    /// If it does not answer, or gives another number of landmarks than it says.
    pub fn download_map(&mut self) -> Result<Vec<Landmark>, ServiceError> {
        let mut landmarks: Vec<Landmark> = Vec::new();
        loop {
            let first = landmarks.len() as u16;
            let (count, is_last) = self.ask(&Request::Map(first), |response| match response {
                Response::Map { count, piece } => {
                    landmarks.extend(piece);
                    Some((usize::from(*count), piece.is_empty()))
                }
                _ => None,
            })?;
            if landmarks.len() == count {
                return Ok(landmarks);
            }
            if is_last || landmarks.len() > count {
                return Err(ServiceError::Map { host: self.host.clone(), count, got: landmarks.len() });
            }
        }
    }

    /// The map of contours that the vehicle uses; none if it has none.
    ///
    /// # Errors
    /// If it does not answer, has no room for one, or gives something else than it says.
    pub fn download_contours(&mut self) -> Result<Option<ContourMap>, ServiceError> {
        let mut bytes: Vec<u8> = Vec::new();
        loop {
            let (length, is_last) = self.ask(&Request::Contours(bytes.len() as u32), |response| match response {
                Response::Contours { length, piece } => {
                    bytes.extend_from_slice(piece);
                    Some((*length as usize, piece.is_empty()))
                }
                _ => None,
            })?;
            if length == 0 {
                return Ok(None);
            }
            let other = |_| ServiceError::Contours { host: self.host.clone(), length };
            if bytes.len() == length {
                return ContourMap::of_bytes(bytes).map(Some).map_err(other);
            }
            if is_last || bytes.len() > length {
                return Err(other(KeptMapError::Format));
            }
        }
    }

    /// The incidents that it keeps, the oldest first.
    ///
    /// # Errors
    /// If it does not answer, or keeps none.
    pub fn incidents(&mut self) -> Result<Vec<KeptIncident>, ServiceError> {
        let mut incidents = Vec::new();
        for place in 0..=u16::MAX {
            let found = self.ask(&Request::Incident(place), |response| match response {
                Response::Incident { name, length } => {
                    Some(Some(KeptIncident { name: (*name).to_owned(), length: *length }))
                }
                Response::End => Some(None),
                _ => None,
            })?;
            match found {
                Some(incident) => incidents.push(incident),
                None => break,
            }
        }
        Ok(incidents)
    }

    /// Writes the log of an incident to `log`; `progress` is told each piece's bytes.
    ///
    /// # Errors
    /// If it does not answer, has no such incident any more, or the log cannot be written.
    pub fn fetch_incident(
        &mut self,
        incident: &KeptIncident,
        log: &mut impl Write,
        mut progress: impl FnMut(usize),
    ) -> Result<(), ServiceError> {
        let mut first = 0;
        while first < incident.length {
            let request = Request::IncidentPiece { name: &incident.name, first };
            let piece = self.ask(&request, |response| match response {
                Response::IncidentPiece(piece) if !piece.is_empty() => Some((*piece).to_vec()),
                _ => None,
            })?;
            log.write_all(&piece).map_err(|source| self.io(source))?;
            progress(piece.len());
            first += piece.len() as u32;
        }
        Ok(())
    }

    /// What the last panic said; empty if there was none.
    ///
    /// # Errors
    /// If it does not answer.
    pub fn last_panic(&mut self) -> Result<String, ServiceError> {
        self.ask(&Request::Panic, |response| match response {
            Response::Panic(text) => Some((*text).to_owned()),
            _ => None,
        })
    }

    /// Changes a setting, until the next start unless it is stored.
    ///
    /// # Errors
    /// If the controller refuses.
    pub fn set(&mut self, name: &str, value: Value) -> Result<(), ServiceError> {
        self.change(Change::Set(name, value))
    }

    /// Keeps all settings in flash.
    ///
    /// # Errors
    /// If the controller refuses.
    pub fn store(&mut self) -> Result<(), ServiceError> {
        self.change(Change::Store)
    }

    /// Replaces the map, from the next start on.
    ///
    /// # Errors
    /// If the controller refuses. It has its old map then.
    pub fn upload_map(&mut self, landmarks: &[Landmark], mut progress: impl FnMut(usize)) -> Result<(), ServiceError> {
        let too_large = ServiceError::Refused(Refusal::Store(StoreError::Map));
        let count = u16::try_from(landmarks.len()).map_err(|_| too_large)?;
        self.change(Change::BeginMap(count))?;
        for piece in landmarks.chunks(PIECE) {
            self.change(Change::MapPiece(piece.iter().copied().collect()))?;
            progress(piece.len());
        }
        self.change(Change::FinishMap)
    }

    /// Replaces the map of contours, or takes it away, from the next start on.
    ///
    /// # Errors
    /// If the controller refuses. It has its old map then.
    pub fn upload_contours(
        &mut self,
        map: Option<&ContourMap>,
        mut progress: impl FnMut(usize),
    ) -> Result<(), ServiceError> {
        let bytes = map.map(ContourMap::bytes).unwrap_or_default();
        let too_large = ServiceError::Refused(Refusal::Store(StoreError::Map));
        let length = u32::try_from(bytes.len()).map_err(|_| too_large)?;
        self.change(Change::BeginContours { length, checksum: checksum(bytes) })?;
        for piece in bytes.chunks(CONTOUR_PIECE) {
            self.change(Change::ContourPiece(piece))?;
            progress(piece.len());
        }
        self.change(Change::FinishContours)
    }

    /// Tells the vehicle where it is.
    ///
    /// # Errors
    /// If the controller refuses.
    pub fn set_pose(&mut self, pose: Pose, deviations: [f64; 2]) -> Result<(), ServiceError> {
        self.change(Change::SetPose { pose: [pose.x, pose.y, pose.theta], deviations })
    }

    /// Forgets the last panic.
    ///
    /// # Errors
    /// If the controller refuses.
    pub fn forget_panic(&mut self) -> Result<(), ServiceError> {
        self.change(Change::ForgetPanic)
    }

    /// Starts the controller again.
    ///
    /// # Errors
    /// If the controller refuses.
    pub fn reboot(mut self) -> Result<(), ServiceError> {
        self.change(Change::Reboot)
    }
}
