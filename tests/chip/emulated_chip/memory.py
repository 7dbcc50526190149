"""Memories (2.3, tables 7 and 8): which are there at once, which need a clock, what a reset leaves of them."""

import ctypes
import random

from unicorn import UC_PROT_ALL, UC_PROT_EXEC, UC_PROT_NONE, UC_PROT_READ

PAGE = 4096


class Ram:
    """A RAM. `clock` is the pair of register and field that it needs, `word` the bytes that share correction bits."""

    def __init__(self, chip, name, base, size, clock=None, word=4):
        self.chip = chip
        self.name = name
        self.base = base
        self.size = size
        self.clock = clock
        self.word = word
        self.memory = (ctypes.c_uint8 * size)()
        self.is_mapped = False
        self.forget(random.Random(base))

    def forget(self, source):
        """Without power: anything."""
        ctypes.memmove(self.memory, source.randbytes(self.size), self.size)

    def covers(self, address):
        return self.base <= address < self.base + self.size

    def bytes(self, address, size):
        return bytes(self.memory[address - self.base : address - self.base + size])

    def put(self, address, data):
        ctypes.memmove(ctypes.addressof(self.memory) + address - self.base, bytes(data), len(data))

    def follow_clock(self):
        """Is there only with its clock."""
        is_on = self.clock is None or self.chip.peripherals["RCC"].is_on(*self.clock)
        engine = self.chip.processor.engine
        if is_on and not self.is_mapped:
            engine.mem_map_ptr(self.base, self.size, UC_PROT_ALL, ctypes.addressof(self.memory))
        elif not is_on and self.is_mapped:
            engine.mem_unmap(self.base, self.size)
        self.is_mapped = is_on


class ProgramFlash:
    """The bank that the program is in: read and run, never written."""

    def __init__(self, chip, base, size, segments):
        self.base = base
        self.size = size
        self.memory = (ctypes.c_uint8 * size)(*b"\xff" * size)
        for address, data in segments:
            if not base <= address <= base + size - len(data):
                raise ValueError(f"the image has {len(data)} bytes at {address:#x}, where there is no flash")
            ctypes.memmove(ctypes.addressof(self.memory) + address - base, data, len(data))
        engine = chip.processor.engine
        engine.mem_map_ptr(base, size, UC_PROT_READ | UC_PROT_EXEC, ctypes.addressof(self.memory))


class DataFlash:
    """A bank from an offset on, through the data cache if it may hold it. Pages in which a word has a double error are apart: an
    access to them stops the processor before it, so that a bus fault has its exact place."""

    def __init__(self, chip, base, flash, first=0):
        self.chip = chip
        self.base = base
        self.flash = flash
        self.first = first
        self.size = len(flash.bytes)
        self.reads = 0
        self._bank = None
        self.open_page = None
        self._apart = {}
        self._cached = {}
        for page in range(first, self.size, PAGE):
            self._map(page)

    def _map(self, page):
        """Each page is a region of its own: Unicorn counts offsets from elsewhere where a region is taken apart."""
        self.chip.processor.engine.mmio_map(
            self.base + page,
            PAGE,
            lambda engine, offset, size, _: self._read(engine, page + offset, size, None),
            None,
            lambda engine, offset, size, value, _: self._write(engine, page + offset, size, value, None),
            None,
        )

    def covers(self, address):
        return self.base + self.first <= address < self.base + self.size

    def _is_cached(self, offset):
        """Whether the cache may hold an offset; protection is of whole sectors here."""
        sector = offset >> 17
        if sector not in self._cached:
            self._cached[sector] = self.chip.system.is_cached(self.base + offset)
        return self._cached[sector]

    def on_protection_change(self):
        self._cached = {}

    def seen(self, offset, size):
        """The bytes at an offset, as the processor sees them."""
        data = b""
        while size:
            line = offset & ~31
            count = min(size, line + 32 - offset)
            memory = self.flash.bytes[line : line + 32]
            if self._is_cached(line):
                memory = self.chip.cache.read_lines.read(self.base + line, memory)
            data += bytes(memory[offset - line : offset - line + count])
            offset, size = offset + count, size - count
        return data

    def _read(self, engine, offset, size, _):
        self.reads += 1
        # Who reads a bank that works waits until it has done (RM0468, 4.3.6).
        if self.bank().is_busy():
            self.chip.stall_until(self.bank().busy_until)
        if not self._is_cached(offset):
            return int.from_bytes(self.flash.bytes[offset : offset + size], "little")
        return int.from_bytes(self.seen(offset, size), "little")

    def _write(self, engine, offset, size, value, _):
        self.bank().store(offset, size, value)

    def bank(self):
        if self._bank is None:
            self._bank = self.chip.peripherals["FLASH"].bank_of(self.base)
        return self._bank

    def set_apart(self):
        """Pages with bad words, as they are now."""
        engine = self.chip.processor.engine
        wanted = {word & ~(PAGE - 1) for word in self.flash.bad}
        for page in set(self._apart) - wanted:
            engine.mem_unmap(self.base + page, PAGE)
            self._map(page)
            del self._apart[page]
        for page in wanted - set(self._apart):
            engine.mem_unmap(self.base + page, PAGE)
            memory = (ctypes.c_uint8 * PAGE)()
            engine.mem_map_ptr(self.base + page, PAGE, UC_PROT_NONE, ctypes.addressof(memory))
            self._apart[page] = memory

    def is_apart(self, address):
        return (address - self.base) & ~(PAGE - 1) in self._apart

    def open_for_a_block(self, address):
        """Lets the block of code that meets a page that is apart read it. The words around are good."""
        page = (address - self.base) & ~(PAGE - 1)
        ctypes.memmove(self._apart[page], self.seen(page, PAGE), PAGE)
        self.chip.processor.engine.mem_protect(self.base + page, PAGE, UC_PROT_ALL)
        self.open_page = page

    def close(self):
        """Behind that block."""
        if self.open_page in self._apart:
            self.chip.processor.engine.mem_protect(self.base + self.open_page, PAGE, UC_PROT_NONE)
        self.open_page = None

    def step_over(self, address, size, is_write):
        """Runs the one instruction that meets a page that is apart, and moves so many bytes."""
        page = (address - self.base) & ~(PAGE - 1)
        engine = self.chip.processor.engine
        ctypes.memmove(self._apart[page], self.seen(page, PAGE), PAGE)
        engine.mem_protect(self.base + page, PAGE, UC_PROT_ALL)
        self.chip.processor.step()
        engine.mem_protect(self.base + page, PAGE, UC_PROT_NONE)
        if is_write:
            place = address - self.base
            stored = bytes(self._apart[page][place - page : place - page + size])
            for offset in range(0, size, 4):
                part = stored[offset : offset + 4]
                self.bank().store(place + offset, len(part), int.from_bytes(part, "little"))
