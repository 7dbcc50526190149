"""What `stm32-metapac` says of the chip."""

import json


class Register:
    def __init__(self, offset, fields):
        self.offset = offset
        self._fields = {name: (place["bit"], (1 << place["size"]) - 1) for name, place in fields.items()}

    def fields(self):
        return list(self._fields)

    def get(self, value, field):
        bit, mask = self._fields[field]
        return value >> bit & mask

    def put(self, value, field, part):
        bit, mask = self._fields[field]
        return value & ~(mask << bit) | (part & mask) << bit


class Description:
    def __init__(self, path):
        with open(path) as file:
            raw = json.load(file)
        self.memory = {region["name"]: (region["address"], region["size"]) for region in raw["memory"]}
        self.interrupts = raw["interrupts"]
        self.peripherals = {one["name"]: one for one in raw["peripherals"]}
        self._kinds = {
            kind: {name: Register(one["offset"], one["fields"]) for name, one in registers.items()}
            for kind, registers in raw["kinds"].items()
        }

    def register(self, kind, name):
        return self._kinds[kind][name]

    def registers(self, kind):
        """All registers of a kind of peripheral, by their names; none if the description has no such kind."""
        return self._kinds.get(kind, {})

    def base(self, name):
        return self.peripherals[name]["address"]
