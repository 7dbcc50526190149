"""Pins (chapter 11): only what is selected for each."""

from .registers import RegisterFile


class Gpio(RegisterFile):
    def __init__(self, chip, port):
        # 11.4.1: analog, but for the debugger's pins of ports A and B.
        modes = {"A": 0xABFF_FFFF, "B": 0xFFFF_FEBF}.get(port, 0xFFFF_FFFF)
        super().__init__(chip, "gpio", {0: modes})

    def alternate_function(self, pin):
        """Number of the alternate function of a pin; None if it has another mode."""
        if self.get("MODER", f"MODER[{pin}]") != 2:
            return None
        return self.get(f"AFR[{pin // 8}]", f"AFR[{pin % 8}]")
