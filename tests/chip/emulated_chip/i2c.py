"""The I2C controller (chapter 47) as a master with addresses of seven bits, and the wires behind it."""

from .clock import SECOND
from .finding import Finding
from .registers import RegisterFile

# A byte and its acknowledgement.
BITS = 9
# What is gone when the controller is off (47.7.1), and what each bit of ICR clears (47.7.8).
FLAGS = ("TXIS", "RXNE", "NACKF", "STOPF", "TC", "BUSY")
CLEARED = {"NACKCF": "NACKF", "STOPCF": "STOPF"}


class I2c(RegisterFile):
    def __init__(self, chip):
        # 47.7.7: nothing waits to be sent.
        super().__init__(chip, "i2c", {chip.description.register("i2c", "ISR").offset: 1})
        self.devices = []
        self._is_held = False
        self._device = None
        self._is_read = False
        self._left = 0
        self._next = None
        self.on_write("CR1", self._control)
        self.on_write("CR2", self._command)
        self.on_write("ICR", self._clear)
        self.on_write("TXDR", self._send)
        self.on_write("ISR", lambda word: None)
        self.on_read("ISR", self._status)
        self.on_read("RXDR", self._take)

    def reset(self):
        super().reset()
        self._next = None

    def bit_time(self):
        """Of the clock wire, ns (47.7.5); what its edges take comes on top."""
        cycles = (self.get("TIMINGR", "SCLL") + self.get("TIMINGR", "SCLH") + 2) * (self.get("TIMINGR", "PRESC") + 1)
        return cycles * SECOND / self.chip.peripherals["RCC"].peripheral_clock("D2CFGR", "D2PPRE1")

    def _flag(self, name, is_set=1):
        self.put("ISR", name, is_set)

    def _after(self, bits, action):
        self._next = (self.chip.clock.now() + int(bits * self.bit_time()), action)

    def _control(self, word):
        self.set("CR1", word)
        if not self.register("CR1").get(word, "PE"):
            # Everything is as after a reset (47.4.6).
            self._next = None
            self.put("CR2", "START", 0)
            for flag in FLAGS:
                self._flag(flag, 0)

    def hold(self, is_held):
        """Somebody holds the data wire low, or lets it go: a start that waits comes then (47.4.9)."""
        self._is_held = is_held
        if not is_held and self.get("CR2", "START"):
            self._after(BITS + 1, self._begin)

    def _command(self, word):
        register = self.register("CR2")
        if register.get(word, "RELOAD") or register.get(word, "ADD10"):
            self.chip.end(Finding("emulator", "only addresses of seven bits and up to 255 bytes are modelled"))
        is_begun, is_ended = register.get(word, "START"), register.get(word, "STOP")
        # A start that waits is taken back by nobody who writes a zero (47.7.2).
        self.set("CR2", register.put(word, "START", is_begun | self.get("CR2", "START")))
        if is_ended and not self.get("CR2", "START"):
            self.put("CR2", "STOP", 0)
            self._stop()
        if is_begun and self.get("CR1", "PE"):
            self._flag("TC", 0)
            self._flag("BUSY")
            if not self._is_held:
                self._after(BITS + 1, self._begin)

    def _begin(self):
        self.put("CR2", "START", 0)
        address = self.get("CR2", "SADD") >> 1 & 0x7F
        self._is_read, self._left = bool(self.get("CR2", "DIR")), self.get("CR2", "NBYTES")
        self._device = next((one for one in self.devices if one.is_there and one.address == address), None)
        if self._device is None:
            # A stop follows by itself (47.4.9).
            self._flag("NACKF")
            self._after(1, self._stop)
            return
        self._device.begin(self._is_read)
        self._go_on()

    def _go_on(self):
        if self._left == 0:
            if self.get("CR2", "AUTOEND"):
                self._after(1, self._stop)
            else:
                self._flag("TC")
        elif self._is_read:
            self._after(BITS, self._receive)
        else:
            self._flag("TXIS")

    def _receive(self):
        self.set("RXDR", self._device.read())
        self._flag("RXNE")

    def _take(self):
        if self.get("ISR", "RXNE"):
            self._flag("RXNE", 0)
            self._left -= 1
            self._go_on()
        return self.words.get(self.register("RXDR").offset, 0)

    def _send(self, word):
        if not self.get("ISR", "TXIS"):
            return
        self._flag("TXIS", 0)

        def sent():
            self._device.write(word & 0xFF)
            self._left -= 1
            self._go_on()

        self._after(BITS, sent)

    def _stop(self):
        self._next = None
        self._flag("BUSY", 0)
        self._flag("STOPF")

    def _clear(self, word):
        for bit, flag in CLEARED.items():
            if self.register("ICR").get(word, bit):
                self._flag(flag, 0)

    def _status(self):
        if self._next is not None:
            time, action = self._next
            if self.chip.clock.now() < time:
                self.chip.clock.spin_until(time)
            if self.chip.clock.now() >= time:
                self._next = None
                action()
        return self.get("ISR")
