"""How many bytes a load or store moves (ARMv7-M ARM, A5 and A7)."""


def transfer_size(code):
    """Bytes of the access of an instruction of two halfwords, from its address upwards."""
    first, second = int.from_bytes(code[:2], "little"), int.from_bytes(code[2:4], "little")
    if first >> 12 == 0xC:
        return 4 * (first & 0xFF).bit_count()
    if first & 0xFE40 == 0xE800:
        return 4 * second.bit_count()
    if first & 0xFE40 == 0xE840:
        return 8
    if first & 0xFE00 == 0xEC00:
        is_multiple = first & 0x0120 != 0x0100
        return 4 * (second & 0xFF) if is_multiple else (8 if second & 0x0100 else 4)
    return 4
