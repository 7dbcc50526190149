//! Everything that is set on commissioning, but for the map.

use agv_core::geometry::Pose;
use agv_core::localizer::Parameters;
use agv_core::odometry::{CounterRange, Tricycle, Vehicle};
use agv_wire::can::gyro::GyroFrame;

/// Everything that is set on commissioning, but for the map.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// What the localiser believes of its vehicle and its sensors.
    pub parameters: Parameters,
    /// Who is who on the CAN bus.
    pub nodes: Nodes,
    /// Time between positions of the encoders, ms.
    pub encoder_period: u16,
    /// Time between poses on the CAN bus, ms.
    pub publishing_period: u16,
    /// Bit rate of the CAN bus, kbit/s.
    pub bit_rate: u16,
    /// Where the rates of the gyro are on the CAN bus, if there is a gyro.
    pub gyro_frame: GyroFrame,
    /// Who is who on the network.
    pub network: Network,
    /// Whether a vehicle that does not know where it is searches its pose among the reflectors of its map.
    pub start_search: bool,
}

/// Numbers of the nodes on the CAN bus, 1 to 127, and who is in charge there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Nodes {
    /// This controller.
    pub controller: u8,
    /// The driving wheel's encoder.
    pub drive: u8,
    /// The steering's encoder.
    pub steering: u8,
    /// Profile of the driving wheel's encoder: 406, or 402 for the drive itself.
    pub drive_profile: u16,
    /// The same of the steering's encoder.
    pub steering_profile: u16,
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
        let vehicle = Tricycle {
            wheelbase: 1.5,
            drive_scale: 1e-4,
            drive_range: CounterRange::BITS_32,
            steering_scale: core::f64::consts::TAU / 65_536.0,
            steering_range: CounterRange::BITS_16,
            steering_offset_forward: 0.0,
            steering_offset_backward: 0.0,
        };
        Self::of(Parameters::new(Vehicle::Tricycle(vehicle), Pose::new(0.9, 0.0, 0.0)))
    }
}

impl Settings {
    /// The default settings, but for the localiser's parameters.
    #[must_use]
    pub fn of(parameters: Parameters) -> Self {
        Self {
            parameters,
            nodes: Nodes {
                controller: 16,
                drive: 1,
                steering: 2,
                drive_profile: 406,
                steering_profile: 406,
                vendor: 0,
                is_master: true,
                starts_itself: true,
                accepts_pose: false,
                accepts_settings: false,
            },
            encoder_period: 10,
            publishing_period: 10,
            bit_rate: 500,
            gyro_frame: GyroFrame::USUAL,
            network: Network {
                address: [192, 168, 1, 20],
                prefix: 24,
                gateway: [192, 168, 1, 1],
                laser: [192, 168, 1, 10],
                laser_port: 2112,
                log_port: 5350,
                service_port: 5351,
            },
            start_search: true,
        }
    }
}
