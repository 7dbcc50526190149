"""The processor's own registers: interrupts, faults, protection of memory, caches (ARMv7-M ARM, B3; Cortex-M7 TRM r1p1)."""

from .exceptions import BUS_FAULT, MEMORY_FAULT

BASE = 0xE000_E000
CPUID = 0x411F_C271
# 16 KiB each, lines of 32 bytes: four ways of data, two of instructions (RM0433 2.1.1; CCSIDR, B4.8.2).
DATA_CACHE, INSTRUCTION_CACHE = 0xF00F_E019, 0xF01F_E009
LEVELS = 0x0900_0003
CACHE_TYPE = 0x8303_C003
REGIONS = 16

ISER, ICER, ISPR, ICPR, IABR, IPR = 0x100, 0x180, 0x200, 0x280, 0x300, 0x400
CPUID_AT, ICSR, VTOR, AIRCR, SCR, CCR, SHPR, SHCSR = 0xD00, 0xD04, 0xD08, 0xD0C, 0xD10, 0xD14, 0xD18, 0xD24
CFSR, HFSR, DFSR, MMFAR, BFAR = 0xD28, 0xD2C, 0xD30, 0xD34, 0xD38
CLIDR, CTR, CCSIDR, CSSELR, CPACR = 0xD78, 0xD7C, 0xD80, 0xD84, 0xD88
MPU_TYPE, MPU_CTRL, MPU_RNR, MPU_RBAR, MPU_RASR = 0xD90, 0xD94, 0xD98, 0xD9C, 0xDA0
DEMCR, FPCCR = 0xDFC, 0xF34
STIR = 0xF00
ICIALLU, DCIMVAC, DCISW, DCCMVAC, DCCSW, DCCIMVAC, DCCISW = 0xF50, 0xF5C, 0xF60, 0xF68, 0xF6C, 0xF70, 0xF74
RESET_KEY, RESET_REQUEST = 0x05FA, 1 << 2
BFHFNMIGN = 1 << 8
DATA_CACHE_ON, INSTRUCTION_CACHE_ON = 1 << 16, 1 << 17


class Region:
    """A region of the memory protection unit (B3.5)."""

    def __init__(self, base, attributes):
        self.attributes = attributes
        self.size = 2 << (attributes >> 1 & 31)
        self.base = base & ~(self.size - 1)

    def covers(self, address):
        if not self.attributes & 1 or not self.base <= address < self.base + self.size:
            return False
        disabled = self.attributes >> 8 & 0xFF
        return self.size < 256 or not disabled >> (address - self.base) * 8 // self.size & 1

    def parts(self):
        """What of it counts: all of it, or those of its eight parts that are not disabled, as first addresses and sizes."""
        if self.size < 256 or not self.attributes >> 8 & 0xFF:
            return [(self.base, self.size)]
        part = self.size // 8
        return [(self.base + number * part, part) for number in range(8) if not self.attributes >> 8 + number & 1]

    def is_shared(self):
        """Whether other masters are to see accesses in their order: device and strongly-ordered memory always, normal memory
        by its bit S (table B3-13)."""
        kind, cached = self.attributes >> 19 & 7, self.attributes >> 17 & 1
        if (kind, cached) == (0, 0):
            return True
        return kind != 2 and bool(self.attributes >> 18 & 1)

    def forbids(self, is_write):
        access = self.attributes >> 24 & 7
        return access == 0 or is_write and access in (5, 6, 7)

    def is_cached(self):
        """Whether normal memory that may be held in a cache (table B3-13)."""
        kind, cached, buffered = self.attributes >> 19 & 7, self.attributes >> 17 & 1, self.attributes >> 16 & 1
        is_shared = self.attributes >> 18 & 1
        if kind & 4:
            return kind & 3 != 0 or bool(cached or buffered)
        # Shareable memory is not cached by this processor (Cortex-M7 TRM 5.2.1).
        return not is_shared and (kind, cached) in ((0, 1), (1, 1))


