//! The pose for other programs of the machine: a line of JSON for each one that was published, as datagrams and on a socket of Unix.

use std::io::{ErrorKind, Write};
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use agv_core::integrity::{Alarm, AlertLimits};
use agv_core::state::{Mode, PoseOutput, ProtectionLevel};
use serde::Serialize;

use super::exchange::Exchange;
use crate::drive::{mode_name, reason_name};
use crate::sync::queue::{Closed, Receiver};

/// Waits are cut into pieces of this length, so that everything can end.
const LOOK: Duration = Duration::from_millis(20);
/// Listeners at once.
const LISTENERS: usize = 16;

/// What a line says. A number that has no bound is `null`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseLine {
    /// When the pose is true, by the controller's clock, s.
    pub time_s: f64,
    /// Position of R in W, m.
    pub x_m: f64,
    /// The same.
    pub y_m: f64,
    /// Heading of R in W, rad.
    pub heading_rad: f64,
    /// Covariance: xx, xy, yy (m²), x heading, y heading (m rad), heading (rad²).
    pub covariance: [f64; 6],
    /// Protection level of the position, m.
    pub level_m: Option<f64>,
    /// Protection level of the heading, rad.
    pub level_rad: Option<f64>,
    /// What the pose must not be used for: `none`, `docking`, `travel` or `no_pose`.
    pub alarm: Alarm,
    /// What the pose rests on, in words.
    pub mode: &'static str,
    /// Why it is no better, in words; empty if there is nothing to say.
    pub reason: &'static str,
    /// Distance travelled since a landmark last corrected the pose, m.
    pub dead_reckoning_m: f64,
}

/// The levels of the position, m, and of the heading, rad. Where nothing is bounded there is none, nor has a vehicle one that does not
/// know where it is.
pub(super) fn levels(output: &PoseOutput) -> [Option<f64>; 2] {
    let ProtectionLevel { position, heading } = ProtectionLevel::UNBOUNDED;
    let is_known = !matches!(output.mode, Mode::NotLocalised | Mode::Lost);
    let bounded = |level: f64| (is_known && level < position.min(heading)).then_some(level);
    [bounded(output.level.position), bounded(output.level.heading)]
}

impl PoseLine {
    /// What is said of a pose of a vehicle that can live with these limits.
    #[must_use]
    pub fn of(output: &PoseOutput, limits: &AlertLimits) -> Self {
        let [level_m, level_rad] = levels(output);
        Self {
            time_s: output.time.seconds(),
            x_m: output.pose.x,
            y_m: output.pose.y,
            heading_rad: output.pose.theta,
            covariance: output.covariance,
            level_m,
            level_rad,
            alarm: limits.alarm(output.mode, &output.level),
            mode: mode_name(output.mode),
            reason: reason_name(output.reason),
            dead_reckoning_m: output.dead_reckoning_distance,
        }
    }
}

/// Why poses cannot be told.
#[derive(Debug, thiserror::Error)]
pub enum PoseSinkError {
    /// No datagrams can be sent.
    #[error("poses cannot be sent as datagrams: {0}")]
    Datagrams(std::io::Error),
    /// The socket cannot be made.
    #[error("{}: {source}", path.display())]
    Socket {
        /// Its path.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
}

/// Who is told.
#[derive(Debug)]
pub(super) struct PoseSinks {
    datagrams: Option<(UdpSocket, Vec<SocketAddr>)>,
    listener: Option<UnixListener>,
    listeners: Vec<(UnixStream, Vec<u8>)>,
}

impl PoseSinks {
    /// Datagrams to these addresses, and a socket of Unix at that path, if there is one. What is left there of an earlier start goes.
    ///
    /// # Errors
    /// If the operating system refuses.
    pub fn new(datagrams: &[SocketAddr], socket: Option<&Path>) -> Result<Self, PoseSinkError> {
        let datagrams = if datagrams.is_empty() {
            None
        } else {
            let sender = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0)).map_err(PoseSinkError::Datagrams)?;
            sender.set_nonblocking(true).map_err(PoseSinkError::Datagrams)?;
            Some((sender, datagrams.to_vec()))
        };
        let bind = |path: &Path| {
            // A socket that nobody listens to is of no use; anything else stays, and is refused.
            if UnixStream::connect(path).is_err_and(|error| error.kind() == ErrorKind::ConnectionRefused) {
                let _ = std::fs::remove_file(path);
            }
            let listener = UnixListener::bind(path)?;
            listener.set_nonblocking(true)?;
            Ok(listener)
        };
        let open = |path: &Path| bind(path).map_err(|source| PoseSinkError::Socket { path: path.to_owned(), source });
        let listener = socket.map(open).transpose()?;
        Ok(Self { datagrams, listener, listeners: Vec::new() })
    }

    /// Tells the poses that come until everything ends.
    pub fn run(mut self, poses: Receiver<PoseOutput>, limits: &AlertLimits, exchange: &Exchange) {
        while !exchange.is_over() {
            match poses.wait(Instant::now() + LOOK) {
                Ok(Some(output)) => self.tell(&PoseLine::of(&output, limits)),
                Ok(None) => {}
                Err(Closed) => return,
            }
            self.accept();
        }
    }

    fn accept(&mut self) {
        let Some(listener) = self.listener.as_ref().filter(|_| self.listeners.len() < LISTENERS) else { return };
        if let Ok((stream, _)) = listener.accept()
            && stream.set_nonblocking(true).is_ok()
        {
            self.listeners.push((stream, Vec::new()));
        }
    }

    fn tell(&mut self, line: &PoseLine) {
        if self.datagrams.is_none() && self.listeners.is_empty() {
            return;
        }
        let Ok(mut bytes) = serde_json::to_vec(line) else { return };
        bytes.push(b'\n');
        if let Some((sender, addresses)) = &self.datagrams {
            for address in addresses {
                // A datagram that does not leave is lost, as any may be.
                let _ = sender.send_to(&bytes, address);
            }
        }
        self.listeners.retain_mut(|(stream, rest)| {
            // Who is slow misses whole lines.
            if rest.is_empty() {
                rest.extend_from_slice(&bytes);
            }
            match stream.write(rest) {
                Ok(count) => {
                    rest.drain(..count);
                    true
                }
                Err(error) => matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted),
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use agv_core::geometry::Pose;
    use agv_core::localizer::{Localizer, Parameters};
    use agv_core::odometry::Vehicle;

    use super::*;

    #[test]
    fn only_who_knows_where_it_is_has_a_level() {
        let localizer: Box<Localizer> = Box::new(Localizer::new(Parameters::new(Vehicle::Increments, Pose::default())));
        let mut output = localizer.outputs().pose;
        for mode in [Mode::Reflectors, Mode::DeadReckoning, Mode::Degraded, Mode::WithoutOdometry] {
            (output.mode, output.level.position, output.level.heading) = (mode, 0.02, 0.001);
            assert_eq!(levels(&output), [Some(0.02), Some(0.001)], "{mode:?}");
            output.level = ProtectionLevel::UNBOUNDED;
            assert_eq!(levels(&output), [None, None], "{mode:?}");
        }
        for mode in [Mode::Lost, Mode::NotLocalised] {
            (output.mode, output.level.position, output.level.heading) = (mode, 8_579.035, 0.5);
            assert_eq!(levels(&output), [None, None], "{mode:?}");
        }
    }
}
