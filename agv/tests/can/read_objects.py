"""A master of CANopen, by the library `canopen`, against a node that another program is. Arguments: the node's EDS, its
number. Frames go out on standard output as lines of IDENTIFIER#BYTES, and come on standard input. On standard error, JSON
lines: each object with what was read, then what came of a few things that masters do."""

import json
import sys
import threading

import can
import canopen


class Lines(can.BusABC):
    """A bus of lines."""

    def __init__(self):
        super().__init__(channel="lines")
        self.write = threading.Lock()

    def send(self, message, timeout=None):
        with self.write:
            print(f"{message.arbitration_id:03X}#{bytes(message.data).hex()}", flush=True)

    def _recv_internal(self, timeout):
        line = sys.stdin.readline().strip()
        if not line:
            return None, True
        identifier, data = line.split("#")
        return can.Message(arbitration_id=int(identifier, 16), data=bytes.fromhex(data), is_extended_id=False), True


def say(**what):
    print(json.dumps(what), file=sys.stderr, flush=True)


def read(variable, kind):
    try:
        value = variable.raw
        if isinstance(value, bytes):
            value = value.decode()
        # Readers of JSON may round numbers; its own text is exact.
        return {kind: repr(value) if isinstance(value, float) else value}
    except canopen.SdoAbortedError as error:
        return {"abort": error.code}


def variables(objects):
    for index in objects:
        entry = objects[index]
        if isinstance(entry, canopen.objectdictionary.ODVariable):
            yield entry
        else:
            # An array makes up what it does not have; those of the file are listed.
            yield from (entry[sub] for sub in entry.subindices)


network = canopen.Network(bus=Lines())
network.connect()
node = network.add_node(int(sys.argv[2]), sys.argv[1])
node.sdo.RESPONSE_TIMEOUT = 10.0

for variable in variables(node.object_dictionary):
    entry = node.sdo[variable.index]
    target = entry if variable.subindex == 0 and isinstance(entry, canopen.sdo.SdoVariable) else entry[variable.subindex]
    say(index=variable.index, sub=variable.subindex, access=variable.access_type, name=variable.name, **read(target, "value"))

# A PDO of its own contents, every 20 ms.
node.nmt.state = "PRE-OPERATIONAL"
node.tpdo.read()
pdo = node.tpdo[1]
pdo.clear()
pdo.add_variable(0x2010, 1)
pdo.add_variable(0x2013, 1)
pdo.add_variable(0x2012, 1)
pdo.event_timer = 20
pdo.enabled = True
pdo.save()
node.tpdo.read()
say(mapped=[[variable.index, variable.subindex] for variable in node.tpdo[1].map], timer=node.tpdo[1].event_timer)
node.nmt.state = "OPERATIONAL"
node.tpdo[1].wait_for_reception(10)
say(pdo=[variable.raw for variable in node.tpdo[1].map])
node.sdo[0x1017].raw = 250
say(heartbeat=node.sdo[0x1017].raw)
say(is_over=True)
print("END", flush=True)