class SystemControl:
    def __init__(self, chip):
        self.chip = chip
        self.words = {}
        self.enabled = set()
        self.priorities = {}
        self.regions = {}
        self.reset()

    def reset(self):
        self.words = {VTOR: 0x0800_0000, CCR: 0x0004_0200, AIRCR: 0xFA05_0000, FPCCR: 0xC000_0000}
        self.enabled = set()
        self.priorities = {}
        self.regions = {}

    # What others ask

    def vector_table(self):
        return self.words[VTOR]

    def priority(self, number):
        return self.priorities.get(number, 0)

    def is_enabled(self, interrupt):
        return interrupt in self.enabled

    def is_fault_enabled(self, bit):
        return bool(self.words.get(SHCSR, 0) & bit)

    def ignores_bus_faults(self):
        return bool(self.words[CCR] & BFHFNMIGN)

    def has_data_cache(self):
        return bool(self.words[CCR] & DATA_CACHE_ON)

    def region(self, address):
        """The region that decides about an address: the highest one that covers it."""
        if not self.words.get(MPU_CTRL, 0) & 1:
            return None
        covering = [number for number, region in self.regions.items() if region.covers(address)]
        return self.regions[max(covering)] if covering else None

    def is_cached(self, address):
        """Whether the data cache may hold this address; without a region, what the default map says (B3.1)."""
        if not self.has_data_cache() or address < 0x0002_0000 or 0x2000_0000 <= address < 0x2002_0000:
            return False
        region = self.region(address)
        if region:
            return region.is_cached()
        return address < 0x4000_0000 or 0x6000_0000 <= address < 0xA000_0000

    def is_shared(self, address):
        """Whether this address is shareable; without a region, what the default map says (B3.1): the memories are not."""
        region = self.region(address)
        if region:
            return region.is_shared()
        return 0x4000_0000 <= address < 0x6000_0000 or address >= 0xA000_0000

    def forbids(self, address, is_write):
        region = self.region(address)
        return bool(region and region.forbids(is_write))

    def note_fault(self, cause, hard, address=None, number=None):
        self.words[CFSR] = self.words.get(CFSR, 0) | cause
        self.words[HFSR] = self.words.get(HFSR, 0) | hard
        if address is not None:
            self.words[{BUS_FAULT: BFAR, MEMORY_FAULT: MMFAR}[number]] = address

    # Registers

    def read(self, offset, size):
        word = self._read_word(offset & ~3)
        return word >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def _read_word(self, offset):
        fixed = {
            CPUID_AT: CPUID,
            CLIDR: LEVELS,
            CTR: CACHE_TYPE,
            CCSIDR: INSTRUCTION_CACHE if self.words.get(CSSELR, 0) & 1 else DATA_CACHE,
            MPU_TYPE: REGIONS << 8,
        }
        if offset in fixed:
            return fixed[offset]
        exceptions = self.chip.exceptions
        for first, numbers in ((ISER, self.enabled), (ICER, self.enabled)):
            if first <= offset < first + 0x20:
                return self._bits(offset - first, numbers)
        for first, numbers in ((ISPR, exceptions.pending), (ICPR, exceptions.pending), (IABR, exceptions.active)):
            if first <= offset < first + 0x20:
                return self._bits(offset - first, {number - 16 for number in numbers})
        if IPR <= offset < IPR + 240:
            return self._priority_word(16 + offset - IPR)
        if SHPR <= offset < SHPR + 12:
            return self._priority_word(4 + offset - SHPR)
        if offset == ICSR:
            active = exceptions.active[-1] if exceptions.active else 0
            return active | (1 << 22 if exceptions.has_wakeup() else 0)
        if offset == MPU_RASR:
            region = self.regions.get(self.words.get(MPU_RNR, 0))
            return region.attributes if region else 0
        return self.words.get(offset, 0)

    def _bits(self, offset, numbers):
        first = offset * 8
        return sum(1 << number - first for number in numbers if first <= number < first + 32)

    def _priority_word(self, first):
        return sum(self.priorities.get(first + place, 0) << 8 * place for place in range(4))

    def write(self, offset, size, value):
        # Priorities are bytes of their own.
        for base, first in ((IPR, 16), (SHPR, 4)):
            if base <= offset < base + (240 if base == IPR else 12):
                for place in range(size):
                    self.priorities[first + offset - base + place] = value >> 8 * place & 0xF0
                self.chip.processor.stop_soon()
                return
        if size < 4:
            shift = 8 * (offset & 3)
            mask = (1 << 8 * size) - 1 << shift
            value = self.words.get(offset & ~3, 0) & ~mask | value << shift & mask
        self._write_word(offset & ~3, value)

    def _write_word(self, offset, value):
        exceptions = self.chip.exceptions
        numbers = lambda first: [(offset - first) * 8 + bit for bit in range(32) if value >> bit & 1]
        if ISER <= offset < ISER + 0x20:
            self.enabled.update(numbers(ISER))
        elif ICER <= offset < ICER + 0x20:
            self.enabled.difference_update(numbers(ICER))
        elif ISPR <= offset < ISPR + 0x20:
            for number in numbers(ISPR):
                exceptions.pend(number + 16)
        elif ICPR <= offset < ICPR + 0x20:
            for number in numbers(ICPR):
                exceptions.unpend(number + 16)
        elif offset == STIR:
            exceptions.pend((value & 0x1FF) + 16)
        elif offset == ICSR:
            for bit, number, is_set in ((28, 14, True), (27, 14, False), (26, 15, True), (25, 15, False)):
                if value >> bit & 1:
                    exceptions.pend(number) if is_set else exceptions.unpend(number)
        elif offset == AIRCR:
            if value >> 16 == RESET_KEY and value & RESET_REQUEST:
                self.chip.request_reset("software")
        elif offset in (CFSR, HFSR, DFSR):
            self.words[offset] = self.words.get(offset, 0) & ~value
        elif offset in (MPU_CTRL, MPU_RBAR, MPU_RASR):
            self._protect(offset, value)
        elif ICIALLU <= offset <= DCCISW:
            self.chip.cache.maintain(offset, value)
        else:
            self.words[offset] = value
            if offset == CCR:
                self.chip.data_flash.on_protection_change()
        self.chip.processor.stop_soon()

    def _protect(self, offset, value):
        if offset == MPU_CTRL:
            self.words[MPU_CTRL] = value
        elif offset == MPU_RBAR:
            if value & 1 << 4:
                self.words[MPU_RNR] = value & 15
            self.words[MPU_RBAR] = value
        else:
            self.regions[self.words.get(MPU_RNR, 0)] = Region(self.words.get(MPU_RBAR, 0) & ~31, value)
        self.chip.on_protection_change()
