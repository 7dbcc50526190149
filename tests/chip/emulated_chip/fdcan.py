"""FDCAN 1 (chapter 56): classic frames, transmit buffers, receive FIFOs with filters, error counters."""

from .can_bus import CanFrame
from .clock import SECOND
from .finding import Finding
from .registers import RegisterFile

RAM_SIZE = 0x2800
ELEMENT_WORDS = 18
ELEMENT_LENGTHS = [8, 12, 16, 20, 24, 32, 48, 64]
# Of ISO 11898-1: an error costs the sender eight, error passive from 128, bus-off from 256.
PASSIVE, BUS_OFF = 128, 256
# LEC of PSR: what has become of the last frame. Reading it makes `NO_CHANGE` of it.
NO_ERROR, ACKNOWLEDGE, BIT_DOMINANT, NO_CHANGE = 0, 3, 5, 7
RECOVERY_BITS = 128 * 11


class Fdcan(RegisterFile):
    def __init__(self, chip, lines, bus):
        super().__init__(chip, "can")
        self.ram = bytearray(RAM_SIZE)
        self.is_plugged = True
        self.bus = bus
        self._lines = lines
        # Frames by their buffers, in the order in which they were asked for, and the one that takes part in arbitration.
        self._pending = {}
        self._offered = None
        self._offered_at = 0
        self._put_buffer = 0
        self._errors = 0
        self._last_error = NO_CHANGE
        self.lost = 0
        self.refused = 0
        self.on_write("CCCR", self._write_control)
        self.on_write("IR", self._clear)
        self.on_write("IE", lambda word: self._store_and_tell("IE", word))
        self.on_write("ILS", lambda word: self._store_and_tell("ILS", word))
        self.on_write("ILE", lambda word: self._store_and_tell("ILE", word))
        self.on_write("TXBAR", self._add)
        self.on_write("TXBCR", self._cancel)
        self.on_write("NBTP", lambda word: self._protected("NBTP", word))
        for fifo in (0, 1):
            self.on_write(f"RXFA[{fifo}]", lambda word, fifo=fifo: self._acknowledge(fifo, word))
        self.on_read("TXFQS", self._queue_status)
        self.on_read("TXBRP", lambda: sum(1 << number for number in self._pending))
        self.on_read("PSR", self._protocol_status)
        self.on_read("ECR", self._error_counter)

    def reset(self):
        super().reset()
        if self._offered:
            self.bus.withdraw(self, self._offered)
        self._pending = {}
        self._offered = None
        self._put_buffer = 0
        self._errors = 0
        self._last_error = NO_CHANGE
        self.set("CREL", 0x3214_1218)
        self.set("ENDN", 0x8765_4321)
        self.set("CCCR", 1)
        self.set("NBTP", 0x0600_0A03)
        self._fifos = [[], []]
        self._tell()

    # Control

    def _write_control(self, word):
        register = self.register("CCCR")
        before = self.get("CCCR")
        if not register.get(word, "INIT"):
            word = register.put(word, "CCE", 0)
        if not register.get(before, "INIT") and not register.get(word, "INIT"):
            word = register.put(word, "CCE", 0)
        # The power-down acknowledge follows the request.
        word = register.put(word, "CSA", register.get(word, "CSR"))
        self.set("CCCR", word)
        if register.get(before, "INIT") and not register.get(word, "INIT") and self._errors >= BUS_OFF:
            self.chip.clock.after(RECOVERY_BITS * SECOND // max(1, self.bit_rate()), self._recover)
        elif self.is_on():
            self._offer()

    def _protected(self, name, word):
        if self.get("CCCR", "INIT") and self.get("CCCR", "CCE"):
            self.set(name, word)
        else:
            self.chip.end(Finding("misuse", f"{name} of FDCAN is written outside its configuration (56.3.1)"))

    def _store_and_tell(self, name, word):
        self.set(name, word)
        self._tell()

    def is_on(self):
        return not self.get("CCCR", "INIT") and self._errors < BUS_OFF

    def bit_rate(self):
        segments = self.get("NBTP", "NTSEG1") + self.get("NBTP", "NTSEG2") + 3
        return self.chip.peripherals["RCC"].can_clock() // (self.get("NBTP", "NBRP") + 1) // segments

    # Interrupts

    def _raise(self, flag):
        self.put("IR", flag, 1)
        self._tell()

    def _clear(self, word):
        self.set("IR", self.get("IR") & ~word)
        self._tell()

    def _tell(self):
        active = self.get("IR") & self.get("IE")
        selected = self.get("ILS")
        for line, interrupt in enumerate(self._lines):
            mine = active & (selected if line else ~selected)
            self.chip.exceptions.set_level(interrupt, bool(mine and self.get("ILE") >> line & 1))

    # Sending

    def _element(self, start_word, number, length_code):
        words = 2 + ELEMENT_LENGTHS[length_code] // 4
        offset = 4 * (start_word + number * words)
        raw = self.ram[offset : offset + 4 * words]
        return offset, [int.from_bytes(raw[place : place + 4], "little") for place in range(0, len(raw), 4)]

    def _buffers(self):
        return self.get("TXBC", "TFQS") + self.get("TXBC", "NDTB")

    def _is_fifo(self):
        """Whether frames are sent in the order in which they were asked for; else the lowest identifier goes first, and of the same
        one the lowest buffer, whichever is older ("Tx FIFO" and "Tx queue", TFQM of TXBC)."""
        return not self.get("TXBC", "TFQM")

    def _error_counter(self):
        self._note_unheard()
        return min(self._errors, 255)

    def _queue_status(self):
        register = self.register("TXFQS")
        count = self._buffers()
        free = [number for number in range(count) if number not in self._pending]
        if self._is_fifo():
            behind = [(self._put_buffer + step) % count for step in range(count)] if count else []
            free = [number for number in behind if number in free] if behind and behind[0] in free else []
        status = register.put(0, "TFQF", int(not free))
        status = register.put(status, "TFFL", len(free))
        return register.put(status, "TFQPI", free[0] if free else self._put_buffer)

    def _add(self, word):
        for number in range(self._buffers()):
            if word >> number & 1 and number not in self._pending:
                _, words = self._element(self.get("TXBC", "TBSA"), number, self.get("TXESC", "TBDS"))
                self._pending[number] = self._frame(words)
                self.register("TXBTO")
                self.set("TXBTO", self.get("TXBTO") & ~(1 << number))
                self.set("TXBCF", self.get("TXBCF") & ~(1 << number))
                self._put_buffer = (number + 1) % self._buffers()
        if self.is_on():
            self._offer()

    def _frame(self, words):
        is_extended = bool(words[0] >> 30 & 1)
        identifier = words[0] & 0x1FFF_FFFF if is_extended else words[0] >> 18 & 0x7FF
        length = min(words[1] >> 16 & 15, 8)
        data = b"".join(word.to_bytes(4, "little") for word in words[2:4])[:length]
        return CanFrame(identifier, data, bool(words[0] >> 29 & 1), is_extended)

    def _next_frame(self):
        if not self._pending:
            return None
        if self._is_fifo():
            return next(iter(self._pending.values()))
        return min(self._pending.items(), key=lambda one: (one[1].identifier, one[0]))[1]

    def _offer(self):
        """Has the next frame take part in arbitration, instead of one that waits for it. One that is under way goes on."""
        best = self._next_frame()
        if best is None or best is self._offered:
            return
        if self._offered and not self.bus.withdraw(self, self._offered) and self._offered in self._pending.values():
            return
        self._offered, self._offered_at = best, self.chip.clock.now()
        self._try(best)

    def _try(self, frame):
        if self.bus.is_shorted:
            self._last_error = BIT_DOMINANT
            self._errors += 8
            if self._errors >= BUS_OFF:
                self._go_off()
            else:
                self.chip.clock.after(40 * SECOND // max(1, self.bit_rate()), lambda: self._try_again(frame))
            return
        self.bus.withdraw(self, frame)
        self.bus.send(self, frame)

    def _try_again(self, frame):
        if frame is self._offered and self.is_on():
            self._try(frame)

    def on_bus_change(self):
        """A short circuit destroys what is offered."""
        if self._offered and self.is_on() and self.bus.is_shorted:
            self._try(self._offered)

    def _is_unheard(self):
        """Whether a frame has been sent to nobody, again and again: each time costs eight, but not beyond error passive
        (ISO 11898-1, rules of fault confinement: an error passive sender that nobody acknowledges counts no further)."""
        if not self._offered or not self.is_on() or self.bus.is_shorted or self.bus.is_heard(self):
            return False
        return self.chip.clock.now() - self._offered_at >= self._offered.bits() * SECOND // max(1, self.bit_rate())

    def _note_unheard(self):
        if self._is_unheard():
            self._errors = max(self._errors, PASSIVE)
            self._last_error = ACKNOWLEDGE

    def _go_off(self):
        self._errors = BUS_OFF
        self._offered = None
        self.put("CCCR", "INIT", 1)
        self._raise("BO")

    def _recover(self):
        if self.bus.is_shorted:
            self.chip.clock.after(RECOVERY_BITS * SECOND // max(1, self.bit_rate()), self._recover)
            return
        self._errors = 0
        self._raise("BO")
        self._offer()

    def sent(self, frame):
        numbers = [number for number, pending in self._pending.items() if pending is frame]
        self._errors = max(0, self._errors - 1)
        self._last_error = NO_ERROR
        self._offered = None
        for number in numbers:
            del self._pending[number]
            self.set("TXBTO", self.get("TXBTO") | 1 << number)
            if self.get("TXBTIE") >> number & 1:
                self._raise("TC")
        if self.is_on():
            self._offer()

    def _cancel(self, word):
        for number in list(self._pending):
            if word >> number & 1:
                self._note_unheard()
                frame = self._pending.pop(number)
                if frame is self._offered and self.bus.withdraw(self, frame):
                    self._offered = None
                self.set("TXBCF", self.get("TXBCF") | 1 << number)
        if self.is_on():
            self._offer()

    # Receiving (56.3.4)

    def hear(self, frame):
        if not self.is_on() or not self.is_plugged or self.bit_rate() != self.bus.bit_rate:
            return
        self._last_error = NO_ERROR
        fifo = self._filter(frame)
        if fifo is None:
            self.refused += 1
            return
        size = self.get(f"RXFC[{fifo}]", "FS")
        waiting = self._fifos[fifo]
        if len(waiting) >= size:
            self.lost += 1
            self.put(f"RXFS[{fifo}]", "RFL", 1)
            self._raise(f"RFL[{fifo}]")
            return
        place = (self._put_index(fifo)) % size
        self._write_element(fifo, place, frame)
        waiting.append(place)
        self._update(fifo)
        self._raise(f"RFN[{fifo}]")

    def _put_index(self, fifo):
        waiting, size = self._fifos[fifo], self.get(f"RXFC[{fifo}]", "FS")
        return (waiting[-1] + 1) % size if waiting else self.get(f"RXFS[{fifo}]", "FPI")

    def _write_element(self, fifo, place, frame):
        start = self.get(f"RXFC[{fifo}]", "FSA")
        offset, words = self._element(start, place, self.get("RXESC", f"FDS[{fifo}]"))
        identifier = frame.identifier | 1 << 30 if frame.is_extended else frame.identifier << 18
        words[0] = identifier | int(frame.is_remote) << 29
        words[1] = len(frame.data) << 16 | 1 << 31
        data = frame.data + bytes(8 - len(frame.data))
        words[2], words[3] = (int.from_bytes(data[place : place + 4], "little") for place in (0, 4))
        self.ram[offset : offset + 4 * len(words)] = b"".join(word.to_bytes(4, "little") for word in words)

    def _update(self, fifo):
        waiting, size = self._fifos[fifo], self.get(f"RXFC[{fifo}]", "FS")
        self.put(f"RXFS[{fifo}]", "FFL", len(waiting))
        if waiting:
            self.put(f"RXFS[{fifo}]", "FGI", waiting[0])
            self.put(f"RXFS[{fifo}]", "FPI", (waiting[-1] + 1) % size)
        self.put(f"RXFS[{fifo}]", "FF", int(len(waiting) >= size))

    def _acknowledge(self, fifo, word):
        waiting = self._fifos[fifo]
        while waiting:
            if waiting.pop(0) == word & 0x3F:
                break
        self._update(fifo)

    def _filter(self, frame):
        """The FIFO that a frame goes to; None if it is refused."""
        if frame.is_remote and self.get("GFC", "RRFE" if frame.is_extended else "RRFS"):
            return None
        if not frame.is_extended:
            for number in range(self.get("SIDFC", "LSS")):
                offset = 4 * (self.get("SIDFC", "FLSSA") + number)
                word = int.from_bytes(self.ram[offset : offset + 4], "little")
                target = word >> 27 & 7
                if target and self._matches(word, frame.identifier):
                    return {1: 0, 2: 1}.get(target)
        other = self.get("GFC", "ANFE" if frame.is_extended else "ANFS")
        return other if other < 2 else None

    def _matches(self, word, identifier):
        kind, first, second = word >> 30, word >> 16 & 0x7FF, word & 0x7FF
        if kind == 0:
            return first <= identifier <= second
        if kind == 1:
            return identifier in (first, second)
        return kind == 2 and identifier & second == first & second

    def _protocol_status(self):
        self._note_unheard()
        register = self.register("PSR")
        status = register.put(0x0000_0700, "BO", int(self._errors >= BUS_OFF))
        status = register.put(status, "LEC", self._last_error)
        self._last_error = NO_CHANGE
        return register.put(status, "EP", int(self._errors >= PASSIVE))


class MessageRam:
    """The message memory of the FDCAN (table 8: 0x4000AC00)."""

    def __init__(self, fdcan):
        self._fdcan = fdcan

    def reset(self):
        pass

    def read(self, offset, size):
        return int.from_bytes(self._fdcan.ram[offset : offset + size], "little")

    def write(self, offset, size, value):
        self._fdcan.ram[offset : offset + size] = value.to_bytes(size, "little")
