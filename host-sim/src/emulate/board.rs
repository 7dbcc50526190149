//! The controller's board, emulated by QEMU, with a firmware image.

use std::fs::File;
use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::run_delay::RunDelay;
use crate::bus::{BusError, SlcanBus};

/// Why the board does not run.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// The emulator cannot be started.
    #[error("qemu-system-arm cannot be started ({0}); apt-get install qemu-system-arm")]
    Emulator(io::Error),
    /// A file or a socket of the emulation fails.
    #[error(transparent)]
    Io(#[from] io::Error),
    /// It has ended, or was never heard of; with the emulator's last words.
    #[error("the emulated board has ended: {0}")]
    Ended(String),
    /// Its bus fails.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Ports of this machine that lead to the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ports {
    /// To its log stream.
    pub log: u16,
    /// To its service port.
    pub service: u16,
}

/// A board that runs. It ends when it is dropped.
pub struct Board {
    child: Child,
    folder: PathBuf,
    /// Where it can be reached.
    pub ports: Ports,
}

/// Address of the board in the emulator's network, and this machine's there.
pub const ADDRESS: [u8; 4] = [10, 0, 2, 15];
/// Address of this machine in the emulator's network.
pub const HOST: [u8; 4] = [10, 0, 2, 2];

/// File in the board's folder with what the emulator says.
const WORDS: &str = "qemu.txt";

/// How long the emulator may take to open its serial line.
const PATIENCE: Duration = Duration::from_secs(30);

/// How often ports are chosen again when another program took one before the emulator did.
const CHOICES: usize = 5;

impl Ports {
    /// Two ports of this machine that nobody listens to now.
    fn free() -> io::Result<Self> {
        let (log, service) =
            (TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?, TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?);
        Ok(Self { log: log.local_addr()?.port(), service: service.local_addr()?.port() })
    }
}

impl Board {
    /// Starts a board with `image` in `folder`, where it finds its flash as `flash.bin`. What it logs goes to `defmt.bin`
    /// there. Gives its bus, too.
    ///
    /// # Errors
    /// If there is no emulator, or it does not start.
    pub fn start(image: &Path, folder: &Path) -> Result<(Self, SlcanBus), BoardError> {
        Self::start_at(image, folder, Ports::free)
    }

    /// As [`Board::start`], at ports that `choose` gives. It is asked again if another program has taken one of them.
    ///
    /// # Errors
    /// As [`Board::start`], and those of `choose`.
    pub fn start_at(
        image: &Path,
        folder: &Path,
        mut choose: impl FnMut() -> io::Result<Ports>,
    ) -> Result<(Self, SlcanBus), BoardError> {
        for _ in 1..CHOICES {
            match Self::start_once(image, folder, choose()?) {
                Err(BoardError::Ended(words)) if words.contains("host forwarding") => {}
                outcome => return outcome,
            }
        }
        Self::start_once(image, folder, choose()?)
    }

    fn start_once(image: &Path, folder: &Path, ports: Ports) -> Result<(Self, SlcanBus), BoardError> {
        let serial = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let [a, b, c, d] = ADDRESS;
        let forward = |port, guest| format!("hostfwd=tcp:127.0.0.1:{port}-{a}.{b}.{c}.{d}:{guest}");
        let nic = format!("user,model=lan9118,{},{}", forward(ports.log, 5350), forward(ports.service, 5351));
        let child = Command::new("qemu-system-arm")
            .args(["-M", "mps2-an500", "-display", "none", "-monitor", "none"])
            .arg("-serial")
            .arg(format!("tcp:{}", serial.local_addr()?))
            .arg("-nic")
            .arg(nic)
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(image)
            .current_dir(folder)
            .stdin(Stdio::null())
            .stdout(File::create(folder.join("defmt.bin"))?)
            .stderr(File::create(folder.join(WORDS))?)
            .spawn()
            .map_err(BoardError::Emulator)?;
        let mut board = Self { child, folder: folder.to_owned(), ports };
        let Some(stream) = board.accept(&serial)? else {
            return Err(board.ended());
        };
        Ok((board, SlcanBus::accept(stream)?))
    }

    /// The error of this board, which has ended.
    pub(super) fn ended(&self) -> BoardError {
        let said = std::fs::read(self.folder.join(WORDS)).unwrap_or_default();
        let last = String::from_utf8_lossy(&said).trim().lines().next_back().map(str::to_owned);
        BoardError::Ended(last.unwrap_or_else(|| "without a word".into()))
    }

    fn accept(&mut self, serial: &TcpListener) -> io::Result<Option<TcpStream>> {
        serial.set_nonblocking(true)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match serial.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    return Ok(Some(stream));
                }
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(error),
                Err(_) if !self.is_running() || Instant::now() > deadline => return Ok(None),
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    }

    /// How long the machine keeps the emulator waiting, from now on.
    #[must_use]
    pub fn run_delay(&self) -> RunDelay {
        RunDelay::of(self.child.id())
    }

    /// Whether it still runs.
    pub fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
