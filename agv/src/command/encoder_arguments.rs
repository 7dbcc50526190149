//! Which nodes of a bus are a vehicle's encoders.

use agv_controller::EncoderNodes;
use agv_core::odometry::Vehicle;
use agv_wire::can::canopen::NodeId;
use agv_wire::can::encoder::Reporting;
use agv_wire::can::motion_frames::MotionFrames;

/// Options of the commands that listen to encoders.
#[derive(clap::Args)]
pub struct EncoderArguments {
    /// Node of the driving wheel's encoder; of the first counter of a vehicle with several wheels.
    #[arg(long, value_name = "NODE", default_value = "1", value_parser = node)]
    pub drive: NodeId,
    /// Node of the steering's encoder; of the second counter of a vehicle with several wheels.
    #[arg(long, value_name = "NODE", default_value = "2", value_parser = node)]
    pub steering: NodeId,
    /// Node of the third counter of a vehicle with several wheels.
    #[arg(long, value_name = "NODE", default_value = "3", value_parser = node)]
    pub third: NodeId,
    /// Node of the fourth.
    #[arg(long, value_name = "NODE", default_value = "4", value_parser = node)]
    pub fourth: NodeId,
    /// Positions are read at SYNC instead of by the encoders' own timers.
    #[arg(long)]
    pub sync: bool,
    /// Node of the controller, whose orders are heard.
    #[arg(long, value_name = "NODE", default_value = "16", value_parser = node)]
    pub controller: NodeId,
}

impl EncoderArguments {
    /// The nodes of a vehicle; one whose own controller tells speed and angle does so in the usual frames.
    pub fn nodes(&self, vehicle: &Vehicle) -> EncoderNodes {
        let nodes = EncoderNodes::new([self.drive, self.steering, self.third, self.fourth], self.controller);
        let reporting = if self.sync { Reporting::Synchronous } else { nodes.reporting };
        let tells_speed = matches!(vehicle, Vehicle::Ackermann(_) | Vehicle::TricycleSpeed(_));
        let motion_frames = tells_speed.then_some(MotionFrames::USUAL);
        EncoderNodes { reporting, motion_frames, ..nodes }
    }
}

/// A number of a node.
pub fn node(text: &str) -> Result<NodeId, String> {
    text.parse().ok().and_then(NodeId::new).ok_or_else(|| "a node is a number from 1 to 127".to_owned())
}
