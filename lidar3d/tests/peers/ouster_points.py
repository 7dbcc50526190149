"""Writes what ouster-sdk makes of packets: x, y, z, reflectivity, column, row, return (1 or 2) and time after the packet's
first column (us) as 32-bit floats, column by column.

Arguments: metadata of the sensor, and perhaps a profile: then the packets are not those of standard input, but some that
the program itself fills with numbers, and its output begins with them (how many, then length and bytes of each).
"""

import struct
import sys
import warnings

import numpy
from ouster.sdk import core

warnings.simplefilter("ignore")
info = core.SensorInfo(open(sys.argv[1]).read())
output = sys.stdout.buffer
if len(sys.argv) > 2:
    info.format.udp_profile_lidar = getattr(core.UDPProfileLidar, sys.argv[2])
layout = core.PacketFormat(info)


def made(number):
    packet = core.LidarPacket(layout.lidar_packet_size)
    random = numpy.random.default_rng(number)
    shape = (layout.pixels_per_column, layout.columns_per_packet)
    for name in layout.fields:
        if name in ("RANGE", "RANGE2"):
            limit = 1 << layout.field_bitness(name)
            scale = 8 if layout.field_bitness(name) == 15 else 1
            layout.set_field(packet, name, (scale * random.integers(0, limit, shape)).astype(numpy.uint32))
        elif name in ("REFLECTIVITY", "REFLECTIVITY2"):
            layout.set_field(packet, name, random.integers(0, 256, shape).astype(numpy.uint8))
    for column in range(layout.columns_per_packet):
        place = number * layout.columns_per_packet + column
        layout.set_col_measurement_id(packet, column, place)
        layout.set_col_timestamp(packet, column, 10**9 + 97_000 * place)
        # The last column of each packet is not valid.
        layout.set_col_status(packet, column, 0 if column == layout.columns_per_packet - 1 else 0xFFFFFFFF)
    return bytes(packet.buf)


def read():
    data, at, packets = sys.stdin.buffer.read(), 0, []
    while at < len(data):
        (length,) = struct.unpack_from("<I", data, at)
        packets.append(data[at + 4 : at + 4 + length])
        at += 4 + length
    return packets


if len(sys.argv) > 2:
    packets = [made(number) for number in range(4)]
    output.write(struct.pack("<I", len(packets)))
    for packet in packets:
        output.write(struct.pack("<I", len(packet)) + packet)
else:
    packets = read()
project = core.XYZLut(info)
is_valid = 0xFFFFFFFF if info.format.udp_profile_lidar == core.UDPProfileLidar.LEGACY else 1
for bytes_ in packets:
    buffer = numpy.frombuffer(bytes_, dtype=numpy.uint8)
    columns = layout.packet_header(core.ColHeader.MEASUREMENT_ID, buffer)
    status = layout.packet_header(core.ColHeader.STATUS, buffer)
    time = layout.packet_header(core.ColHeader.TIMESTAMP, buffer)
    for number, ending in ((1, ""), (2, "2")):
        if "RANGE" + ending not in layout.fields:
            continue
        ranges = layout.packet_field("RANGE" + ending, buffer)
        reflectivity = layout.packet_field("REFLECTIVITY" + ending, buffer)
        image = numpy.zeros((layout.pixels_per_column, info.format.columns_per_frame), dtype=numpy.uint32)
        image[:, columns] = ranges
        points = project(image)
        for place, column in enumerate(columns):
            if status[place] & is_valid != is_valid:
                continue
            for row in numpy.flatnonzero(ranges[:, place]):
                after = (int(time[place]) - int(time[0])) / 1000
                values = (*points[row, column], reflectivity[row, place], column, row, number, after)
                output.write(struct.pack("<8f", *values))
