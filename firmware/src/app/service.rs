//! The service port.
//!
//! Two connections at once, so that one that was left open locks nobody out. A connection whose next request is not whole
//! ten seconds after the last answer is closed, as is one that does not take an answer for as long: neither silence nor
//! single bytes hold it open. Requests are answered no faster than one in two milliseconds: whoever floods the port waits.

use agv_controller::BusEvent;
use agv_settings::patient_flash::PatientFlash;
use agv_settings::service::{Action, Controller, Frames, LONGEST_MESSAGE, Session};
use embassy_net::Stack;
use embassy_net::tcp::TcpSocket;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, Instant, Timer, with_deadline, with_timeout};

use super::exchange::{self, now};

/// How long a peer may take for a request, from the last answer on, and to take an answer.
const PATIENCE: Duration = Duration::from_secs(10);
/// Least time between answers.
const PACE: Duration = Duration::from_millis(2);

/// What both connections speak of.
pub type SharedController<F> = Mutex<CriticalSectionRawMutex, Controller<F>>;

/// What the board does when it is asked to.
#[derive(Clone, Copy)]
pub struct BoardActions {
    /// Forgets the last panic.
    pub forget_panic: fn(),
    /// Starts again.
    pub restart: fn() -> !,
}

/// Memory of a connection.
pub struct ServiceMemory {
    receive: [u8; 512],
    transmit: [u8; 512],
    read: [u8; 512],
    frames: Frames,
    room: [u8; LONGEST_MESSAGE],
}

impl ServiceMemory {
    /// Memory of a connection that has not begun.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            receive: [0; 512],
            transmit: [0; 512],
            read: [0; 512],
            frames: Frames::new(),
            room: [0; LONGEST_MESSAGE],
        }
    }
}

impl Default for ServiceMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// The connection is of no more use.
struct Gone;

/// Serves one connection after the other, for ever.
pub async fn run<F: PatientFlash>(
    stack: Stack<'static>,
    memory: &'static mut ServiceMemory,
    controller: &SharedController<F>,
    port: u16,
    actions: BoardActions,
) -> ! {
    let ServiceMemory { receive, transmit, read, frames, room } = memory;
    let mut socket = TcpSocket::new(stack, receive, transmit);
    socket.set_timeout(Some(PATIENCE));
    loop {
        socket.abort();
        // The reset is sent before the socket listens again.
        let _ = with_timeout(PATIENCE, socket.flush()).await;
        if socket.accept(port).await.is_err() {
            continue;
        }
        let _ = converse(&mut socket, read, frames, room, controller, actions).await;
    }
}

async fn converse<F: PatientFlash>(
    socket: &mut TcpSocket<'_>,
    read: &mut [u8],
    frames: &mut Frames,
    room: &mut [u8; LONGEST_MESSAGE],
    controller: &SharedController<F>,
    actions: BoardActions,
) -> Result<(), Gone> {
    let mut session = Session::new();
    frames.clear();
    let mut request_due = Instant::now() + PATIENCE;
    loop {
        let count = match with_deadline(request_due, socket.read(read)).await {
            Ok(Ok(count)) if count > 0 => count,
            _ => return Err(Gone),
        };
        let mut rest = read.get(..count).unwrap_or_default();
        while !rest.is_empty() {
            let (taken, is_whole) = frames.push(rest).map_err(|_| Gone)?;
            rest = rest.get(taken..).unwrap_or_default();
            if !is_whole {
                continue;
            }
            let (length, action) = {
                let mut controller = controller.lock().await;
                let is_standing = exchange::is_standing();
                session.answer(frames.message(), &mut controller, is_standing, now(), room).await.map_err(|_| Gone)?
            };
            frames.clear();
            send(socket, room.get(..length).unwrap_or_default()).await?;
            match action {
                Action::None => {}
                Action::SetPose(fix) => exchange::pass_on(BusEvent::SetPose(fix).into()),
                Action::ForgetPanic => (actions.forget_panic)(),
                Action::Reboot => {
                    let _ = with_timeout(PATIENCE, socket.flush()).await;
                    (actions.restart)()
                }
            }
            Timer::after(PACE).await;
            request_due = Instant::now() + PATIENCE;
        }
    }
}

async fn send(socket: &mut TcpSocket<'_>, mut bytes: &[u8]) -> Result<(), Gone> {
    let due = Instant::now() + PATIENCE;
    while !bytes.is_empty() {
        match with_deadline(due, socket.write(bytes)).await {
            Ok(Ok(count)) if count > 0 => bytes = bytes.get(count..).unwrap_or_default(),
            _ => return Err(Gone),
        }
    }
    Ok(())
}
