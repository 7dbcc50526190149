"""The data cache, where it matters: lines of memory that was written under it, and lines of RAM that a reset throws away.

Lines are 32 bytes; 16 KiB in four ways, so 128 sets (RM0433 2.1.1; Cortex-M7 TRM 5.2). The oldest line of a set makes room,
which is the best that a pseudo-random choice can be for a line that was just used.
"""

LINE = 32
SETS = 128
WAYS = 4

# Offsets of the operations in the system control space (ARMv7-M ARM B3.2.2, table B3-3).
ICIALLU, DCIMVAC, DCISW, DCCMVAC, DCCSW, DCCIMVAC, DCCISW = 0xF50, 0xF5C, 0xF60, 0xF68, 0xF6C, 0xF70, 0xF74
CLEANS = (DCCMVAC, DCCSW, DCCIMVAC, DCCISW)
DROPS = (DCIMVAC, DCISW, DCCIMVAC, DCCISW)
BY_ADDRESS = (DCIMVAC, DCCMVAC, DCCIMVAC)


class ReadLines:
    """Lines that were read of a memory that others change: what the processor sees may be older than what is there."""

    def __init__(self):
        self._lines = {}
        self.stale_reads = 0

    def read(self, line, memory):
        """The 32 bytes at a line's address, as the processor sees them."""
        held = self._lines.pop(line, None)
        if held is None:
            held = bytes(memory)
            in_set = [other for other in self._lines if other // LINE % SETS == line // LINE % SETS]
            if len(in_set) >= WAYS:
                del self._lines[in_set[0]]
        elif held != bytes(memory):
            self.stale_reads += 1
        self._lines[line] = held
        return held

    def drop(self, line):
        self._lines.pop(line, None)

    def drop_set_and_way(self, operand):
        """By set and way nothing is known of the address: the oldest line of the set goes, or any."""
        wanted = operand >> 5 & SETS - 1
        for line in [line for line in self._lines if line // LINE % SETS == wanted][:1]:
            del self._lines[line]

    def clear(self):
        self._lines = {}


class WrittenLines:
    """Lines of RAM that were written and not cleaned, with what the memory behind them holds."""

    def __init__(self):
        self._behind = {}

    def write(self, line, before):
        known = self._behind.pop(line, None)
        if known is None:
            in_set = [other for other in self._behind if other // LINE % SETS == line // LINE % SETS]
            if len(in_set) >= WAYS:
                del self._behind[in_set[0]]
        self._behind[line] = before if known is None else known

    def clean(self, line):
        self._behind.pop(line, None)

    def clean_set_and_way(self, operand):
        wanted = operand >> 5 & SETS - 1
        for line in [line for line in self._behind if line // LINE % SETS == wanted][:1]:
            del self._behind[line]

    def lost(self):
        """What a reset now leaves of the dirty lines: the memory behind each."""
        return dict(self._behind)

    def clear(self):
        self._behind = {}


class Cache:
    def __init__(self):
        self.read_lines = ReadLines()
        self.written_lines = WrittenLines()

    def reset(self):
        self.read_lines.clear()
        self.written_lines.clear()

    def maintain(self, operation, operand):
        line = operand & ~(LINE - 1)
        if operation in CLEANS:
            if operation in BY_ADDRESS:
                self.written_lines.clean(line)
            else:
                self.written_lines.clean_set_and_way(operand)
        if operation in DROPS:
            if operation in BY_ADDRESS:
                self.read_lines.drop(line)
            else:
                self.read_lines.drop_set_and_way(operand)
