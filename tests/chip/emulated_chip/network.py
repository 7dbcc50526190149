"""A host at the other end of the cable: ARP, and TCP over IPv4 without options (RFC 826, 791, 9293), in virtual time."""

import struct

from .clock import MICROSECOND, MILLISECOND

ARP, IPV4, TCP = 0x0806, 0x0800, 6
FIN, SYN, RST, PSH, ACK = 1, 2, 4, 8, 16
# Frames to the chip follow each other no faster: what its rings hold and what it takes in a millisecond is not exceeded.
PACE = 250 * MICROSECOND
SEGMENT = 1460
WINDOW = 65535
# What was not acknowledged for so long is sent again.
PATIENCE = 200 * MILLISECOND


def checksum(data):
    """RFC 1071."""
    total = sum(struct.unpack(f"!{len(data) // 2}H", data[: len(data) & ~1])) + (data[-1] << 8 if len(data) & 1 else 0)
    while total >> 16:
        total = (total & 0xFFFF) + (total >> 16)
    return ~total & 0xFFFF


class Connection:
    """A connection as this end of it sees it: what came is in `received`."""

    def __init__(self, host, port, peer_port):
        self.host = host
        self.port = port
        self.peer_port = peer_port
        self.is_open = False
        self.is_over = False
        self.received = bytearray()
        self._waiting = bytearray()
        self._acknowledged = self._next = 1000
        self._expected = 0
        self._window = 0
        self._alarm = None

    def connect(self):
        self._send(SYN)
        self._next = self._acknowledged + 1
        self._wait()

    def send(self, data):
        self._waiting += data
        self._push()

    def _in_flight(self):
        return self._next - self._acknowledged

    def _push(self):
        if not self.is_open:
            return
        while self._in_flight() < min(len(self._waiting), self._window):
            first = self._in_flight()
            piece = bytes(self._waiting[first : min(first + SEGMENT, self._window)])
            self._send(ACK | PSH, piece)
            self._next += len(piece)
        if self._in_flight() and self._alarm is None:
            self._wait()

    def _wait(self):
        self._alarm = self.host.chip.clock.after(PATIENCE, self._repeat)

    def _repeat(self):
        self._alarm = None
        if self.is_over:
            return
        if not self.is_open:
            self._next = self._acknowledged
            self.connect()
        elif self._in_flight():
            self._next = self._acknowledged
            self._push()

    def _send(self, flags, data=b""):
        self.host.send_segment(self, self._next, self._expected, flags, data)

    def hear(self, sequence, acknowledged, flags, window, data):
        if flags & RST:
            self.is_over = True
            return
        self._window = window
        if flags & SYN:
            self._expected = sequence + 1
            if flags & ACK:
                self._acknowledged = self._next = acknowledged
                self._send(ACK)
            else:
                self._send(SYN | ACK)
                self._acknowledged += 1
                self._next = self._acknowledged
            self.is_open = True
        elif flags & ACK:
            taken = acknowledged - self._acknowledged & 0xFFFF_FFFF
            if 0 < taken <= len(self._waiting):
                del self._waiting[:taken]
                self._acknowledged += taken
                self._next = max(self._next, self._acknowledged)
                if self._alarm:
                    self._alarm.cancel()
                    self._alarm = None
        if data and sequence == self._expected & 0xFFFF_FFFF:
            self.received += data
            self._expected += len(data)
        if data:
            self._send(ACK)
        if flags & FIN and sequence + len(data) & 0xFFFF_FFFF == self._expected & 0xFFFF_FFFF:
            self._expected += 1
            self.is_over = True
            self._send(ACK | FIN)
        self._push()


class Host:
    """Listens at ports, and connects to those of the chip, which has the address `peer`."""

    def __init__(self, chip, address, peer):
        self.chip = chip
        self.address = bytes(address)
        self.peer = bytes(peer)
        self.listens_at = set()
        self.connections = {}
        self._hardware = bytes([2, 0, 0, 0, 0, 2])
        self._peer_hardware = None
        self._free_at = 0
        self._port = 50_000
        chip.peripherals["ETH"].network = self

    def connect(self, port):
        """A connection to a port of the chip; None while nobody knows its hardware address, for which this asks."""
        if self._peer_hardware is None:
            self._put(b"\xff" * 6, ARP, self._arp(1, bytes(6), self.peer))
            return None
        self._port += 1
        connection = Connection(self, self._port, port)
        self.connections[self._port, port] = connection
        connection.connect()
        return connection

    def hear(self, frame):
        kind = int.from_bytes(frame[12:14], "big")
        if kind == ARP and frame[38:42] == self.address:
            self._peer_hardware = frame[22:28]
            if frame[20:22] == b"\0\1":
                self._put(frame[22:28], ARP, self._arp(2, frame[22:28], frame[28:32]))
        elif kind == IPV4 and frame[23] == TCP and frame[30:34] == self.address:
            packet = frame[14 : 14 + int.from_bytes(frame[16:18], "big")]
            self._hear_segment(packet[4 * (packet[0] & 15) :])

    def _hear_segment(self, segment):
        peer_port, port, sequence, acknowledged, offset, flags, window = struct.unpack("!HHIIBBH", segment[:16])
        connection = self.connections.get((port, peer_port))
        if flags & SYN and not flags & ACK and port in self.listens_at:
            connection = self.connections[port, peer_port] = Connection(self, port, peer_port)
        if connection:
            connection.hear(sequence, acknowledged, flags, window, segment[4 * (offset >> 4) :])

    def send_segment(self, connection, sequence, acknowledged, flags, data):
        ports = (connection.port, connection.peer_port)
        numbers = (sequence & 0xFFFF_FFFF, acknowledged & 0xFFFF_FFFF)
        head = lambda total: struct.pack("!HHIIBBHHH", *ports, *numbers, 5 << 4, flags, WINDOW, total, 0)
        pseudo = self.address + self.peer + struct.pack("!HH", TCP, 20 + len(data))
        segment = head(checksum(pseudo + head(0) + data)) + data
        ip = lambda total: struct.pack("!HHHHBBH", 0x4500, 20 + len(segment), 0, 0x4000, 64, TCP, total) + self.address + self.peer
        self._put(self._peer_hardware, IPV4, ip(checksum(ip(0))) + segment)

    def _arp(self, operation, hardware, address):
        return struct.pack("!HHBBH", 1, IPV4, 6, 4, operation) + self._hardware + self.address + hardware + address

    def _put(self, to, kind, payload):
        """Sends a frame when those before it have gone."""
        frame = to + self._hardware + kind.to_bytes(2, "big") + payload
        self._free_at = max(self._free_at + PACE, self.chip.clock.now() + PACE)
        self.chip.clock.at(self._free_at, lambda: self.chip.peripherals["ETH"].hear(frame))
