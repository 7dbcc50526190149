//! One message of a recording.

/// One message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BagMessage<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// Name of its kind, such as `sensor_msgs/msg/LaserScan`.
    pub kind: &'a str,
    /// When it was recorded, ns.
    pub time: u64,
    /// Its bytes.
    pub data: &'a [u8],
}
