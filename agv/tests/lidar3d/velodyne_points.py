"""Writes what velodyne_decoder makes of the packets of a capture: x, y, z, intensity as 32-bit floats, point by point."""

import sys

import numpy
import velodyne_decoder
from velodyne_decoder.util import iter_pcap

capture, model, calibration = sys.argv[1:4]
config = velodyne_decoder.Config(
    model=getattr(velodyne_decoder.Model, model),
    calibration=velodyne_decoder.Calibration.read(calibration),
    min_range=0.0,
    max_range=1000.0,
)
packets = velodyne_decoder.PacketVector(
    [velodyne_decoder.VelodynePacket(stamp, data) for stamp, data in iter_pcap(capture) if len(data) == 1206]
)
_, points = velodyne_decoder.ScanDecoder(config).decode(packets, as_pcl_structs=True)
columns = [points[name].astype("<f4") for name in ("x", "y", "z", "intensity")]
sys.stdout.buffer.write(numpy.stack(columns, axis=1).tobytes())
