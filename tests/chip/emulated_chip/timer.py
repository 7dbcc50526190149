"""TIM2 (chapter 39): a counter with four compare channels, as the time driver uses it."""

from .clock import SECOND
from .registers import RegisterFile


class Timer(RegisterFile):
    def __init__(self, chip, interrupt):
        super().__init__(chip, "timer")
        self._interrupt = interrupt
        self.words = {}
        self.offsets = {"CR1": 0x00, "DIER": 0x0C, "SR": 0x10, "EGR": 0x14, "CNT": 0x24, "PSC": 0x28, "ARR": 0x2C}
        self._compare = [0x34, 0x38, 0x3C, 0x40]
        self._start = 0
        self._events = []
        self._prescaler = 0
        for name, handler in (("CR1", self._write_control), ("SR", self._write_status), ("EGR", self._generate)):
            self._writers[self.offsets[name]] = handler
        self._writers[self.offsets["DIER"]] = self._write_enable
        self._writers[self.offsets["CNT"]] = self._write_count
        self._readers[self.offsets["CNT"]] = self.count
        for offset in self._compare + [self.offsets["ARR"]]:
            self._writers[offset] = lambda word, offset=offset: self._write_compare(offset, word)

    def reset(self):
        self.words = {0x2C: 0xFFFF_FFFF}
        self._prescaler = 0
        self._start = 0
        self._cancel()
        self._tell()

    def _is_running(self):
        return self.words.get(0, 0) & 1

    def _period(self):
        return self.words[0x2C] + 1

    def _hertz(self):
        return self.chip.peripherals["RCC"].timer_clock() / (self._prescaler + 1)

    def _elapsed(self):
        """Counts since the counter was zero and the last time that it was set."""
        return (self.chip.clock.now() - self._start) * int(self._hertz()) // SECOND

    def count(self):
        if not self._is_running():
            return self.words.get(0x24, 0)
        return self._elapsed() % self._period()

    def _write_count(self, word):
        self.words[0x24] = word
        self._start = self.chip.clock.now() - word * SECOND // int(self._hertz())
        self._schedule()

    def _write_control(self, word):
        was_running = self._is_running()
        self.words[0] = word
        if word & 1 and not was_running:
            self._write_count(self.words.get(0x24, 0))
        elif not word & 1:
            self._cancel()

    def _write_status(self, word):
        # Flags are cleared by zeros (39.4.5).
        self.words[0x10] = self.words.get(0x10, 0) & word
        self._tell()

    def _write_enable(self, word):
        self.words[0x0C] = word
        self._tell()

    def _write_compare(self, offset, word):
        self.words[offset] = word
        self._schedule()

    def _generate(self, word):
        if word & 1:
            self._prescaler = self.words.get(0x28, 0)
            self._write_count(0)
            if not self.words.get(0, 0) & 4:
                self._raise(1)

    def _raise(self, flags):
        self.words[0x10] = self.words.get(0x10, 0) | flags
        self._tell()

    def _tell(self):
        is_high = bool(self.words.get(0x10, 0) & self.words.get(0x0C, 0) & 0x1F)
        self.chip.exceptions.set_level(self._interrupt, is_high)

    def _cancel(self):
        for event in self._events:
            event.cancel()
        self._events = []

    def _do_due(self):
        """What has matched by now is told, even if a register that is written at that very time changes what comes next."""
        now = self.chip.clock.now()
        for event in [event for event in self._events if event.action and event.time <= now]:
            action, event.action = event.action, None
            action()

    def _schedule(self):
        """The next match of each channel, and the next overflow."""
        self._do_due()
        self._cancel()
        if not self._is_running():
            return
        elapsed, period = self._elapsed(), self._period()
        turn = elapsed - elapsed % period
        for channel, offset in enumerate(self._compare):
            value = self.words.get(offset, 0)
            if value < period:
                at = turn + value
                self._add(at if at > elapsed else at + period, 2 << channel)
        self._add(turn + period, 1)

    def _add(self, count, flags):
        hertz = int(self._hertz())
        time = self._start + -(-count * SECOND // hertz)

        def match():
            self._raise(flags)
            self._add(count + self._period(), flags)

        self._events = [event for event in self._events if event.action]
        self._events.append(self.chip.clock.at(time, match))
