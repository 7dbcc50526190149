"""The board's Ethernet PHY, a LAN8742A at address 0 (its data sheet DS00001989, chapter 4)."""

from .clock import MILLISECOND, SECOND

BASIC_CONTROL, BASIC_STATUS, OFFER, PARTNER = 0, 1, 4, 5
IDENTIFIERS = {2: 0x0007, 3: 0xC131}
SOFT_RESET, RESTART = 1 << 15, 1 << 9
# Extended capability, negotiation possible, 10 and 100 Mbit/s; then negotiation done, link up.
ABILITIES, NEGOTIATED, LINK = 0x7809, 1 << 5, 1 << 2
NEGOTIATION = 2 * SECOND
# Abilities as both ends offer them, best first: 100 and 10 Mbit/s, each with and without both directions at once (IEEE 802.3,
# annex 28B); all of them after a reset, of 802.3.
SPEEDS = ((1 << 8, (100, True)), (1 << 7, (100, False)), (1 << 6, (10, True)), (1 << 5, (10, False)))
ALL_SPEEDS = 0x01E1


class Phy:
    def __init__(self, clock):
        self.clock = clock
        self.is_there = True
        self.has_clock = True
        self.has_cable = True
        self._reset_until = 0
        self._negotiated_at = None
        self._control = 0x3000
        self._offer = ALL_SPEEDS
        self.partner = ALL_SPEEDS

    def reset(self):
        self._offer = ALL_SPEEDS
        self._negotiated_at = self.clock.now() + NEGOTIATION

    def read(self, address, register):
        if not self.is_there or address != 0:
            return 0xFFFF
        if register == BASIC_CONTROL:
            return self._control | (SOFT_RESET if self.clock.now() < self._reset_until else 0)
        if register == BASIC_STATUS:
            return ABILITIES | ((NEGOTIATED | LINK) if self.has_link() else 0)
        if register in (OFFER, PARTNER):
            return self._offer if register == OFFER else self.partner
        return IDENTIFIERS.get(register, 0)

    def write(self, address, register, value):
        if not self.is_there or address != 0:
            return
        if register == OFFER:
            self._offer = value
        if register != BASIC_CONTROL:
            return
        self._control = value & ~(SOFT_RESET | RESTART)
        if value & SOFT_RESET:
            self._reset_until = self.clock.now() + MILLISECOND
            self._offer = ALL_SPEEDS
        if value & (SOFT_RESET | RESTART):
            self._negotiated_at = self.clock.now() + NEGOTIATION

    def has_link(self):
        is_negotiated = self._negotiated_at is not None and self.clock.now() >= self._negotiated_at
        return self.is_there and self.has_cable and is_negotiated and self.speed() is not None

    def speed(self):
        """What both ends agree on: Mbit/s, and whether in both directions at once. None if they offer nothing that is the same."""
        return next((speed for bit, speed in SPEEDS if self._offer & self.partner & bit), None)
