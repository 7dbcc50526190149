"""A CAN bus as messages with times: who sends when the bus is free, and what each node hears at its end."""

from .clock import SECOND


class CanFrame:
    def __init__(self, identifier, data=b"", is_remote=False, is_extended=False):
        self.identifier = identifier
        self.data = bytes(data)
        self.is_remote = is_remote
        self.is_extended = is_extended

    def bits(self):
        """Longest length with stuff bits and the pause behind (ISO 11898-1, 10.4 to 10.5)."""
        data = 0 if self.is_remote else 8 * len(self.data)
        header = 54 if self.is_extended else 34
        return header + data + (header + data - 1) // 4 + 13


class CanBus:
    """Nodes have `hear(frame)`, and `sent(frame)` for what they sent themselves."""

    def __init__(self, clock, bit_rate):
        self.clock = clock
        self.bit_rate = bit_rate
        self.nodes = []
        self.log = []
        self.is_shorted = False
        self._waiting = []
        self._is_busy = False
        self._number = 0

    def send(self, node, frame):
        self._number += 1
        self._waiting.append((frame.identifier, self._number, node, frame))
        self._next()

    def withdraw(self, node, frame):
        """Takes back a frame that waits; False if it is under way, or was sent."""
        before = len(self._waiting)
        self._waiting = [one for one in self._waiting if one[2] is not node or one[3] is not frame]
        return len(self._waiting) < before

    def _next(self):
        if self._is_busy or not self._waiting or self.is_shorted:
            return
        ready = [one for one in self._waiting if self.is_heard(one[2])]
        if not ready:
            return
        best = min(ready, key=lambda one: one[:2])
        self._waiting.remove(best)
        self._is_busy = True
        _, _, node, frame = best
        self.clock.after(frame.bits() * SECOND // self.bit_rate, lambda: self._end(node, frame))

    def _end(self, node, frame):
        self._is_busy = False
        self.log.append((self.clock.now(), frame, node))
        node.sent(frame)
        for other in self.nodes:
            if other is not node and self._is_plugged(other):
                other.hear(frame)
        self._next()

    def _is_plugged(self, node):
        return getattr(node, "is_plugged", True)

    def is_heard(self, node):
        """A frame that nobody acknowledges is sent again for ever."""
        return self._is_plugged(node) and any(self._is_plugged(other) for other in self.nodes if other is not node)

    def changed(self):
        """Somebody was plugged in or out, or the short circuit has come or gone."""
        for node in self.nodes:
            getattr(node, "on_bus_change", lambda: None)()
        self._next()
