"""What `stm32-metapac` says of the chip."""

import json

from .variant import VARIANTS


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
        self.name = raw["name"]
        self.variant = VARIANTS[self.name]
        self.memory = {}
        for region in raw["memory"]:
            name = self.variant.renamed.get(region["name"], region["name"])
            self.memory[name] = (region["address"], region["size"])
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

    def banks(self):
        """First address and bytes of each bank of flash."""
        return [place for name, place in sorted(self.memory.items()) if name.startswith("BANK")]

    def settings_bank(self):
        """Which of them has the settings."""
        holds = lambda place: place[0] <= self.variant.settings < place[0] + place[1]
        return next(number for number, place in enumerate(self.banks()) if holds(place))

    def base(self, name):
        return self.peripherals[name]["address"]
