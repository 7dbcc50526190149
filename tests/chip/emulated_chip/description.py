"""What `stm32-metapac` says of the chip."""

import json


class Register:
    def __init__(self, offset, fields):
        self.offset = offset
        self._fields = fields

    def mask(self, field):
        place = self._fields[field]
        return ((1 << place["size"]) - 1) << place["bit"]

    def get(self, value, field):
        return (value & self.mask(field)) >> self._fields[field]["bit"]

    def put(self, value, field, part):
        return value & ~self.mask(field) | part << self._fields[field]["bit"] & self.mask(field)


class Description:
    def __init__(self, path):
        with open(path) as file:
            raw = json.load(file)
        self.memory = {region["name"]: (region["address"], region["size"]) for region in raw["memory"]}
        self.interrupts = raw["interrupts"]
        self.peripherals = {one["name"]: one for one in raw["peripherals"]}
        self._kinds = raw["kinds"]

    def register(self, kind, name):
        found = self._kinds[kind][name]
        return Register(found["offset"], found["fields"])

    def base(self, name):
        return self.peripherals[name]["address"]
