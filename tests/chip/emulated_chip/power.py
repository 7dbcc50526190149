"""Supply and voltage scaling (chapter 6), and the system configuration that belongs to it (chapter 12)."""

from .registers import RegisterFile


class Power(RegisterFile):
    def __init__(self, chip):
        super().__init__(chip, "pwr")
        self.on_write("D3CR", self._write_scale)
        self.on_read("CSR1", self._read_status)

    def reset(self):
        super().reset()
        # 6.8.4: supply by the regulator; 6.8.6: scale 3, ready.
        self.set("CR3", 0x0000_0006)
        self.put("D3CR", "VOS", 1)
        self.put("D3CR", "VOSRDY", 1)

    def _write_scale(self, word):
        register = self.register("D3CR")
        self.words[register.offset] = register.put(word, "VOSRDY", 1)

    def _read_status(self):
        register = self.register("CSR1")
        word = register.put(self.words.get(register.offset, 0), "ACTVOSRDY", 1)
        return register.put(word, "ACTVOS", self.get("D3CR", "VOS"))

    def scale(self):
        """Voltage scale, 0 for the highest (6.6.2)."""
        if not self.chip.description.variant.has_overdrive:
            # RM0468, 6.8.6.
            return {0: 0, 1: 3, 2: 2, 3: 1}[self.get("D3CR", "VOS")]
        selected = {1: 3, 2: 2, 3: 1}.get(self.get("D3CR", "VOS"), 3)
        has_overdrive = self.chip.peripherals["SYSCFG"].get("PWRCR", "ODEN")
        return 0 if selected == 1 and has_overdrive else selected


class SystemConfiguration(RegisterFile):
    def __init__(self, chip):
        super().__init__(chip, "syscfg")
