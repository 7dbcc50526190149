"""Clocks and resets (chapter 8): oscillators, PLL 1, who is clocked, why the chip has started."""

from .clock import MICROSECOND, MILLISECOND
from .exceptions import NON_MASKABLE
from .registers import RegisterFile

HSI, CSI, HSE_ON_BOARD = 64_000_000, 4_000_000, 8_000_000
# Start-up times, at their most: HSI 2 us, CSI 2 us, HSI48 10 us, PLL lock 150 us (DS12110, "Internal clock sources", "PLL
# characteristics"); the HSE is the debugger's clock, which is there when the debugger is.
STARTS = {"HSI": 2 * MICROSECOND, "CSI": 2 * MICROSECOND, "HSI48": 10 * MICROSECOND, "HSE": 2 * MILLISECOND}
LOCK = 150 * MICROSECOND
# Lowest frequency of the oscillator of a PLL: to it falls one whose clock has stopped (DS12110, "PLL characteristics").
LOWEST_VCO = 192_000_000
# Divisors of D1CPRE and HPRE, by their four bits (8.7.8).
DIVISORS = {0: 1, 8: 2, 9: 4, 10: 8, 11: 16, 12: 64, 13: 128, 14: 256, 15: 512}
# Which source is behind the system clock switch and the PLLs (8.7.7, 8.7.11).
SYSTEM_SOURCES = {0: "HSI", 1: "CSI", 2: "HSE", 3: "PLL1"}
PLL_SOURCES = {0: "HSI", 1: "CSI", 2: "HSE", 3: None}

# Reset flags (8.7.39): by pin, by power (which sets those of pin and brown-out, too), by software, by the watchdog.
RESET_FLAGS = {
    "power": ["CPURSTF", "D1RSTF", "D2RSTF", "BORRSTF", "PINRSTF", "PORRSTF"],
    "software": ["CPURSTF", "PINRSTF", "SFTRSTF"],
    "watchdog": ["CPURSTF", "PINRSTF", "IWDG1RSTF"],
    "pin": ["CPURSTF", "PINRSTF"],
}
ENABLES = ["AHB1ENR", "AHB2ENR", "AHB3ENR", "AHB4ENR", "APB1LENR", "APB1HENR", "APB2ENR", "APB3ENR", "APB4ENR"]
RESETS = ["AHB1RSTR", "AHB2RSTR", "AHB3RSTR", "AHB4RSTR", "APB1LRSTR", "APB1HRSTR", "APB2RSTR", "APB3RSTR", "APB4RSTR"]


