"""Writes what velodyne_decoder makes of packets: x, y, z, intensity, ring and time as 32-bit floats, point by point.

Arguments: model, calibration file or nothing. On standard input: length (32 bits) and bytes of each packet.
"""

import struct
import sys

import numpy
import velodyne_decoder

options = {"model": getattr(velodyne_decoder.Model, sys.argv[1]), "min_range": 0.0, "max_range": 1000.0}
if len(sys.argv) > 2:
    options["calibration"] = velodyne_decoder.Calibration.read(sys.argv[2])
data = sys.stdin.buffer.read()
packets, at = [], 0
while at < len(data):
    (length,) = struct.unpack_from("<I", data, at)
    packets.append(velodyne_decoder.VelodynePacket(0.0, data[at + 4 : at + 4 + length]))
    at += 4 + length
decoder = velodyne_decoder.ScanDecoder(velodyne_decoder.Config(**options))
_, points = decoder.decode(velodyne_decoder.PacketVector(packets), as_pcl_structs=True)
columns = [points[name].astype("<f4") for name in ("x", "y", "z", "intensity", "ring", "time")]
sys.stdout.buffer.write(numpy.stack(columns, axis=1).tobytes())
