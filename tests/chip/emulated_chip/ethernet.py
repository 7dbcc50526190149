"""The Ethernet controller (chapter 58): management of the PHY, rings of descriptors, frames as messages with times."""

from .clock import MICROSECOND
from .registers import RegisterFile

# DMACSR and DMACIER (58.11.2): transmitted, received, their summary.
TRANSMITTED, RECEIVED, NORMAL = 1 << 0, 1 << 6, 1 << 15
OWN, FIRST, LAST = 1 << 31, 1 << 29, 1 << 28
DESCRIPTOR = 16
# 100 Mbit/s: preamble, frame, checksum and pause.
NANOSECONDS_A_BYTE, OVERHEAD = 80, 24
MANAGEMENT = 30 * MICROSECOND
RMII = 4


class Ethernet(RegisterFile):
    def __init__(self, chip, interrupt, phy):
        super().__init__(chip, "eth")
        self.phy = phy
        self.network = None
        self.received = 0
        self.dropped = 0
        self._interrupt = interrupt
        self._transmit_place = 0
        self._receive_place = 0
        self._managed_until = 0
        self._reset_until = None
        dma, mac = "ETHERNET_DMA.", "ETHERNET_MAC."
        self.on_write(dma + "DMAMR", self._write_mode)
        self.on_read(dma + "DMAMR", self._read_mode)
        self.on_write(dma + "DMACSR", self._clear)
        self.on_write(dma + "DMACIER", self._enable)
        self.on_write(dma + "DMACTX_DTPR", self._transmit)
        self.on_write(dma + "DMACTX_DLAR", lambda word: self._place_ring("DMACTX_DLAR", word))
        self.on_write(dma + "DMACRX_DLAR", lambda word: self._place_ring("DMACRX_DLAR", word))
        self.on_write(mac + "MACMDIOAR", self._manage)
        self.on_read(mac + "MACMDIOAR", self._management_status)

    def reset(self):
        super().reset()
        self._transmit_place = self._receive_place = 0
        self._reset_until = None
        self._tell()

    def _dma(self, name, field=None):
        return self.get("ETHERNET_DMA." + name, field)

    # Reset of the DMA: it ends only when all clocks run (58.4.1)

    def has_clocks(self):
        rcc = self.chip.peripherals["RCC"]
        is_clocked = rcc.is_on("AHB1ENR", "ETHTXEN") and rcc.is_on("AHB1ENR", "ETHRXEN")
        selected = self.chip.peripherals["SYSCFG"].get("PMCR", "ETH_SEL_PHY") == RMII
        pin = self.chip.peripherals["GPIOA"].alternate_function(1) == 11
        return is_clocked and selected and pin and self.phy.is_there and self.phy.has_clock

    def _write_mode(self, word):
        if word & 1:
            delay = 2 * MICROSECOND
            self.reset()
            self._reset_until = self.chip.clock.now() + delay if self.has_clocks() else float("inf")

    def _read_mode(self):
        if self._reset_until is None:
            return 0
        now = self.chip.clock.now()
        if now >= self._reset_until:
            self._reset_until = None
            return 0
        self.chip.clock.spin_until(min(self._reset_until, now + MICROSECOND))
        return 1

    # Management of the PHY

    def _manage(self, word):
        register = self.register("ETHERNET_MAC.MACMDIOAR")
        self.words[register.offset] = word
        if not register.get(word, "MB"):
            return
        address, place = register.get(word, "PA"), register.get(word, "RDA")
        if register.get(word, "GOC") == 3:
            self.set("ETHERNET_MAC.MACMDIODR", self.phy.read(address, place))
        else:
            self.phy.write(address, place, self.get("ETHERNET_MAC.MACMDIODR") & 0xFFFF)
        self._managed_until = self.chip.clock.now() + MANAGEMENT

    def _management_status(self):
        register = self.register("ETHERNET_MAC.MACMDIOAR")
        if self.chip.clock.now() < self._managed_until:
            self.chip.clock.spin_until(self._managed_until)
        is_busy = self.chip.clock.now() < self._managed_until
        return register.put(self.words.get(register.offset, 0), "MB", int(is_busy))

    # Interrupts

    def _raise(self, flags):
        self.set("ETHERNET_DMA.DMACSR", self._dma("DMACSR") | flags | NORMAL)
        self._tell()

    def _clear(self, word):
        self.set("ETHERNET_DMA.DMACSR", self._dma("DMACSR") & ~word)
        self._tell()

    def _enable(self, word):
        self.set("ETHERNET_DMA.DMACIER", word)
        self._tell()

    def _tell(self):
        active = self._dma("DMACSR") & self._dma("DMACIER")
        is_high = bool(active & (TRANSMITTED | RECEIVED)) and bool(self._dma("DMACIER") & NORMAL)
        self.chip.exceptions.set_level(self._interrupt, is_high)

    # Rings (58.10)

    def _place_ring(self, name, word):
        self.set("ETHERNET_DMA." + name, word)
        if name == "DMACTX_DLAR":
            self._transmit_place = 0
        else:
            self._receive_place = 0

    def _descriptor(self, ring, place):
        address = self._dma(f"DMAC{ring}_DLAR") + DESCRIPTOR * place
        raw = self.chip.dma_read(address, DESCRIPTOR)
        return address, [int.from_bytes(raw[offset : offset + 4], "little") for offset in range(0, DESCRIPTOR, 4)]

    def _transmit(self, word):
        self.set("ETHERNET_DMA.DMACTX_DTPR", word)
        if not self._dma("DMACTX_CR", "ST"):
            return
        delay = 0
        while True:
            address, words = self._descriptor("TX", self._transmit_place)
            if not words[3] & OWN:
                break
            frame = self.chip.dma_read(words[0], words[2] & 0x3FFF)
            self._transmit_place = (self._transmit_place + 1) % (self._dma("DMACTX_RLR") + 1 & 0x3FF)
            delay += (max(60, len(frame)) + OVERHEAD) * NANOSECONDS_A_BYTE
            self.chip.dma_write(address + 12, (words[3] & ~OWN).to_bytes(4, "little"))
            self.chip.clock.after(delay, lambda frame=frame: self._transmitted(frame))

    def speed(self):
        """What the controller is set to (MACCR): Mbit/s, and whether in both directions at once."""
        return 100 if self.get("ETHERNET_MAC.MACCR", "FES") else 10, bool(self.get("ETHERNET_MAC.MACCR", "DM"))

    def _has_link(self):
        """Frames pass where controller and PHY go at the same speed."""
        return self.phy.has_link() and self.phy.speed() == self.speed()

    def _transmitted(self, frame):
        self._raise(TRANSMITTED)
        if self.network and self._has_link():
            self.network.hear(bytes(frame))

    def hear(self, frame):
        """A frame from the cable, without its checksum."""
        is_on = self._dma("DMACRX_CR", "SR") and self.get("ETHERNET_MAC.MACCR", "RE")
        if not is_on or not self._has_link() or not self._is_for_me(frame):
            return
        address, words = self._descriptor("RX", self._receive_place)
        if not words[3] & OWN:
            self.dropped += 1
            return
        frame = frame.ljust(60, b"\0") + bytes(4)
        self.chip.dma_write(words[0], frame)
        self.chip.dma_write(address + 12, (FIRST | LAST | len(frame)).to_bytes(4, "little"))
        self._receive_place = (self._receive_place + 1) % (self._dma("DMACRX_RLR") + 1 & 0x3FF)
        self.received += 1
        self._raise(RECEIVED)

    def _is_for_me(self, frame):
        low, high = self.get("ETHERNET_MAC.MACA0LR"), self.get("ETHERNET_MAC.MACA0HR")
        own = low.to_bytes(4, "little") + (high & 0xFFFF).to_bytes(2, "little")
        return frame[:6] == own or frame[0] & 1
