"""The independent watchdog (chapter 49), with an oscillator that is as wrong as the data sheet allows."""

from .clock import SECOND
from .registers import RegisterFile

# LSI, Hz (DS12110, "LSI oscillator characteristics"): least and most over temperature and supply, and the typical one.
LEAST, TYPICAL, MOST = 29_400, 32_000, 33_600
RELOAD, ACCESS, START = 0xAAAA, 0x5555, 0xCCCC


class Watchdog(RegisterFile):
    def __init__(self, chip, hertz=TYPICAL):
        super().__init__(chip, "iwdg", {8: 0xFFF})
        self.hertz = hertz
        self.feeds = []
        self.started_at = None
        self._event = None
        self._is_open = False
        self.on_write("KR", self._write_key)
        self.on_write("PR", lambda word: self._configure("PR", word & 7))
        self.on_write("RLR", lambda word: self._configure("RLR", word & 0xFFF))

    def reset(self):
        super().reset()
        self.started_at = None
        self._is_open = False
        if self._event:
            self._event.cancel()

    def period(self):
        divisor = 4 << min(self.get("PR"), 6)
        return (self.get("RLR") + 1) * divisor * SECOND // self.hertz

    def _configure(self, name, word):
        if self._is_open:
            self.set(name, word)

    def _write_key(self, word):
        key = word & 0xFFFF
        self._is_open = key == ACCESS
        if key == START:
            self.started_at = self.chip.clock.now()
        if key in (START, RELOAD) and self.started_at is not None:
            self.feeds.append(self.chip.clock.now())
            if self._event:
                self._event.cancel()
            self._event = self.chip.clock.after(self.period(), lambda: self.chip.request_reset("watchdog"))
