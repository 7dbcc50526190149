"""Other nodes of the CAN bus."""


class Listener:
    """Acknowledges everything and remembers it."""

    def __init__(self, clock):
        self.clock = clock
        self.is_plugged = True
        self.heard = []

    def hear(self, frame):
        self.heard.append((self.clock.now(), frame))

    def sent(self, frame):
        pass

    def of(self, identifier, since=0):
        """Frames with an identifier, with their times."""
        return [(time, frame) for time, frame in self.heard if frame.identifier == identifier and time >= since]
