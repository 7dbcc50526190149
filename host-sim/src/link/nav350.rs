//! A NAV350 over TCP.

use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

use agv_core::measurement::Time;
use agv_wire::cola::{CommandWord, Deframed, Deframer, Dialect, ReadError, Telegram};
use agv_wire::nav350::{Answer, Configuration, LostReason, Report, Request, Revolution, SensorSpeed, Session, Step};

use super::clock::Clock;

/// Port that the sensor listens on if none is stated.
pub const PORT: u16 = 2112;

/// Waits are cut into pieces of this length, so that a caller can stop.
const LONGEST_WAIT: Duration = Duration::from_millis(50);

/// `host` with the usual port if it states none.
#[must_use]
pub fn address(host: &str) -> String {
    super::with_port(host, PORT)
}

/// What happened on the link.
#[derive(Clone, Copy, Debug)]
pub enum Happening<'a> {
    /// The connection is open.
    Connected,
    /// These bytes were sent.
    Sent(&'a [u8]),
    /// These bytes arrived.
    Received(&'a [u8]),
    /// A revolution arrived.
    Revolution(&'a Revolution),
    /// Something worth telling.
    Report(Report),
    /// The connection was given up; it will be tried again.
    Lost(LostReason),
}

/// Holds a session with a sensor over TCP.
pub struct Link {
    address: String,
    clock: Clock,
    session: Box<Session>,
    revolution: Box<Revolution>,
    stream: Option<TcpStream>,
    buffer: Vec<u8>,
    connect_timeout: Duration,
}

impl Link {
    /// A link to `address`, which has a port. Nothing is opened yet.
    #[must_use]
    pub fn new(address: &str, configuration: Configuration, clock: Clock) -> Self {
        Self {
            address: address.to_owned(),
            clock,
            session: Box::new(Session::new(configuration)),
            revolution: Box::default(),
            stream: None,
            buffer: vec![0; 1 << 16],
            connect_timeout: Duration::from_secs_f64(configuration.connect_timeout),
        }
    }

    /// The session's clock.
    #[must_use]
    pub const fn clock(&self) -> &Clock {
        &self.clock
    }

    /// The session.
    #[must_use]
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Tells the sensor how fast it moves.
    pub fn set_speed(&mut self, speed: SensorSpeed) {
        self.session.set_speed(speed);
    }

    /// Does what there is to do until `until`, and tells what happens. Failures of the network are part of the
    /// session, never an end of it.
    ///
    /// # Errors
    /// What `see` returns; the session then stops where it is.
    pub fn run<E>(&mut self, until: Time, mut see: impl FnMut(Time, Happening) -> Result<(), E>) -> Result<(), E> {
        loop {
            let now = self.clock.now();
            // What has arrived is looked at to the end.
            match self.session.poll(now, &mut self.revolution) {
                Step::Wait(_) if now >= until => return Ok(()),
                Step::Connect => {
                    self.stream = connect(&self.address, self.connect_timeout).ok();
                    let now = self.clock.now();
                    if self.stream.is_some() {
                        self.session.connected(now);
                        see(now, Happening::Connected)?;
                    } else {
                        self.session.closed();
                    }
                }
                Step::Disconnect(reason) => {
                    self.stream = None;
                    see(now, Happening::Lost(reason))?;
                }
                Step::Send(bytes) => {
                    see(now, Happening::Sent(bytes))?;
                    let is_sent = self.stream.as_mut().is_some_and(|stream| stream.write_all(bytes).is_ok());
                    if !is_sent {
                        self.stream = None;
                        self.session.closed();
                    }
                }
                Step::Revolution => see(now, Happening::Revolution(&self.revolution))?,
                Step::Report(report) => see(now, Happening::Report(report))?,
                Step::Wait(time) => {
                    let patience = self.clock.until(time.min(until)).min(LONGEST_WAIT);
                    self.wait(patience, &mut see)?;
                }
            }
        }
    }

    fn wait<E>(&mut self, patience: Duration, see: &mut impl FnMut(Time, Happening) -> Result<(), E>) -> Result<(), E> {
        // A time-out of zero would mean none at all.
        let patience = patience.max(Duration::from_micros(100));
        let Some(stream) = &mut self.stream else {
            std::thread::sleep(patience);
            return Ok(());
        };
        let outcome = stream.set_read_timeout(Some(patience)).and_then(|()| stream.read(&mut self.buffer));
        let now = self.clock.now();
        match outcome {
            Ok(count) if count > 0 => {
                see(now, Happening::Received(&self.buffer[..count]))?;
                let mut rest = &self.buffer[..count];
                while !rest.is_empty() {
                    let taken = self.session.receive(rest, now);
                    rest = &rest[taken..];
                    // The session makes room while it is polled.
                    while !rest.is_empty() {
                        match self.session.poll(now, &mut self.revolution) {
                            Step::Revolution => see(now, Happening::Revolution(&self.revolution))?,
                            Step::Report(report) => see(now, Happening::Report(report))?,
                            Step::Send(bytes) => {
                                see(now, Happening::Sent(bytes))?;
                                if stream.write_all(bytes).is_err() {
                                    self.session.closed();
                                    return Ok(());
                                }
                            }
                            Step::Disconnect(reason) => {
                                self.stream = None;
                                return see(now, Happening::Lost(reason));
                            }
                            Step::Wait(_) | Step::Connect => break,
                        }
                    }
                }
            }
            Err(error) if is_timeout(&error) => {}
            Ok(_) | Err(_) => {
                self.stream = None;
                self.session.closed();
            }
        }
        Ok(())
    }
}

fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut | io::ErrorKind::Interrupted)
}

