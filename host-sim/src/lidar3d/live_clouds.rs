//! Clouds that a running ROS 2 publishes, as `foxglove_bridge` passes them on: the WebSocket protocol of Foxglove, version 1
//! (github.com/foxglove/ws-protocol, docs/spec.md).

use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use agv_lidar3d::calibration::Laser;
use serde::Deserialize;
use serde_json::json;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Error, Message, WebSocket};

use super::point_cloud2::{KIND, revolution};
use super::revolution::Revolution;
use crate::ros::decode;
use crate::ros::messages::PointCloud2;

/// Names of the protocol: of the program of today, and of those before it.
const PROTOCOLS: HeaderValue = HeaderValue::from_static("foxglove.sdk.v1, foxglove.websocket.v1");
/// How often somebody may want to stop.
const PATIENCE: Duration = Duration::from_millis(200);
/// How long a server may take to be there, and to tell what it has.
const LONGEST: Duration = Duration::from_secs(10);
/// The only subscription.
const SUBSCRIPTION: u32 = 1;
/// First byte of a message with data; subscription and time of reception follow.
const DATA: u8 = 1;
const HEAD: usize = 13;
/// The first cloud is stamped so late, ns: no start is 0, which stands for none.
const FIRST: i64 = 1000;

/// What a server says.
#[derive(Deserialize)]
#[serde(tag = "op", rename_all = "camelCase")]
enum Said {
    Advertise {
        channels: Vec<Channel>,
    },
    #[serde(other)]
    Other,
}

/// A topic that a server offers.
#[derive(Clone, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Channel {
    id: u64,
    topic: String,
    encoding: String,
    schema_name: String,
}

/// A topic that is listened to.
pub struct LiveClouds {
    socket: WebSocket<TcpStream>,
    /// Topic and address, as people call it.
    name: String,
    /// Stamp from which times count, ns.
    first: Option<i64>,
}

impl LiveClouds {
    /// Subscribes to the clouds of a topic at `HOST:PORT`; without a name to those of the only topic that has some.
    ///
    /// # Errors
    /// One line: nobody is there, or it has no clouds, or several topics of them and none was named.
    pub fn subscribe(address: &str, topic: Option<&str>, stop: &AtomicBool) -> Result<Self, String> {
        let socket = connect(address).map_err(|problem| format!("ws://{address}: {problem}"))?;
        let mut clouds = Self { socket, name: format!("ws://{address}"), first: None };
        let channel = clouds.channel(topic, stop).map_err(|problem| format!("ws://{address}: {problem}"))?;
        clouds.name = format!("ws://{address}#{}", channel.topic);
        let request = json!({
            "op": "subscribe",
            "subscriptions": [{ "id": SUBSCRIPTION, "channelId": channel.id }],
        });
        clouds.socket.send(Message::text(request.to_string())).map_err(|error| clouds.broken(&error))?;
        Ok(clouds)
    }

    /// The channel of the clouds: the server has told all once it says nothing for a moment.
    fn channel(&mut self, topic: Option<&str>, stop: &AtomicBool) -> Result<Channel, String> {
        let mut channels: BTreeMap<u64, Channel> = BTreeMap::new();
        let began = Instant::now();
        while began.elapsed() < LONGEST && !stop.load(Ordering::Relaxed) {
            match self.read().map_err(|error| error.to_string())? {
                Some(Message::Text(text)) => {
                    if let Ok(Said::Advertise { channels: told }) = serde_json::from_str(&text) {
                        channels.extend(told.into_iter().map(|channel| (channel.id, channel)));
                    }
                }
                None if channels.values().any(|channel| is_wanted(channel, topic)) => break,
                _ => {}
            }
        }
        let wanted: Vec<&Channel> = channels.values().filter(|channel| is_wanted(channel, topic)).collect();
        match wanted.as_slice() {
            [one] if one.encoding == "cdr" => Ok((*one).clone()),
            [one] => Err(format!("{} is encoded as {}, not as ROS 2 does (cdr)", one.topic, one.encoding)),
            [] => Err(format!("it offers no {KIND}{}", topic.map_or(String::new(), |topic| format!(" on {topic}")))),
            several => {
                let mut names: Vec<&str> = several.iter().map(|channel| channel.topic.as_str()).collect();
                names.sort_unstable();
                Err(format!("clouds are on {}; name one behind the address: ws://HOST:PORT#TOPIC", names.join(", ")))
            }
        }
    }

    /// Waits for a cloud, a moment at most.
    ///
    /// # Errors
    /// One line: the connection is lost, or a cloud contradicts itself.
    pub fn receive(&mut self) -> Result<Option<(Revolution, Vec<Laser>)>, String> {
        let message = self.read().map_err(|error| self.broken(&error))?;
        let Some(Message::Binary(bytes)) = message else { return Ok(None) };
        let (Some(head), Some(data)) = (bytes.first_chunk::<HEAD>(), bytes.get(HEAD..)) else { return Ok(None) };
        let subscription = u32::from_le_bytes([head[1], head[2], head[3], head[4]]);
        if head[0] != DATA || subscription != SUBSCRIPTION {
            return Ok(None);
        }
        let refused = |reason: String| format!("{}: {reason}", self.name);
        let cloud: PointCloud2 = decode(data).map_err(|error| refused(error.to_string()))?;
        let mut first = self.first.or(Some(cloud.header.stamp.nanoseconds() - FIRST));
        let found = revolution(&cloud, &mut first).map_err(refused)?;
        self.first = first;
        Ok(Some(found))
    }

    /// What people call it.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    fn broken(&self, error: &Error) -> String {
        format!("{}: {error}", self.name)
    }

    /// A message; None if none came for a moment.
    fn read(&mut self) -> Result<Option<Message>, Error> {
        match self.socket.read() {
            Ok(message) => Ok(Some(message)),
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut | ErrorKind::Interrupted) =>
            {
                Ok(None)
            }
            Err(error) => Err(error),
        }
    }
}

impl Drop for LiveClouds {
    /// Says goodbye; a server that is gone does not mind.
    fn drop(&mut self) {
        let _ = self.socket.close(None);
        let _ = self.socket.flush();
    }
}

/// Whether a channel has clouds, and is the one that was named.
fn is_wanted(channel: &Channel, topic: Option<&str>) -> bool {
    // ROS 1 has no `msg` in its names.
    let is_cloud = channel.schema_name == KIND || channel.schema_name == KIND.replace("/msg/", "/");
    is_cloud && topic.is_none_or(|topic| channel.topic == topic)
}

fn connect(address: &str) -> Result<WebSocket<TcpStream>, String> {
    let places = address.to_socket_addrs().map_err(|error| error.to_string())?;
    let mut problem = "it has no address".to_owned();
    for place in places {
        match TcpStream::connect_timeout(&place, LONGEST) {
            Ok(stream) => return shake_hands(address, stream),
            Err(error) => problem = error.to_string(),
        }
    }
    Err(problem)
}

fn shake_hands(address: &str, stream: TcpStream) -> Result<WebSocket<TcpStream>, String> {
    let mut request = format!("ws://{address}/").into_client_request().map_err(|error| error.to_string())?;
    request.headers_mut().insert("Sec-WebSocket-Protocol", PROTOCOLS);
    let told = |error: std::io::Error| error.to_string();
    stream.set_read_timeout(Some(LONGEST)).map_err(told)?;
    let (socket, _) = tungstenite::client(request, stream).map_err(|error| error.to_string())?;
    socket.get_ref().set_read_timeout(Some(PATIENCE)).map_err(told)?;
    Ok(socket)
}
