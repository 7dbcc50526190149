"""A peripheral as a file of 32-bit words, some of which do something when they are read or written."""


class RegisterFile:
    """Words by their offsets. What has neither a reader nor a writer is kept as it was written."""

    def __init__(self, chip, kind, resets=None):
        self.chip = chip
        self.kind = kind
        self._registers = chip.description.registers(kind)
        self._resets = dict(resets or {})
        self.words = dict(self._resets)
        self._readers = {}
        self._writers = {}

    def reset(self):
        """What the reset of the peripheral, or of the chip, makes of it."""
        self.words = dict(self._resets)

    def register(self, name):
        return self._registers[name]

    def on_read(self, name, reader):
        self._readers[self.register(name).offset] = reader

    def on_write(self, name, writer):
        self._writers[self.register(name).offset] = writer

    def get(self, name, field=None):
        register = self._registers[name]
        word = self.words.get(register.offset, 0)
        return word if field is None else register.get(word, field)

    def put(self, name, field, part):
        register = self.register(name)
        self.words[register.offset] = register.put(self.words.get(register.offset, 0), field, part)

    def set(self, name, word):
        self.words[self.register(name).offset] = word

    def read_word(self, offset):
        reader = self._readers.get(offset)
        return reader() if reader else self.words.get(offset, 0)

    def write_word(self, offset, word):
        writer = self._writers.get(offset)
        if writer:
            writer(word)
        else:
            self.words[offset] = word

    def read(self, offset, size):
        word = self.read_word(offset & ~3)
        return word >> 8 * (offset & 3) & (1 << 8 * size) - 1

    def write(self, offset, size, value):
        if size < 4:
            shift = 8 * (offset & 3)
            mask = (1 << 8 * size) - 1 << shift
            value = self.words.get(offset & ~3, 0) & ~mask | value << shift & mask
        self.write_word(offset & ~3, value)
