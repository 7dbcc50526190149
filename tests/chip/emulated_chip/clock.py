"""Virtual time: what is due, and how long the processor takes.

One halfword of code counts as one cycle of the processor. That is no model of the Cortex-M7, which runs up to two
instructions in a cycle and waits for memories: no statement about deadlines of the processor rests on it. Peripherals keep
their own times. Everything is in nanoseconds.
"""

import heapq

MICROSECOND = 1_000
MILLISECOND = 1_000_000
SECOND = 1_000_000_000


class Event:
    """Something that is due; `cancel` takes it back."""

    def __init__(self, time, action):
        self.time = time
        self.action = action

    def cancel(self):
        self.action = None


class Clock:
    """Time since power came, over all resets."""

    def __init__(self, progress):
        self._progress = progress
        self._base = 0
        self._from = 0
        self._hertz = 64_000_000
        self._events = []
        self._number = 0

    def now(self):
        return self._base + (self._progress.halfwords - self._from) * SECOND // self._hertz

    def set_processor_clock(self, hertz):
        self._jump(self.now())
        self._hertz = hertz

    def _jump(self, time):
        self._base = time
        self._from = self._progress.halfwords

    def at(self, time, action):
        event = Event(time, action)
        self._number += 1
        heapq.heappush(self._events, (time, self._number, event))
        # The processor may be under way to something later.
        self._progress.limit = min(self._progress.limit, self._progress.halfwords + self.cycles_until(time))
        return event

    def after(self, delay, action):
        return self.at(self.now() + delay, action)

    def next_due(self):
        while self._events and self._events[0][2].action is None:
            heapq.heappop(self._events)
        return self._events[0][0] if self._events else None

    def run_due(self):
        """Does what is due."""
        while (due := self.next_due()) is not None and due <= self.now():
            _, _, event = heapq.heappop(self._events)
            action, event.action = event.action, None
            action()

    def forget_all(self):
        """Power was lost."""
        self._events.clear()

    def sleep_until(self, time):
        """The processor does nothing until then."""
        if time > self.now():
            self._jump(time)

    def spin_until(self, time):
        """The processor polls something that changes then: what it would run meanwhile is not run. Other events come first."""
        due = self.next_due()
        self.sleep_until(time if due is None else min(time, due))
        self.interrupt()

    def interrupt(self):
        """Ends the processor's run behind this block of code."""
        self._progress.limit = self._progress.halfwords

    def cycles_until(self, time):
        return max(0, -(-(time - self.now()) * self._hertz // SECOND))
