"""The chip: its parts put together, its resets, its way through time."""

import random

from unicorn import UC_PROT_ALL, UC_PROT_NONE
from unicorn import arm_const as arm

from . import system_control
from .cache import LINE, Cache
from .can_bus import CanBus
from .clock import Clock
from .debug import DebugUnit
from .ethernet import Ethernet
from .exceptions import Exceptions
from .fdcan import Fdcan, MessageRam
from .finding import Finding
from .flash import WORD, Flash, FlashInterface, PowerCut
from .gpio import Gpio
from .i2c import I2c
from .loads import transfer_size
from .memory import PAGE, DataFlash, ProgramFlash, Ram
from .peripheral_bus import PeripheralBus
from .phy import Phy
from .power import Power, SystemConfiguration
from .processor import Processor
from .rcc import Rcc
from .registers import RegisterFile
from .rng import RandomNumbers
from .system_control import SystemControl
from .timer import Timer
from .watchdog import TYPICAL, Watchdog

PRIVATE_BUS, PRIVATE_SIZE = 0xE000_0000, 0x0010_0000
SYSTEM_MEMORY, SYSTEM_SIZE = 0x1FF0_0000, 0x2_0000
BACKUP_RAM = (0x3880_0000, 4096)
# Words of correction bits: 64 bits in AXI SRAM and ITCM, 32 elsewhere (chapter 3, RAMECC).
WIDE = ("AXISRAM", "ITCM")
# Out of reach of the Ethernet's DMA (2.1.1, table 3).
NO_DMA = ("ITCM", "DTCM")


