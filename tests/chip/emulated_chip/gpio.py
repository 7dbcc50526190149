"""Pins (chapter 11): what is selected for each, and their levels."""

from .registers import RegisterFile

OUTPUT, ALTERNATE = 1, 2
PINS = range(16)


class Gpio(RegisterFile):
    def __init__(self, chip, port):
        # 11.4.1: analog, but for the debugger's pins of ports A and B.
        modes = {"A": 0xABFF_FFFF, "B": 0xFFFF_FEBF}.get(port, 0xFFFF_FFFF)
        super().__init__(chip, "gpio", {0: modes})
        # Levels of what others drive, a bit each; what nobody drives is low.
        self._driven = 0
        self.on_write("BSRR", self._set)
        self.on_read("IDR", self._levels)

    def alternate_function(self, pin):
        """Number of the alternate function of a pin; None if it has another mode."""
        if self._mode(pin) != ALTERNATE:
            return None
        return self.get(f"AFR[{pin // 8}]", f"AFR[{pin % 8}]")

    def level(self, pin):
        """Whether a pin is driven high, or low; None if the chip does not drive it."""
        return bool(self.get("ODR") >> pin & 1) if self._mode(pin) == OUTPUT else None

    def drive(self, pin, is_high):
        """Somebody outside drives a pin."""
        self._driven = self._driven & ~(1 << pin) | is_high << pin

    def _mode(self, pin):
        return self.get("MODER", f"MODER[{pin}]")

    def _set(self, word):
        # 11.4.7: the upper half resets, the lower half sets, and setting has priority.
        self.set("ODR", self.get("ODR") & ~(word >> 16) & 0xFFFF | word & 0xFFFF)

    def _levels(self):
        outputs = sum(1 << pin for pin in PINS if self._mode(pin) == OUTPUT)
        return self.get("ODR") & outputs | self._driven & ~outputs & 0xFFFF
