//! Everything that is set on commissioning, but for the map.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::maps::Landmark;
use agv_core::odometry::MOST_COUNTERS;
use agv_wire::can::encoder::CodeSequence;
use agv_wire::can::gyro::GyroFrame;
use agv_wire::can::motion_frames::MotionFrames;

use crate::gyro_connection::GyroConnection;
use crate::laser::LaserSettings;
use crate::map_identity::map_identity;
use crate::vehicle::VehicleSettings;

/// Everything that is set on commissioning, but for the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What the localiser believes of its vehicle and its sensors. Its vehicle is that of [`Self::vehicle`].
    pub parameters: Parameters,
    /// The vehicle's kind and measures.
    pub vehicle: VehicleSettings,
    /// Who is who on the CAN bus.
    pub nodes: Nodes,
    /// Time between positions of the encoders, or between reports of the vehicle's own controller, ms.
    pub encoder_period: u16,
    /// Time between poses on the CAN bus, ms.
    pub publishing_period: u16,
    /// Bit rate of the CAN bus, kbit/s.
    pub bit_rate: u16,
    /// Where the gyro is connected, if there is one.
    pub gyro_connection: GyroConnection,
    /// Where the rates of the gyro are on the CAN bus, if it is there.
    pub gyro_frame: GyroFrame,
    /// Where the vehicle's own controller says how it moves, if it does.
    pub motion_frames: MotionFrames,
    /// Who is who on the network.
    pub network: Network,
    /// What the NAV350 is asked for.
    pub laser: LaserSettings,
    /// Whether a vehicle that does not know where it is searches its pose among the reflectors of its map.
    pub start_search: bool,
    /// Which map it must be, see [`map_identity`]; 0 for any.
    pub map_identity: u32,
}

/// Numbers of the nodes on the CAN bus, 1 to 127, and who is in charge there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nodes {
    /// This controller.
    pub controller: u8,
    /// The encoders, in the order of [`agv_core::odometry::Vehicle::counters`]; as many as the vehicle has count.
    pub encoders: [EncoderNode; MOST_COUNTERS],
    /// Who has made the vehicle's controller, as CAN in Automation numbers makers; 0 for nobody.
    pub vendor: u32,
    /// Whether this controller is the NMT master; else it starts no nodes, and only listens to the encoders.
    pub is_master: bool,
    /// Whether this controller becomes operational without being told to.
    pub starts_itself: bool,
    /// Whether settings can be changed over the bus while the vehicle stands.
    pub accepts_settings: bool,
    /// Whether a pose that comes over the bus is believed while the vehicle stands.
    pub accepts_pose: bool,
}

/// Who tells a counter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EncoderNode {
    /// Its node.
    pub node: u8,
    /// Its profile: 406 for an encoder, 402 for a drive.
    pub profile: u16,
    /// Which way it shall count. None takes it as it is.
    pub code_sequence: Option<CodeSequence>,
}

/// Addresses on the network, IPv4.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Network {
    /// This controller.
    pub address: [u8; 4],
    /// Length of the network's prefix, bits.
    pub prefix: u8,
    /// The way to other networks.
    pub gateway: [u8; 4],
    /// The NAV350.
    pub laser: [u8; 4],
    /// Its port.
    pub laser_port: u16,
    /// Port of the log stream.
    pub log_port: u16,
    /// Port of the service.
    pub service_port: u16,
}

impl Default for Settings {
    /// The vehicle of the standard simulated world, and the NAV350's factory address. A vehicle that was not set up has
    /// no map either, so it never claims to know where it is.
    fn default() -> Self {
        Self::of(Parameters::new(VehicleSettings::default().vehicle(), Pose::new(0.9, 0.0, 0.0)))
    }
}

impl Settings {
    /// Lets the localiser believe in the vehicle of [`Self::vehicle`].
    // One copy: each of its measures has a leaf that calls it.
    #[inline(never)]
    pub(crate) fn take_vehicle(&mut self) {
        self.parameters.vehicle = self.vehicle.vehicle();
    }

    /// The default settings, but for the localiser's parameters.
    #[must_use]
    pub fn of(parameters: Parameters) -> Self {
        Self {
            parameters,
            vehicle: VehicleSettings::of(&parameters.vehicle),
            nodes: Nodes {
                controller: 16,
                encoders: [1, 2, 3, 4].map(|node| EncoderNode { node, profile: 406, code_sequence: None }),
                vendor: 0,
                is_master: true,
                starts_itself: true,
                accepts_pose: false,
                accepts_settings: false,
            },
            encoder_period: 10,
            publishing_period: 10,
            bit_rate: 500,
            gyro_connection: GyroConnection::Can,
            gyro_frame: GyroFrame::USUAL,
            motion_frames: MotionFrames::USUAL,
            network: Network {
                address: [192, 168, 1, 20],
                prefix: 24,
                gateway: [192, 168, 1, 1],
                laser: [192, 168, 1, 10],
                laser_port: 2112,
                log_port: 5350,
                service_port: 5351,
            },
            laser: LaserSettings::default(),
            start_search: true,
            map_identity: 0,
        }
    }

    /// Whether it is the map that it must be.
    #[must_use]
    pub fn accepts_map(&self, landmarks: &[Landmark]) -> bool {
        self.map_identity == 0 || self.map_identity == map_identity(landmarks)
    }
}