class Chip:
    def __init__(self, image, description, hook, *, lsi=TYPICAL, revision=None, bit_rate=500_000, settings=None):
        self.image = image
        self.description = description
        self.processor = Processor(self, hook)
        self.clock = Clock(self.processor.progress)
        self.cache = Cache()
        self.cut = PowerCut()
        self.findings = []
        self.resets = []
        self.is_ended = False
        self.has_power = True
        self.sleeps = 0
        self._reset_cause = None
        self._stalled_until = 0
        self._forbidden = []
        self.exceptions = Exceptions(self)
        self.system = SystemControl(self)
        self.can_bus = CanBus(self.clock, bit_rate)
        self.phy = Phy(self.clock)
        self._build_peripherals(lsi, revision, settings)
        self._build_memory()
        self.peripheral_bus = PeripheralBus(self)
        self.processor.engine.mmio_map(PRIVATE_BUS, PRIVATE_SIZE, self._read_private, None, self._write_private, None)
        self.power_on()

    def _build_peripherals(self, lsi, revision, settings):
        interrupts = self.description.interrupts
        places, with_settings = self.description.banks(), self.description.settings_bank()
        self.settings_flash = settings or Flash(places[with_settings][1])
        flashes = [self.settings_flash if number == with_settings else Flash(size) for number, (_, size) in enumerate(places)]
        banks = [(base, flash) for (base, _), flash in zip(places, flashes)]
        fdcan = Fdcan(self, (interrupts["FDCAN1_IT0"], interrupts["FDCAN1_IT1"]), self.can_bus)
        self.can_bus.nodes.append(fdcan)
        self.peripherals = {
            "RCC": Rcc(self),
            "PWR": Power(self),
            "SYSCFG": SystemConfiguration(self),
            "FLASH": FlashInterface(self, banks),
            "IWDG1": Watchdog(self, lsi),
            "TIM2": Timer(self, interrupts["TIM2"]),
            "FDCAN1": fdcan,
            "FDCANRAM": MessageRam(fdcan),
            "ETH": Ethernet(self, interrupts["ETH"], self.phy),
            "I2C1": I2c(self),
            "RNG": RandomNumbers(self),
            "DBGMCU": DebugUnit(self, revision or self.description.variant.newest),
            "AXI": RegisterFile(self, "axi"),
        }
        for port in "ABCDEFGHIJK":
            if f"GPIO{port}" in self.description.peripherals:
                self.peripherals[f"GPIO{port}"] = Gpio(self, port)

    def _build_memory(self):
        self.rams = {}
        regions = {name: place for name, place in self.description.memory.items() if not name.startswith("BANK")}
        regions["BKPSRAM"] = BACKUP_RAM
        for name, (base, size) in regions.items():
            self.rams[name] = Ram(self, name, base, size, self.description.variant.clocks.get(name), 8 if name in WIDE else 4)
        places, with_settings = self.description.banks(), self.description.settings_bank()
        base, size = places[0]
        data_base = places[with_settings][0]
        # The program's part of a bank that it shares with the settings ends where those begin.
        first = self.description.variant.settings - base if with_settings == 0 else 0
        self.program = ProgramFlash(self, base, first or size, self.image.segments)
        for address, data in self.image.segments:
            self.processor.exclusives.watch(address, data)
        self.data_flash = DataFlash(self, data_base, self.settings_flash, first)
        self.processor.engine.mem_map(SYSTEM_MEMORY, SYSTEM_SIZE)
        unique = random.Random(7).randbytes(12)
        self.processor.engine.mem_write(self.description.base("UID"), unique)

    # Power and reset

    def power_on(self):
        """Power comes: RAM holds anything, flash what it held."""
        source = random.Random(len(self.resets) + 1)
        for ram in self.rams.values():
            ram.forget(source)
        self.phy.reset()
        self.has_power = True
        self._reset("power")

    def lose_power(self):
        """Power goes now: the run is over until it comes again."""
        self.has_power = False
        self.processor.engine.emu_stop()

    def request_reset(self, cause):
        self._reset_cause = cause
        self.processor.engine.emu_stop()

    def _reset(self, cause):
        """Everything starts again; RAM keeps what was in it, but for dirty lines of the cache."""
        self._reset_cause = None
        self._stalled_until = 0
        for line, before in self.cache.written_lines.lost().items():
            self.ram_at(line).put(line, before)
        self.cache.reset()
        self.exceptions.reset()
        self.system.reset()
        for name, peripheral in self.peripherals.items():
            if name not in ("FDCANRAM",):
                peripheral.reset()
        self.peripherals["RCC"].note_reset(cause)
        self.resets.append((self.clock.now(), cause))
        self.on_clock_change()
        self.on_protection_change()
        self.data_flash.set_apart()
        self._reset_processor()

    def _reset_processor(self):
        processor = self.processor
        for register in [arm.UC_ARM_REG_R0 + number for number in range(13)]:
            processor.set(register, 0)
        for register in (arm.UC_ARM_REG_CONTROL, arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_FAULTMASK):
            processor.set(register, 0)
        processor.set(arm.UC_ARM_REG_BASEPRI, 0)
        processor.set(arm.UC_ARM_REG_XPSR, 1 << 24)
        processor.set(arm.UC_ARM_REG_LR, 0xFFFF_FFFF)
        processor.forget_code()
        table = self.system.vector_table()
        processor.set(arm.UC_ARM_REG_SP, processor.word(table))
        processor.pc = processor.word(table + 4) & ~1

    def reset_peripheral(self, name):
        if name in self.peripherals:
            self.peripherals[name].reset()

    # The way through time

    def run_until(self, time, stop=None):
        """Runs until a time, an end, a loss of power, or until `stop` says so, which is asked whenever something was due."""
        while not self.is_ended and self.has_power and self.clock.now() < time:
            self.clock.run_due()
            if self._reset_cause:
                self._reset(self._reset_cause)
                continue
            if stop and stop():
                return
            if self.clock.now() < self._stalled_until:
                due = self.clock.next_due()
                self.clock.sleep_until(min(time, self._stalled_until, due or self._stalled_until))
                continue
            self.exceptions.take()
            due = self.clock.next_due()
            horizon = time if due is None else min(due, time)
            is_open = self.data_flash.open_page is not None
            is_asleep = self.processor.run(1 if is_open else max(1, self.clock.cycles_until(horizon)))
            if is_open:
                self.data_flash.close()
            if is_asleep and not self.is_ended and not self._reset_cause and not self.exceptions.has_wakeup():
                self.sleeps += 1
                self.clock.sleep_until(horizon)

    def run_for(self, duration, stop=None):
        self.run_until(self.clock.now() + duration, stop)

    def settings_bank(self):
        """The bank of flash that has the settings."""
        return self.peripherals["FLASH"].banks[self.description.settings_bank()]

    def stall_until(self, time):
        """The processor stands still until then, from the end of this block of code on: what it reads next waits (RM0468,
        4.3.6)."""
        self._stalled_until = time
        self.clock.interrupt()

    def end(self, finding):
        self.findings.append(finding)
        self.is_ended = True
        self.processor.engine.emu_stop()

    def lock_up(self, text):
        """A fault that cannot be handled: the processor stands still until a reset, which the watchdog may give."""
        self.end(Finding("lock-up", text, pc=self.processor.pc, symbol=self.symbol(self.processor.pc)))

    def symbol(self, address):
        return self.image.symbol(address)

    # Memory

    def ram_at(self, address):
        return next((ram for ram in self.rams.values() if ram.covers(address)), None)

    def is_stack(self, address, size):
        """Whether an exception's frame fits there."""
        for place in (address, address + size - 1):
            ram = self.ram_at(place)
            if ram is None or not ram.is_mapped or self.system.forbids(place, True):
                return False
        return True

    def on_clock_change(self):
        for ram in self.rams.values():
            ram.follow_clock()

    def on_protection_change(self):
        """What the memory protection unit forbids stops the processor before the access."""
        self.data_flash.on_protection_change()
        engine = self.processor.engine
        for base, size in self._forbidden:
            engine.mem_protect(base, size, UC_PROT_ALL)
        self._forbidden = []
        if not self.system.words.get(system_control.MPU_CTRL, 0) & 1:
            return
        for region in self.system.regions.values():
            if not (region.attributes & 1 and region.forbids(True) and region.forbids(False)):
                continue
            for base, size in region.parts():
                if not any(ram.base < base + size and base < ram.base + ram.size for ram in self.rams.values()):
                    continue
                if base % PAGE or size % PAGE or not self.ram_at(base):
                    self.end(Finding("emulator", "regions of RAM without access are of whole pages of 4 KiB here", base))
                    return
                engine.mem_protect(base, size, UC_PROT_NONE)
                self._forbidden.append((base, size))

    def on_flash_change(self, address, size):
        self.data_flash.set_apart()

    def on_fetch_fault(self, address):
        self.end(Finding("fetch", "code is fetched where there is none", address, address, self.symbol(address)))

    def on_access_fault(self, address, size, is_write, value):
        pc = self.processor.pc
        what = "write" if is_write else "read"
        if self.system.forbids(address, is_write):
            self.exceptions.memory_fault(address)
            return
        if self.data_flash.covers(address) and self.data_flash.is_apart(address):
            self._access_torn_page(address, size, is_write)
            return
        ram = self.ram_at(address)
        if ram and not ram.is_mapped:
            finding = Finding("gated", f"a {what} of {ram.name} without its clock", address, pc, self.symbol(pc))
        else:
            finding = Finding("reserved", f"a {what} of an address that nobody has", address, pc, self.symbol(pc))
        self.end(finding)

    def _access_torn_page(self, address, size, is_write):
        code = bytes(self.processor.engine.mem_read(self.processor.pc, 4))
        count = max(size, transfer_size(code))
        flash = self.peripherals["FLASH"]
        if not is_write and flash.is_bad(address, count):
            flash.note_double_error(address)
            if not self.exceptions.ignores_bus_faults():
                self.exceptions.bus_fault(address)
                return
        word = address & ~(WORD - 1)
        if not is_write and not flash.is_bad(word, 2 * WORD) and not self.system.is_cached(address):
            self.data_flash.open_for_a_block(address)
        else:
            self.data_flash.step_over(address, size if size < 4 else count, is_write)

    def track_written_lines(self):
        """From now on every store to cached RAM is a dirty line, until it is cleaned or makes room."""
        from unicorn import UC_HOOK_MEM_WRITE

        def note(engine, access, address, size, value, _):
            for line in range(address & ~(LINE - 1), address + size, LINE):
                ram = self.ram_at(line)
                if ram and self.system.is_cached(line):
                    self.cache.written_lines.write(line, ram.bytes(line, LINE))

        self.processor.engine.hook_add(UC_HOOK_MEM_WRITE, note)
        self.processor.forget_code()

    # DMA

    def _dma_ram(self, address):
        ram = self.ram_at(address)
        if ram is None or not ram.is_mapped or ram.name in NO_DMA:
            self.end(Finding("dma", "the Ethernet's DMA does not reach this address", address))
            return None
        if self.system.is_cached(address):
            self.end(Finding("dma", "the Ethernet's DMA and the data cache share this address", address))
            return None
        return ram

    def dma_read(self, address, size):
        ram = self._dma_ram(address)
        return ram.bytes(address, size) if ram else bytes(size)

    def dma_write(self, address, data):
        ram = self._dma_ram(address)
        if ram:
            ram.put(address, data)

    # The processor's own bus

    def _read_private(self, engine, offset, size, _):
        address = PRIVATE_BUS + offset
        if address & ~0xFFF == system_control.BASE:
            return self.system.read(address & 0xFFF, size)
        return 0

    def _write_private(self, engine, offset, size, value, _):
        address = PRIVATE_BUS + offset
        if address & ~0xFFF == system_control.BASE:
            self.system.write(address & 0xFFF, size, value)
