//! The controller's board, emulated by QEMU, with a firmware image.

use std::fs::File;
use std::io;
use std::net::{Ipv4Addr, TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

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
    /// It has ended, or was never heard of.
    #[error("the emulated board has ended; see qemu.txt in its folder")]
    Ended,
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
    /// Where it can be reached.
    pub ports: Ports,
}

/// Address of the board in the emulator's network, and this machine's there.
pub const ADDRESS: [u8; 4] = [10, 0, 2, 15];
/// Address of this machine in the emulator's network.
pub const HOST: [u8; 4] = [10, 0, 2, 2];

/// How long the emulator may take to open its serial line.
const PATIENCE: Duration = Duration::from_secs(30);

/// A port of this machine that nobody listens to.
fn free_port() -> io::Result<u16> {
    Ok(TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?.local_addr()?.port())
}

impl Board {
    /// Starts a board with `image` in `folder`, where it finds its flash as `flash.bin`. What it logs goes to `defmt.bin`
    /// there. Gives its bus, too.
    ///
    /// # Errors
    /// If there is no emulator, or it does not start.
    pub fn start(image: &Path, folder: &Path) -> Result<(Self, SlcanBus), BoardError> {
        let ports = Ports { log: free_port()?, service: free_port()? };
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
            .stderr(File::create(folder.join("qemu.txt"))?)
            .spawn()
            .map_err(BoardError::Emulator)?;
        let mut board = Self { child, ports };
        let stream = board.accept(&serial)?;
        Ok((board, SlcanBus::accept(stream)?))
    }

    fn accept(&mut self, serial: &TcpListener) -> Result<TcpStream, BoardError> {
        serial.set_nonblocking(true)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match serial.accept() {
                Ok((stream, _)) => {
                    stream.set_nonblocking(false)?;
                    return Ok(stream);
                }
                Err(error) if error.kind() != io::ErrorKind::WouldBlock => return Err(error.into()),
                Err(_) if !self.is_running() || Instant::now() > deadline => return Err(BoardError::Ended),
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        }
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
