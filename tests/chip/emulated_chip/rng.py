"""The random number generator (chapter 33): repeatable here."""

import random

from .clock import MICROSECOND
from .registers import RegisterFile


class RandomNumbers(RegisterFile):
    def __init__(self, chip, seed=1):
        super().__init__(chip, "rng")
        self._random = random.Random(seed)
        self.given = 0
        self.on_read("SR", self._status)
        self.on_read("DR", self._data)
        self.on_write("CR", self._control)
        self._ready_at = None

    def reset(self):
        super().reset()
        self._ready_at = None

    def _control(self, word):
        self.set("CR", word)
        is_on = self.register("CR").get(word, "RNGEN") and self.chip.peripherals["RCC"].random_clock()
        # 33.3.5: the first number takes some 200 cycles of a clock of 48 MHz.
        self._ready_at = self.chip.clock.now() + 5 * MICROSECOND if is_on else None

    def _status(self):
        if self._ready_at is not None and self.chip.clock.now() < self._ready_at:
            self.chip.clock.spin_until(self._ready_at)
        return int(self._ready_at is not None and self.chip.clock.now() >= self._ready_at)

    def _data(self):
        if not self._status():
            return 0
        self.given += 1
        self._ready_at = self.chip.clock.now() + MICROSECOND
        return self._random.getrandbits(32)