fn connect(address: &str, timeout: Duration) -> io::Result<TcpStream> {
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for socket in address.to_socket_addrs()? {
        match TcpStream::connect_timeout(&socket, timeout) {
            Ok(stream) => {
                // Requests are short and must not wait for each other.
                stream.set_nodelay(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}

/// Why a question to a sensor failed.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The network failed.
    #[error("{address}: {source}")]
    Io {
        /// The sensor.
        address: String,
        /// What the operating system says.
        source: io::Error,
    },
    /// No answer came.
    #[error("{address}: the sensor does not answer to {question}")]
    NoAnswer {
        /// The sensor.
        address: String,
        /// What was asked.
        question: String,
    },
    /// An answer came that cannot be read.
    #[error("{address}: the answer to {question} cannot be read: {problem:?}")]
    Undecodable {
        /// The sensor.
        address: String,
        /// What was asked.
        question: String,
        /// What is wrong with it.
        problem: ReadError,
    },
    /// The request cannot be written.
    #[error("{question} does not fit into a telegram")]
    Request {
        /// What was asked.
        question: String,
    },
}

/// Asks a sensor one thing after the other, without a session.
pub struct Client {
    address: String,
    stream: TcpStream,
    dialect: Dialect,
    deframer: Box<Deframer>,
}

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(5);

impl Client {
    /// Connects to `address`, which has a port, and finds the dialect.
    ///
    /// # Errors
    /// If there is no connection, or no answer in either dialect.
    pub fn connect(address: &str) -> Result<Self, ClientError> {
        let io = |source| ClientError::Io { address: address.to_owned(), source };
        let stream = connect(address, PATIENCE).map_err(io)?;
        let dialect = Dialect::Binary;
        let mut client = Self { address: address.to_owned(), stream, dialect, deframer: Box::default() };
        let identity = Request::Read(agv_wire::nav350::Variable::DeviceIdent);
        if client.ask(&identity, Duration::from_secs(1), |_| true).is_err() {
            client.dialect = Dialect::Ascii;
            client.ask(&identity, PATIENCE, |_| true)?;
        }
        Ok(client)
    }

    /// The dialect that the sensor speaks.
    #[must_use]
    pub const fn dialect(&self) -> Dialect {
        self.dialect
    }

    /// Asks, and gives the answer to `take`: the result of a method, not that it was accepted.
    ///
    /// # Errors
    /// If the network fails or no answer comes.
    pub fn call<T>(&mut self, request: &Request, mut take: impl FnMut(&Answer) -> T) -> Result<T, ClientError> {
        let mut taken = None;
        self.ask(request, PATIENCE, |answer| {
            if !matches!(answer, Answer::Accepted(_)) {
                taken = Some(take(answer));
            }
            taken.is_some()
        })?;
        taken.ok_or_else(|| self.no_answer(request))
    }

    fn no_answer(&self, request: &Request) -> ClientError {
        ClientError::NoAnswer { address: self.address.clone(), question: name(request) }
    }

    fn ask(
        &mut self,
        request: &Request,
        patience: Duration,
        mut take: impl FnMut(&Answer) -> bool,
    ) -> Result<(), ClientError> {
        let io = |source| ClientError::Io { address: self.address.clone(), source };
        let mut buffer = vec![0; 1 << 16];
        let length =
            request.encode(self.dialect, &mut buffer).map_err(|_| ClientError::Request { question: name(request) })?;
        self.stream.write_all(&buffer[..length]).map_err(io)?;
        let start = std::time::Instant::now();
        while let Some(rest) = patience.checked_sub(start.elapsed()).filter(|rest| !rest.is_zero()) {
            self.stream.set_read_timeout(Some(rest)).map_err(io)?;
            let count = match self.stream.read(&mut buffer) {
                Ok(0) => return Err(self.no_answer(request)),
                Ok(count) => count,
                Err(error) if is_timeout(&error) => continue,
                Err(error) => return Err(io(error)),
            };
            let mut bytes = &buffer[..count];
            while !bytes.is_empty() {
                let taken = self.deframer.extend(bytes);
                bytes = &bytes[taken..];
                while let Some(found) = self.deframer.next() {
                    let Deframed::Telegram { dialect, payload, .. } = found else { continue };
                    let is_asked = Telegram::parse(dialect, payload)
                        .is_ok_and(|telegram| telegram.name == name(request) || telegram.command == CommandWord::Fault);
                    // What answers an older question comes late, and is none to this one.
                    if !is_asked {
                        continue;
                    }
                    let answer = Answer::decode(dialect, payload).map_err(|problem| ClientError::Undecodable {
                        address: self.address.clone(),
                        question: name(request),
                        problem,
                    })?;
                    self.dialect = dialect;
                    if take(&answer) {
                        return Ok(());
                    }
                }
            }
        }
        Err(self.no_answer(request))
    }
}

fn name(request: &Request) -> String {
    match request {
        Request::Read(variable) => variable.name(),
        Request::ReadOther(name) => name,
        Request::Write(setting) => setting.variable().name(),
        Request::Call(method) => method.name().name(),
    }
    .to_owned()
}
