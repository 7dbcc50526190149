"""Frames on standard input, as lines of IDENTIFIER#BYTES; what agv.dbc makes of each on standard output, as JSON lines:
the signals, and the bytes that they are encoded to again. Arguments: agv.dbc, agv.eds."""

import json
import sys

import cantools
import canopen

database = cantools.database.load_file(sys.argv[1])
objects = canopen.import_od(sys.argv[2], node_id=16)

# Every message of the controller must be a PDO of the object dictionary, with the same identifier.
pdos = {}
for communication, mapping in [(0x1800, 0x1A00), (0x1400, 0x1600)]:
    for number in range(5):
        if communication + number in objects:
            entry = objects[mapping + number][1].default
            assert entry & 0xFF == 64, hex(entry)
            pdos[objects[communication + number][1].default & 0x7FF] = objects[entry >> 16]
assert sorted(pdos) == sorted(message.frame_id for message in database.messages if message.name.startswith("Agv"))
assert all(variable.pdo_mappable for variable in pdos.values())

for line in sys.stdin:
    identifier, data = line.strip().split("#")
    message = database.get_message_by_frame_id(int(identifier, 16))
    signals = message.decode(bytes.fromhex(data), decode_choices=False)
    names = message.decode(bytes.fromhex(data))
    print(json.dumps({
        "message": message.name,
        "signals": signals,
        "names": {name: str(value) for name, value in names.items()},
        "again": message.encode(signals, strict=False).hex(),
    }))