class Rcc(RegisterFile):
    def __init__(self, chip):
        super().__init__(chip, "rcc")
        self.has_hse = True
        # Bits that the chip ignores, for tests that take a clock away: pairs of register and field.
        self.ignored = set()
        self._running = set()
        self._timer_clock = None
        self.on_write("CR", self._write_control)
        self.on_write("CFGR", self._write_configuration)
        self.on_write("PLLCKSELR", self._write_pll_source)
        self.on_write("D1CFGR", self._write_divider)
        self.on_write("CSR", self._write_low_speed)
        self.on_write("RSR", self._clear_reset_flags)
        self.on_write("CICR", lambda word: self.set("CIFR", self.get("CIFR") & ~word))
        for name in ENABLES:
            self.on_write(name, lambda word, name=name: self._enable(name, word))
        for name in RESETS:
            self.on_write(name, lambda word, name=name: self._reset_peripherals(name, word))

    def reset(self):
        flags = self.words.get(self.register("RSR").offset, 0)
        super().reset()
        self.words[self.register("RSR").offset] = flags
        # 8.7.2: the HSI runs; 8.7.14 and 8.7.13: reset values of dividers.
        self.put("CR", "HSION", 1)
        self.put("CR", "HSIRDY", 1)
        self.put("CR", "D1CKRDY", 1)
        self.put("CR", "D2CKRDY", 1)
        self.set("PLLCKSELR", 0x0202_0200)
        self.set("PLLCFGR", 0x01FF_0000)
        for number in range(3):
            self.set(f"PLLDIVR[{number}]", 0x0101_0280)
        self._running = {"HSI"}
        self._tell()

    def note_reset(self, cause):
        for flag in RESET_FLAGS[cause]:
            self.put("RSR", flag, 1)

    # Oscillators and PLLs

    def _write_control(self, word):
        register = self.register("CR")
        ready = [f"{name}RDY" for name in ("HSI", "CSI", "HSI48", "HSE")] + [f"PLLRDY[{number}]" for number in range(3)]
        before = self.get("CR")
        for flag in ready + ["D1CKRDY", "D2CKRDY"]:
            word = register.put(word, flag, register.get(before, flag))
        source = self._system_source()
        if source != "PLL1" and register.get(word, f"{source}ON") == 0:
            # What drives the system cannot be switched off (8.7.2).
            word = register.put(word, f"{source}ON", 1)
        self.words[register.offset] = word
        for name, delay in STARTS.items():
            is_there = name != "HSE" or self.has_hse
            self._switch(name, f"{name}ON", f"{name}RDY", delay if is_there else None)
        for number in range(3):
            has_input = PLL_SOURCES[self.get("PLLCKSELR", "PLLSRC")] in self._running
            self._switch(f"PLL{number + 1}", f"PLLON[{number}]", f"PLLRDY[{number}]", LOCK if has_input else None)
        self._tell()

    def _switch(self, name, on, ready, delay):
        if not self.get("CR", on):
            self._running.discard(name)
            self.put("CR", ready, 0)
        elif name not in self._running and delay is not None:
            self._running.add(name)
            self.chip.clock.after(delay, lambda: self._become_ready(name, on, ready))

    def _become_ready(self, name, on, ready):
        if self.get("CR", on):
            self.put("CR", ready, 1)
            self._timer_clock = None

    def stop_crystal(self):
        """The debugger's clock stops. If the clock security system watches it, whom it has driven goes on with the HSI, which is switched on, PLLs on it are
        switched off, and a non-maskable interrupt comes (8.5.3, "Clock security system")."""
        self.has_hse = False
        if "HSE" not in self._running:
            return
        self._running.discard("HSE")
        self.put("CR", "HSERDY", 0)
        if self.get("CR", "HSECSSON"):
            if self._system_source() == "HSE" or self._drives_plls("HSE"):
                self.put("CFGR", "SW", 0)
                self.put("CFGR", "SWS", 0)
            self.put("CR", "HSEON", 0)
            self.put("CR", "HSION", 1)
            self.put("CR", "HSIRDY", 1)
            self._running.add("HSI")
            for number in range(3) if self._drives_plls("HSE") else ():
                self.put("CR", f"PLLON[{number}]", 0)
                self.put("CR", f"PLLRDY[{number}]", 0)
                self._running.discard(f"PLL{number + 1}")
            self.put("CIFR", "HSECSSF", 1)
            self.chip.exceptions.pend(NON_MASKABLE)
        self._tell()

    def _drives_plls(self, name):
        return PLL_SOURCES[self.get("PLLCKSELR", "PLLSRC")] == name

    def _write_pll_source(self, word):
        # Protected while a PLL runs (8.7.11).
        if not any(self.get("CR", f"PLLON[{number}]") for number in range(3)):
            self.set("PLLCKSELR", word)

    def _write_configuration(self, word):
        register = self.register("CFGR")
        wanted = SYSTEM_SOURCES.get(register.get(word, "SW"))
        ready = {"PLL1": "PLLRDY[0]"}.get(wanted, f"{wanted}RDY")
        status = register.get(word, "SW") if wanted and self.get("CR", ready) else self.get("CFGR", "SWS")
        self.words[register.offset] = register.put(word, "SWS", status)
        self._tell()

    def _write_divider(self, word):
        self.set("D1CFGR", word)
        self._tell()

    def _write_low_speed(self, word):
        self.set("CSR", word)
        self.put("CSR", "LSIRDY", self.get("CSR", "LSION"))

    def _clear_reset_flags(self, word):
        if self.register("RSR").get(word, "RMVF"):
            self.set("RSR", 0)

    # Frequencies

    def _system_source(self):
        return SYSTEM_SOURCES[self.get("CFGR", "SWS")]

    def _oscillator(self, name):
        if name is None or name not in self._running:
            return 0
        return {"HSI": HSI >> self.get("CR", "HSIDIV"), "CSI": CSI, "HSE": HSE_ON_BOARD, "HSI48": 48_000_000}[name]

    def vco(self, number):
        source = self._oscillator(PLL_SOURCES[self.get("PLLCKSELR", "PLLSRC")])
        divisor = self.get("PLLCKSELR", f"DIVM[{number}]")
        if not divisor or not self.get("CR", f"PLLRDY[{number}]"):
            return 0
        if source == 0:
            return LOWEST_VCO
        fraction = 0
        if self.get("PLLCFGR", f"PLLFRACEN[{number}]"):
            fraction = self.get(f"PLLFRACR[{number}]", "FRACN") / 8192
        return source // divisor * (self.get(f"PLLDIVR[{number}]", "PLLN") + 1 + fraction)

    def pll(self, number, output):
        """An output of a PLL, p, q or r, Hz; zero if it is off."""
        if not self.get("PLLCFGR", f"DIV{output.upper()}EN[{number}]"):
            return 0
        return int(self.vco(number) / (self.get(f"PLLDIVR[{number}]", f"PLL{output.upper()}") + 1))

    def system_clock(self):
        source = self._system_source()
        return self.pll(0, "p") if source == "PLL1" else self._oscillator(source)

    def processor_clock(self):
        return self.system_clock() // DIVISORS.get(self.get("D1CFGR", "D1CPRE"), 1)

    def bus_clock(self):
        """AHB and AXI."""
        return self.processor_clock() // DIVISORS.get(self.get("D1CFGR", "HPRE"), 1)

    def peripheral_clock(self, register, field):
        divisor = {4: 2, 5: 4, 6: 8, 7: 16}.get(self.get(register, field), 1)
        return self.bus_clock() // divisor

    def timer_clock(self):
        """Of the timers on APB 1 (8.5.6, table 56): twice that of the bus, unless that is not divided."""
        if self._timer_clock is None:
            bus, peripheral = self.bus_clock(), self.peripheral_clock("D2CFGR", "D2PPRE1")
            self._timer_clock = bus if peripheral == bus else 2 * peripheral
        return self._timer_clock

    def can_clock(self):
        """Kernel clock of the FDCAN (8.7.18)."""
        selected = self.get("D2CCIP1R", "FDCANSEL")
        return {0: self._oscillator("HSE"), 1: self.pll(0, "q"), 2: self.pll(1, "q")}.get(selected, 0)

    def random_clock(self):
        """Kernel clock of the random number generator (8.7.19)."""
        selected = self.get("D2CCIP2R", "RNGSEL")
        hsi48 = self._oscillator("HSI48") if self.get("CR", "HSI48RDY") else 0
        return {0: hsi48, 1: self.pll(0, "q")}.get(selected, 0)

    def write_word(self, offset, word):
        super().write_word(offset, word)
        self._timer_clock = None

    def _tell(self):
        self._timer_clock = None
        self.chip.clock.set_processor_clock(max(1, self.processor_clock()))

    # Who is clocked

    def enabled(self):
        """Every clock bit that is set: pairs of register and field."""
        return sorted((name, field) for name in ENABLES for field in self.register(name).fields() if self.get(name, field))

    def is_on(self, register, field):
        return bool(self.get(register, field))

    def _enable(self, name, word):
        register = self.register(name)
        for ignored_register, field in self.ignored:
            if ignored_register == name:
                word = register.put(word, field, 0)
        self.words[register.offset] = word
        self.chip.on_clock_change()

    def _reset_peripherals(self, name, word):
        before = self.get(name)
        self.set(name, word)
        for peripheral in self.chip.description.peripherals.values():
            bit = peripheral["reset"]
            if bit and bit["register"] == name and word >> bit["bit"] & 1 and not before >> bit["bit"] & 1:
                self.chip.reset_peripheral(peripheral["name"])
