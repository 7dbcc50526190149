"""The flash (chapter 4): words of 256 bits with ten bits for error correction, sectors of 128 KiB, two banks.

A word whose programming or erasing was cut short has a double error, and reading it is answered with a bus error (4.3.11,
4.7.6). So has one that was programmed twice with different contents, as its correction bits no longer fit (4.3.9). Times are
the data sheet's most (DS12110, "Flash memory programming"), by the parallelism that PSIZE selects.
"""

from .clock import MICROSECOND, MILLISECOND
from .registers import RegisterFile

WORD = 32
SECTOR = 128 * 1024
PROGRAM = [580 * MICROSECOND, 360 * MICROSECOND, 260 * MICROSECOND, 200 * MICROSECOND]
ERASE = [4000 * MILLISECOND, 3600 * MILLISECOND, 2200 * MILLISECOND, 2000 * MILLISECOND]
KEYS = (0x4567_0123, 0xCDEF_89AB)
ERASED = b"\xff" * WORD


class Flash:
    """What is kept without power: contents, and which words have a double error."""

    def __init__(self, size, contents=None):
        self.bytes = bytearray(contents or b"\xff" * size)
        self.bad = set()
        self.programs = 0
        self.erases = 0

    def copy(self):
        other = Flash(len(self.bytes), self.bytes)
        other.bad = set(self.bad)
        return other


class Bank:
    """One of the two: its lock, its write buffer, what it does now."""

    def __init__(self, interface, number, base, flash):
        self.interface = interface
        self.number = number
        self.base = base
        self.flash = flash
        self.reset()

    def reset(self):
        self.keys = []
        self.is_locked = True
        self.buffer = {}
        self.buffered_word = None
        self.busy_until = 0
        self._looked_at = -MICROSECOND

    def name(self, register):
        return f"BANK[{self.number}].{register}"

    def is_busy(self):
        return self.interface.chip.clock.now() < self.busy_until

    # Programming (4.3.9)

    def store(self, offset, size, value):
        """A store into the memory of the bank."""
        control = lambda field: self.interface.get(self.name("CR"), field)
        if self.is_locked or not control("PG"):
            self.fail("PGSERR")
            return
        word = offset & ~(WORD - 1)
        if self.buffered_word not in (None, word):
            self.fail("INCERR")
            return
        self.buffered_word = word
        for place in range(size):
            self.buffer[offset + place - word] = value >> 8 * place & 0xFF
        if len(self.buffer) == WORD:
            self._program(word, bytes(self.buffer[place] for place in range(WORD)))

    def _program(self, word, data):
        self.buffer, self.buffered_word = {}, None
        self.flash.programs += 1
        self._begin(PROGRAM)
        if self.interface.chip.cut.is_now("program"):
            self._leave_torn(word, data)
            return
        before = bytes(self.flash.bytes[word : word + WORD])
        if before != ERASED and before != data:
            self.flash.bad.add(word)
        mixed = bytes(old & new for old, new in zip(before, data))
        self._put(word, mixed)

    def _leave_torn(self, word, data):
        """Power goes while the word is programmed."""
        half = WORD // 2
        self._put(word, data[:half] + bytes(self.flash.bytes[word + half : word + WORD]))
        self.flash.bad.add(word)
        self.interface.chip.lose_power()

    # Erasing (4.3.10)

    def erase_sector(self, sector):
        self.flash.erases += 1
        self._begin(ERASE)
        first = sector * SECTOR
        words = range(first, first + SECTOR, WORD)
        is_cut = self.interface.chip.cut.is_now("erase")
        for word in words:
            if is_cut and bytes(self.flash.bytes[word : word + WORD]) != ERASED:
                self.flash.bad.add(word)
            elif not is_cut:
                self.flash.bad.discard(word)
                self.flash.bytes[word : word + WORD] = ERASED
        if is_cut:
            self.interface.chip.lose_power()
        self.interface.chip.on_flash_change(self.base + first, SECTOR)

    def _begin(self, times):
        parallelism = self.interface.get(self.name("CR"), "PSIZE")
        self.busy_until = self.interface.chip.clock.now() + times[parallelism]
        if self.number == 0:
            # The program is here.
            self.interface.chip.stall_until(self.busy_until)

    def _put(self, word, data):
        self.flash.bytes[word : word + WORD] = data
        self.interface.chip.on_flash_change(self.base + word, WORD)

    def fail(self, flag):
        self.interface.put(self.name("SR"), flag, 1)

    # Registers

    def write_key(self, word):
        self.keys = (self.keys + [word])[-2:]
        if tuple(self.keys) == KEYS:
            self.is_locked = False

    def write_control(self, word):
        register = self.interface.register(self.name("CR"))
        if register.get(word, "LOCK"):
            self.is_locked = True
            self.keys = []
        if self.is_locked:
            return
        start = register.get(word, "START")
        self.interface.words[register.offset] = register.put(register.put(word, "START", 0), "LOCK", 0)
        if start and register.get(word, "SER"):
            if self.interface.has_errors(self.number):
                return
            self.erase_sector(register.get(word, "SNB"))

    def read_control(self):
        register = self.interface.register(self.name("CR"))
        return register.put(self.interface.words.get(register.offset, 0), "LOCK", int(self.is_locked))

    def read_status(self):
        register = self.interface.register(self.name("SR"))
        status = self.interface.words.get(register.offset, 0)
        now = self.interface.chip.clock.now()
        # Who looks again at once does nothing else; who looks from time to time has the processor do other things between.
        if self.is_busy() and now - self._looked_at < MICROSECOND:
            self.interface.chip.clock.spin_until(self.busy_until)
        self._looked_at = self.interface.chip.clock.now()
        is_busy = int(self.is_busy())
        status = register.put(register.put(status, "BSY", is_busy), "QW", is_busy)
        return register.put(status, "WBNE", int(bool(self.buffer)))

    def clear(self, word):
        register = self.interface.register(self.name("SR"))
        self.interface.words[register.offset] = self.interface.words.get(register.offset, 0) & ~word


