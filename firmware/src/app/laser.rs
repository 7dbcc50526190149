//! The NAV350 over TCP.

use agv_controller::{Laser, TELEGRAM};
use agv_settings::Network;
use agv_wire::nav350::{Configuration, Revolution, Step};
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
    /// The session.
    pub laser: Laser<TELEGRAM>,
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
    pub fn new(configuration: Configuration) -> Self {
        Self { laser: Laser::new(configuration), receive: [0; 8192], transmit: [0; 1024], read: [0; 1024] }
    }
}

/// Asks the sensor for its revolutions for ever.
pub async fn run(
    stack: Stack<'static>,
    memory: &'static mut LaserMemory,
    mut revolutions: RevolutionSender,
    network: &Network,
) -> ! {
    let LaserMemory { laser, receive, transmit, read } = memory;
    let [a, b, c, d] = network.laser;
    let endpoint = IpEndpoint::new(IpAddress::v4(a, b, c, d), network.laser_port);
    let mut socket = TcpSocket::new(stack, receive, transmit);
    socket.set_nagle_enabled(false);
    let mut is_open = false;
    loop {
        let revolution = revolutions.send().await;
        next(laser, &mut socket, &mut is_open, endpoint, read, revolution).await;
        revolutions.send_done();
    }
}

/// Holds the session until a revolution is complete.
async fn next(
    laser: &mut Laser<TELEGRAM>,
    socket: &mut TcpSocket<'_>,
    is_open: &mut bool,
    endpoint: IpEndpoint,
    read: &mut [u8],
    revolution: &mut Revolution,
) {
    loop {
        exchange::set_laser(laser.watch());
        if let Some(speed) = exchange::newest_laser_speed() {
            laser.set_speed(speed);
        }
        match laser.poll(now(), revolution) {
            Step::Revolution => {
                exchange::set_laser(laser.watch());
                return;
            }
            Step::Connect => {
                socket.abort();
                *is_open = matches!(with_timeout(CONNECT, socket.connect(endpoint)).await, Ok(Ok(())));
                if *is_open {
                    laser.connected(now());
                } else {
                    laser.unreachable();
                }
            }
            Step::Disconnect(reason) => {
                *is_open = false;
                socket.abort();
                defmt::warn!("nav350: {}", defmt::Display2Format(&reason));
            }
            Step::Send(bytes) => {
                let is_sent = *is_open && send(socket, bytes).await;
                if !is_sent {
                    *is_open = false;
                    laser.unreachable();
                }
            }
            Step::Report(report) => {
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
                        receive(laser, read.get(..count).unwrap_or_default());
                    }
                    Either::First(_) => {
                        *is_open = false;
                        laser.unreachable();
                    }
                    Either::Second(()) => {}
                }
            }
        }
    }
}

/// Sends all of the bytes; false if they do not leave in time.
async fn send(socket: &mut TcpSocket<'_>, bytes: &[u8]) -> bool {
    let mut rest = bytes;
    while !rest.is_empty() {
        match with_timeout(SEND, socket.write(rest)).await {
            Ok(Ok(count)) if count > 0 => rest = rest.get(count..).unwrap_or_default(),
            _ => return false,
        }
    }
    true
}

/// Gives the session what has come.
fn receive(laser: &mut Laser<TELEGRAM>, bytes: &[u8]) {
    let mut rest = bytes;
    let time = now();
    while !rest.is_empty() {
        // A telegram is shorter than the session's room, so it always takes some.
        let taken = laser.receive(rest, time);
        rest = rest.get(taken..).unwrap_or_default();
    }
}
