"""The chip as a part of a vehicle that another program plays: one line of JSON in, one out.

The first line says what the vehicle is like; each other line has what is said to the chip now and until when it runs, and is
answered by what the chip has said until then. Times are microseconds since power came. A line without a time is answered by how many
bytes of the stack were used since the program's loop began.
"""

import json

from bench import deepest_stack, describe
from emulated_chip.can_bus import CanFrame
from emulated_chip.can_peers import Listener
from emulated_chip.clock import MICROSECOND
from emulated_chip.network import Host
from stored_settings import FIRST_CONTOUR_PAGE, FIRST_PAGE, PAGE


class Served:
    def __init__(self, bench, vehicle):
        self.chip = bench.chip()
        self.load(vehicle["flash"], FIRST_PAGE * PAGE)
        if vehicle["contours"]:
            self.load(vehicle["contours"], FIRST_CONTOUR_PAGE * PAGE)
        # It hears what the chip says, and says what sensors say.
        self.sensors = Listener(self.chip.clock)
        self.chip.can_bus.nodes.append(self.sensors)
        self.host = Host(self.chip, vehicle["host"], vehicle["controller"])
        self.laser_port = vehicle["laser_port"]
        self.log_port = vehicle["log_port"]
        self.host.listens_at.add(self.laser_port)
        self.laser = None
        self.log = None

    def load(self, path, first):
        """Puts what a file holds into the flash."""
        with open(path, "rb") as file:
            contents = file.read()
        self.chip.settings_flash.bytes[first : first + len(contents)] = contents

    def step(self, said):
        """What the chip says until a time, having been told something now."""
        chip = self.chip
        for identifier, is_extended, is_remote, data in said["frames"]:
            chip.can_bus.send(self.sensors, CanFrame(identifier, bytes.fromhex(data), is_remote, is_extended))
        if self.laser and said["laser"]:
            self.laser.send(bytes.fromhex(said["laser"]))
        if self.log is None or self.log.is_over:
            self.log = self.host.connect(self.log_port)
        chip.run_until(said["until"] * MICROSECOND)
        connections = [one for (port, _), one in self.host.connections.items() if port == self.laser_port]
        is_new = bool(connections) and connections[-1] is not self.laser
        self.laser = connections[-1] if connections else None
        heard, self.sensors.heard = self.sensors.heard, []
        return {
            "frames": [[time // MICROSECOND, frame.identifier, frame.data.hex()] for time, frame in heard],
            "is_connected_anew": is_new,
            "laser": take(self.laser),
            "log": take(self.log),
            "ended": describe(chip) if chip.findings or chip.exceptions.taken or len(chip.resets) > 1 else None,
        }


def take(connection):
    """What has come on a connection since the last time."""
    if connection is None:
        return ""
    data = bytes(connection.received)
    connection.received.clear()
    return data.hex()


def serve(bench, lines, answer):
    served = None
    for line in lines:
        said = json.loads(line)
        if served is None:
            served = Served(bench, said)
        elif said["until"] is None:
            answer(json.dumps({"stack": deepest_stack(served.chip)}))
        else:
            answer(json.dumps(served.step(said)))
