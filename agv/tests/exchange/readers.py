"""What readers of others find in an export: argument 1 is an MCAP file, argument 2 a folder of rosbag2. Prints JSON."""

import json
import math
import sys
from pathlib import Path

from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


def seconds(stamp):
    return stamp.sec + 1e-9 * getattr(stamp, "nanosec", 0)


def planar(pose):
    position = getattr(pose, "position", None) or pose.translation
    turn = getattr(pose, "orientation", None) or pose.rotation
    heading = math.atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y**2 + turn.z**2))
    return [position.x, position.y, heading]


def look(topic, message):
    """The numbers of a message that matter."""
    if topic in ("/tf", "/tf_static"):
        steps = message.transforms
        return [[step.header.frame_id, step.child_frame_id, seconds(step.header.stamp), *planar(step.transform)] for step in steps]
    if topic in ("/pose", "/initialpose"):
        return [seconds(message.header.stamp), *planar(message.pose.pose), *[float(value) for value in message.pose.covariance]]
    if topic in ("/truth", "/reference"):
        return [seconds(message.header.stamp), *planar(message.pose)]
    if topic == "/odom":
        return [seconds(message.header.stamp), *planar(message.pose.pose), message.twist.twist.linear.x, message.twist.twist.angular.z]
    if topic == "/scan":
        ranges = [value if math.isfinite(value) else -1.0 for value in (float(value) for value in message.ranges)]
        return [seconds(message.header.stamp), message.angle_min, message.angle_increment, message.time_increment, ranges]
    if topic in ("/landmarks", "/observations"):
        return [[marker.ns, marker.type, [[point.x, point.y] for point in marker.points]] for marker in message.markers]
    if topic == "/diagnostics":
        level = lambda status: status.level if isinstance(status.level, int) else status.level[0]
        return [[status.name, level(status), status.message, {value.key: value.value for value in status.values}] for status in message.status]
    raise ValueError(topic)


def by_mcap(path):
    found = {}
    with open(path, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(look(channel.topic, message))
    return found


def by_rosbags(folder):
    found = {}
    with AnyReader([Path(folder)]) as reader:
        for connection, _, raw in reader.messages():
            found.setdefault(connection.topic, []).append(look(connection.topic, reader.deserialize(raw, connection.msgtype)))
    return found


print(json.dumps({"mcap": by_mcap(sys.argv[1]), "rosbags": by_rosbags(sys.argv[2])}))
