"""Settings in flash as `sequential-storage` writes them, for pages that would take thousands of starts to fill."""

WORD = 32
PAGE = 128 * 1024
STARTS_KEY = 2
# The first of the two pages, in its bank.
FIRST_PAGE = 6
# The first of the two pages of the map of contours.
FIRST_CONTOUR_PAGE = 4


def crc16(data):
    """CRC-16F/4.2, reflected, as the headers of items have it; never all ones."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x1A2E if crc & 1 else crc >> 1
    crc ^= 0xFFFF
    return 0xFFFE if crc == 0xFFFF else crc


def crc32(data):
    """CRC-32C from another initial value; never zero, and its first byte is neither all zeros nor all ones."""
    crc = 0xEEEE_EEEE
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0x82F6_3B78 if crc & 1 else crc >> 1
    crc ^= 0xFFFF_FFFF
    if crc == 0:
        return 1
    return crc ^ 1 if crc & 0xFF in (0, 0xFF) else crc


def item(key, value):
    """Words of an item: its header, filled with ones, and its data, filled with zeros."""
    data = key.to_bytes(2, "little") + value
    length = len(data).to_bytes(2, "little")
    header = crc32(data).to_bytes(4, "little") + length + crc16(length).to_bytes(2, "little")
    return header.ljust(WORD, b"\xff") + data.ljust(-(-len(data) // WORD) * WORD, b"\0")


def starts(number):
    """The item that counts starts."""
    return item(STARTS_KEY, number.to_bytes(4, "little"))


# Leaf 300 is the controller's node: a whole number (variant 1 of the leaf's value) as `postcard` writes it.
NODE_17 = item(300, bytes([1, 17]))

# Leaf 312 lets masters of the bus change settings: a switch (variant 2 of the value).
ACCEPTS_SETTINGS = item(312, bytes([2, 1]))

# Leaf 330 says that there is a gyro, and leaf 338 where it is: at 68h on the board's I2C.
GYRO_ON_I2C = item(330, bytes([2, 1])) + item(338, bytes([1, 1]))

# Leaf 308 is the bit rate of the bus in kbit/s, in the seven bits a byte of `postcard`.
BIT_RATE_250 = item(308, bytes([1, 0x80 | 250 & 0x7F, 250 >> 7]))


def write(flash, page, items):
    """A page that holds these items and has room for more."""
    contents = b"\0" * WORD + items
    flash.bytes[page * PAGE : page * PAGE + len(contents)] = contents


# A piece of a map that no index names: it takes much room, and few items to look through.
PIECE = item(2000, b"\1" * 1200)


def fill(flash, page, first_items=b"", room=0, with_pieces=False):
    """Fills a page with counts of starts behind other items, but for so many items at its end. Most of it may be pieces of a map
    instead. Returns the last count."""
    contents = bytearray(b"\0" * WORD + first_items)
    number = 0
    while with_pieces and len(contents) + 2 * len(PIECE) <= PAGE:
        contents += PIECE
    while len(contents) + 2 * WORD * (room + 1) <= PAGE - WORD:
        number += 1
        contents += starts(number)
    first = page * PAGE
    flash.bytes[first : first + len(contents)] = contents
    return number
