"""A panic from outside: the processor is put into the function that every index out of bounds ends in."""

from unicorn import arm_const as arm

TEXT = b"injected.rs"
# WFI, and a jump to it.
WAIT, BACK = b"\x30\xbf", b"\xfd\xe7"
# PUSH of nine registers.
PUSH = b"\xff\xb5"
# LDREX r0, [r1]; STREX r2, r0, [r1]; a jump to itself.
EXCLUSIVES = b"\x51\xe8\x00\x0f\x41\xe8\x00\x02\xfe\xe7"
MESSAGE = b"index out of bounds: the len is 3 but the index is 7"


def panic(chip):
    """What runs now panics, at line 42 of injected.rs."""
    ram = chip.rams["AXISRAM"]
    place = ram.base + ram.size - 64
    location = place + 32
    ram.put(place, TEXT + b"\0")
    words = [place, len(TEXT), 42, 7]
    ram.put(location, b"".join(word.to_bytes(4, "little") for word in words))
    processor = chip.processor
    processor.set(arm.UC_ARM_REG_R0, 7)
    processor.set(arm.UC_ARM_REG_R1, 3)
    processor.set(arm.UC_ARM_REG_R2, location)
    processor.pc = chip.image.find("panic_bounds_check")


def fault(chip):
    """What runs now meets an instruction that there is not."""
    ram = chip.rams["AXISRAM"]
    place = ram.base + ram.size - 16
    ram.put(place, b"\x00\xde" * 4)
    chip.processor.set(arm.UC_ARM_REG_LR, 0x0801_2345)
    chip.processor.pc = place
    return place


def overflow(chip):
    """What runs now uses more and more of the stack."""
    ram = chip.rams["AXISRAM"]
    place = ram.base + ram.size - 32
    ram.put(place, PUSH + BACK)
    chip.processor.set(arm.UC_ARM_REG_PRIMASK, 1)
    chip.processor.pc = place


def hang(chip):
    """What runs now does nothing more, for ever: it sleeps and goes to sleep again."""
    ram = chip.rams["AXISRAM"]
    place = ram.base + ram.size - 32
    ram.put(place, WAIT + BACK)
    # Whatever it was about: interrupts come.
    chip.processor.set(arm.UC_ARM_REG_PRIMASK, 0)
    chip.processor.pc = place


def add_atomically(chip, address):
    """What runs now loads and stores a word exclusively."""
    ram = chip.rams["AXISRAM"]
    place = ram.base + ram.size - 32
    ram.put(place, EXCLUSIVES)
    chip.processor.exclusives.watch(place, EXCLUSIVES)
    chip.processor.set(arm.UC_ARM_REG_R1, address)
    chip.processor.set(arm.UC_ARM_REG_R2, 7)
    chip.processor.pc = place
