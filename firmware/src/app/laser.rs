//! The NAV350 over TCP.

use agv_core::wire::nav350::{Configuration, Revolution, Session, Step};
use agv_settings::Network;
use embassy_futures::select::{Either, select};
use embassy_net::tcp::TcpSocket;
use embassy_net::{IpAddress, IpEndpoint, Stack};
use embassy_time::{Duration, Instant, Timer, with_timeout};

use super::exchange::{self, RevolutionSender, now};

/// How long a connection may take.
const CONNECT: Duration = Duration::from_secs(5);
/// How long bytes may wait to be sent.
const SEND: Duration = Duration::from_secs(1);

/// Memory of the connection.
pub struct LaserMemory {
    /// The session, with room for the longest telegram of a revolution with 1440 beams, in either dialect.
    pub session: Session<{ 18 * 1024 }>,
    /// Received bytes; the sensor may send no more than this ahead, which is less than the Ethernet controller holds.
    pub receive: [u8; 8192],
    /// Bytes to send.
    pub transmit: [u8; 1024],
    /// What was read at once.
    pub read: [u8; 1024],
}

impl LaserMemory {
    /// Memory of a connection that has not begun.
    #[must_use]
    pub fn new() -> Self {
        let session = Session::new(Configuration::default());
        Self { session, receive: [0; 8192], transmit: [0; 1024], read: [0; 1024] }
    }
}

impl Default for LaserMemory {
    fn default() -> Self {
        Self::new()
    }
}

/// Asks the sensor for its revolutions for ever.
pub async fn run(
    stack: Stack<'static>,
    memory: &'static mut LaserMemory,
    mut revolutions: RevolutionSender,
    network: &Network,
) -> ! {
    let LaserMemory { session, receive, transmit, read } = memory;
    let [a, b, c, d] = network.laser;
    let endpoint = IpEndpoint::new(IpAddress::v4(a, b, c, d), network.laser_port);
    let mut socket = TcpSocket::new(stack, receive, transmit);
    socket.set_nagle_enabled(false);
    let mut is_open = false;
    loop {
        let revolution = revolutions.send().await;
        next(session, &mut socket, &mut is_open, endpoint, read, revolution).await;
        exchange::laser_has_measured();
        revolutions.send_done();
    }
}

/// Holds the session until a revolution is complete.
async fn next(
    session: &mut Session<{ 18 * 1024 }>,
    socket: &mut TcpSocket<'_>,
    is_open: &mut bool,
    endpoint: IpEndpoint,
    read: &mut [u8],
    revolution: &mut Revolution,
) {
    loop {
        match session.poll(now(), revolution) {
            Step::Revolution => return,
            Step::Connect => {
                socket.abort();
                *is_open = matches!(with_timeout(CONNECT, socket.connect(endpoint)).await, Ok(Ok(())));
                if *is_open {
                    session.connected(now());
                } else {
                    exchange::laser_is_unreachable();
                    session.closed();
                }
            }
            Step::Disconnect(reason) => {
                *is_open = false;
                socket.abort();
                exchange::laser_was_lost(reason);
                defmt::warn!("nav350: {}", defmt::Display2Format(&reason));
            }
            Step::Send(bytes) => {
                let mut rest = bytes;
                let mut is_sent = *is_open;
                while is_sent && !rest.is_empty() {
                    match with_timeout(SEND, socket.write(rest)).await {
                        Ok(Ok(count)) if count > 0 => rest = rest.get(count..).unwrap_or_default(),
                        _ => is_sent = false,
                    }
                }
                if !is_sent {
                    *is_open = false;
                    exchange::laser_is_unreachable();
                    session.closed();
                }
            }
            Step::Report(report) => {
                exchange::laser_has_reported(report);
                defmt::info!("nav350: {}", defmt::Display2Format(&report));
            }
            Step::Wait(until) => {
                let alarm = Timer::at(Instant::from_micros(until.micros()));
                if !*is_open {
                    alarm.await;
                    continue;
                }
                match select(socket.read(read), alarm).await {
                    Either::First(Ok(count)) if count > 0 => {
                        let mut rest = read.get(..count).unwrap_or_default();
                        let time = now();
                        while !rest.is_empty() {
                            // A telegram is shorter than the session's room, so it always takes some.
                            let taken = session.receive(rest, time);
                            rest = rest.get(taken..).unwrap_or_default();
                        }
                    }
                    Either::First(_) => {
                        *is_open = false;
                        exchange::laser_is_unreachable();
                        session.closed();
                    }
                    Either::Second(()) => {}
                }
            }
        }
    }
}
