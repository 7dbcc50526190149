"""A gyro on I2C, a BMI160 (its data sheet BST-BMI160-DS000, 2.11): three rates, a hundred times a second."""

import math

from .clock import MILLISECOND

CHIP_ID, RATES, STATUS, RANGE, COMMAND = 0x00, 0x0C, 0x1B, 0x43, 0x7E
IDENTITY, GYRO_NORMAL, GYRO_READY = 0xD1, 0x15, 1 << 6
START_UP, PERIOD = 80 * MILLISECOND, 10 * MILLISECOND
# Steps of a degree a second in each range (table 3).
STEPS = {0: 16.4, 1: 32.8, 2: 65.6, 3: 131.2, 4: 262.4}


class Bmi160:
    def __init__(self, clock, address=0x68):
        self.clock = clock
        self.address = address
        self.is_there = True
        self.steps = (0, 0, 0)
        self.range = 0
        self._pointer = 0
        self._is_pointed = False
        self._measures_from = None
        self._read = 0

    def rate(self, steps):
        """So many steps in the range that was set, rad/s."""
        return math.radians(1 / STEPS[self.range]) * steps

    def begin(self, is_read):
        self._is_pointed = is_read

    def write(self, value):
        if not self._is_pointed:
            self._pointer, self._is_pointed = value, True
            return
        if (self._pointer, value) == (COMMAND, GYRO_NORMAL):
            self._measures_from, self._read = self.clock.now() + START_UP, 0
        elif self._pointer == RANGE:
            self.range = value
        self._pointer += 1

    def read(self):
        value = self._register(self._pointer)
        self._pointer += 1
        return value

    def _readings(self):
        """Readings since the start."""
        if self._measures_from is None or self.clock.now() < self._measures_from:
            return 0
        return 1 + (self.clock.now() - self._measures_from) // PERIOD

    def _register(self, address):
        if address == CHIP_ID:
            return IDENTITY
        if address == STATUS:
            return GYRO_READY if self._readings() > self._read else 0
        if RATES <= address < RATES + 6:
            self._read = self._readings()
            axis, place = divmod(address - RATES, 2)
            return self.steps[axis] >> 8 * place & 0xFF
        return self.range if address == RANGE else 0