# FLASH_OPTSR_CUR as the factory leaves it, but with the brown-out reset at level 3, as the first power-up has it set.
OPTIONS = 0x0006_AAFC


class FlashInterface(RegisterFile):
    def __init__(self, chip, banks):
        super().__init__(chip, "flash")
        self.banks = [Bank(self, number, base, flash) for number, (base, flash) in enumerate(banks)]
        for bank in self.banks:
            self.on_write(bank.name("KEYR"), bank.write_key)
            self.on_write(bank.name("CR"), bank.write_control)
            self.on_read(bank.name("CR"), bank.read_control)
            self.on_read(bank.name("SR"), bank.read_status)
            # The status is read only; flags are cleared in CCR (4.9.6, 4.9.7).
            self.on_write(bank.name("SR"), lambda word: None)
            self.on_write(bank.name("CCR"), bank.clear)

    def reset(self):
        super().reset()
        self.set("ACR", 0x37)
        self.set("OPTSR_CUR", OPTIONS)
        for bank in self.banks:
            bank.reset()
            self.set(bank.name("CR"), 0x30)

    def has_errors(self, number):
        status = self.get(f"BANK[{number}].SR")
        errors = ["WRPERR", "PGSERR", "STRBERR", "INCERR", "OPERR"]
        return any(self.register(f"BANK[{number}].SR").get(status, flag) for flag in errors)

    def bank_of(self, address):
        return next((bank for bank in self.banks if bank.base <= address < bank.base + len(bank.flash.bytes)), None)

    def is_bad(self, address, size):
        """Whether a read of these bytes meets a double error."""
        bank = self.bank_of(address)
        if bank is None:
            return False
        first, last = (address - bank.base) & ~(WORD - 1), (address + size - 1 - bank.base) & ~(WORD - 1)
        return any(word in bank.flash.bad for word in range(first, last + 1, WORD))

    def note_double_error(self, address):
        bank = self.bank_of(address)
        bank.fail("DBECCERR")
        self.set(bank.name("FAR"), (address - bank.base) // WORD)


class PowerCut:
    """Power goes at the n-th operation of a kind, counted from now on; each operation is counted."""

    def __init__(self, at=None, kind="program"):
        self.at = at
        self.kind = kind
        self.count = 0

    def is_now(self, kind):
        if kind != self.kind:
            return False
        self.count += 1
        return self.count == self.at
