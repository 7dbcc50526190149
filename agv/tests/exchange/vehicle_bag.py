"""Writes the recording of another vehicle: argument 1 is the folder, argument 2 the storage, mcap or sqlite3.

Argument 3 is the roll of the laser in degrees: at 180 it hangs upside down, and measures the same things in the other order.
"""

import math
import sys
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_HUMBLE)
types = store.types


def new(name, *fields):
    return types[name](*fields)


def header(time, frame):
    whole = int(time)
    return new("std_msgs/msg/Header", new("builtin_interfaces/msg/Time", whole, round((time - whole) * 1e9)), frame)


def pose(x, y, heading):
    point = new("geometry_msgs/msg/Point", x, y, 0.5)
    return new("geometry_msgs/msg/Pose", point, new("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)))


def transform(parent, child, x, y, heading):
    moved = new("geometry_msgs/msg/Vector3", x, y, 0.3)
    turned = new("geometry_msgs/msg/Quaternion", 0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
    return new("geometry_msgs/msg/TransformStamped", header(1.7e9, parent), child, new("geometry_msgs/msg/Transform", moved, turned))


def rolled(stamped, roll):
    """The same transform, turned about its own first axis before."""
    z, w = stamped.transform.rotation.z, stamped.transform.rotation.w
    sine, cosine = math.sin(roll / 2), math.cos(roll / 2)
    stamped.transform.rotation = new("geometry_msgs/msg/Quaternion", w * sine, z * sine, z * cosine, w * cosine)
    return stamped


def odometry(time, x, y, heading):
    nothing = np.zeros(36)
    still = new("geometry_msgs/msg/Vector3", 0.0, 0.0, 0.0)
    twist = new("geometry_msgs/msg/TwistWithCovariance", new("geometry_msgs/msg/Twist", still, still), nothing)
    placed = new("geometry_msgs/msg/PoseWithCovariance", pose(x, y, heading), nothing)
    return new("nav_msgs/msg/Odometry", header(time, "odom"), "base_link", placed, twist)


def scan(time, number):
    ranges = np.array([2.0 + 0.01 * beam + 0.1 * number for beam in range(181)], dtype=np.float32)
    ranges[0], ranges[1], ranges[2] = np.inf, np.nan, 99.0
    strengths = np.array([300.0 * (beam % 7) for beam in range(181)], dtype=np.float32)
    angles = (-math.pi / 2, math.pi / 2, math.pi / 180)
    return new("sensor_msgs/msg/LaserScan", header(time, "front_laser"), *angles, 0.0002, 0.1, 0.1, 30.0, ranges, strengths)


roll = math.radians(float(sys.argv[3])) if len(sys.argv) > 3 else 0.0
storage = StoragePlugin.MCAP if sys.argv[2] == "mcap" else StoragePlugin.SQLITE3
with Writer(Path(sys.argv[1]), version=9, storage_plugin=storage) as writer:
    def channel(topic, kind):
        return writer.add_connection(topic, kind, typestore=store), kind

    def write(to, time, message):
        writer.write(to[0], round(time * 1e9), store.serialize_cdr(message, to[1]))

    statics = channel("/tf_static", "tf2_msgs/msg/TFMessage")
    odometries = channel("/wheel/odometry", "nav_msgs/msg/Odometry")
    scans = channel("/front/scan", "sensor_msgs/msg/LaserScan")
    others = channel("/chatter", "std_msgs/msg/String")
    # The laser stands on a mast, which stands on the vehicle.
    chain = [rolled(transform("mast", "front_laser", 0.2, 0.0, math.pi / 2), roll), transform("base_link", "mast", 1.0, 0.5, 0.0)]
    write(statics, 1.7e9, new("tf2_msgs/msg/TFMessage", chain))
    write(others, 1.7e9, new("std_msgs/msg/String", "nothing of interest"))
    for step in range(20):
        time = 1.7e9 + 0.05 * step
        # A circle of 2 m radius.
        angle = 0.1 * step
        write(odometries, time, odometry(time, 2 * math.sin(angle), 2 - 2 * math.cos(angle), angle))
        if step % 2 == 0:
            write(scans, time + 0.036, scan(time, step))
