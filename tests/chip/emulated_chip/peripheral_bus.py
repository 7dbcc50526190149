"""The buses of the peripherals: whoever has no clock does not answer, and neither does an address that nobody has."""

from .finding import Finding

FIRST, SIZE = 0x4000_0000, 0x2000_0000
BLOCK = 0x400
# Blocks of 1 KiB that a peripheral takes where it is not one (table 8).
BLOCKS = {"ETH": 5, "FDCANRAM": 10, "FLASH": 4, "DBGMCU": 4, "AXI": 0x400}
# Parts whose clock is that of another peripheral.
CLOCKED_BY = {"FDCANRAM": "FDCAN1"}
# The network of buses in domain D1 (2.2, table 8), which the description does not have.
EXTRA = {"AXI": 0x5100_0000}


class PeripheralBus:
    def __init__(self, chip):
        self.chip = chip
        self._owners = {}
        description = chip.description
        places = {name: one["address"] for name, one in description.peripherals.items()}
        for name, base in {**places, **EXTRA}.items():
            for block in range(BLOCKS.get(name, 1)):
                self._owners.setdefault((base & ~(BLOCK - 1)) + block * BLOCK, (name, base & ~(BLOCK - 1)))
        # The management of the PHY is within the Ethernet controller.
        for block in range(BLOCKS["ETH"]):
            self._owners[description.base("ETH") + block * BLOCK] = ("ETH", description.base("ETH"))
        chip.processor.engine.mmio_map(FIRST, SIZE, self._read, None, self._write, None)

    def _find(self, offset, size, what):
        """The peripheral at an address and the offset in it; None, and the run is over, if none answers."""
        address = FIRST + offset
        owner = self._owners.get(address & ~(BLOCK - 1))
        if owner is None:
            self._refuse("reserved", f"a {what} of an address that nobody has", address)
            return None
        name, base = owner
        if not self.has_clock(name):
            self._refuse("gated", f"a {what} of {name} without its clock", address)
            return None
        peripheral = self.chip.peripherals.get(name)
        if peripheral is None:
            self._refuse("not modelled", f"a {what} of {name}, of which there is no model", address)
            return None
        return peripheral, address - base

    def has_clock(self, name):
        enable = self.chip.description.peripherals.get(CLOCKED_BY.get(name, name), {}).get("enable")
        if not enable:
            return True
        word = self.chip.peripherals["RCC"].get(enable["register"])
        return bool(word >> enable["bit"] & 1)

    def _refuse(self, kind, text, address):
        block = self.chip.processor.progress.block
        self.chip.end(Finding(kind, text, address, block, self.chip.symbol(block)))

    def _read(self, engine, offset, size, _):
        found = self._find(offset, size, "read")
        return found[0].read(found[1], size) if found else 0

    def _write(self, engine, offset, size, value, _):
        found = self._find(offset, size, "write")
        if found:
            found[0].write(found[1], size, value)
