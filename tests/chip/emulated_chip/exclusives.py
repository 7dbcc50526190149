"""Exclusive accesses (LDREX, STREX and those of bytes and halfwords): what atomic operations are made of.

Those to memory that is not shareable are watched by the processor itself. Those to shareable memory it leaves to the bus (Cortex-M7
TRM, DDI0489, 5.6.2), and no slave of the chip's buses has a monitor for them: the answer is no success, which is a bus fault.
"""

from unicorn import UC_HOOK_CODE
from unicorn import arm_const as arm

REGISTERS = [arm.UC_ARM_REG_R0 + number for number in range(13)] + [arm.UC_ARM_REG_SP, arm.UC_ARM_REG_LR, arm.UC_ARM_REG_PC]


def offset_of(first, second):
    """By how much the address of an exclusive access is beside its base register; None if it is another instruction (ARMv7-M ARM,
    A7.7, encodings T1 of LDREX, LDREXB, LDREXH, STREX, STREXB and STREXH)."""
    kind = first & 0xFFF0
    if kind == 0xE850 and second & 0x0F00 == 0x0F00:
        return 4 * (second & 0xFF)
    if kind == 0xE840:
        return 4 * (second & 0xFF)
    if kind == 0xE8D0 and second & 0x0FFF in (0xF4F, 0xF5F):
        return 0
    if kind == 0xE8C0 and second & 0x0FF0 in (0xF40, 0xF50):
        return 0
    return None


class Exclusives:
    """Looks at each exclusive access of a program before it is made, and asks `may_access` for its address."""

    def __init__(self, engine, may_access):
        self._engine = engine
        self._may_access = may_access
        # Where the run was stopped before an access, and its address.
        self.stopped = None

    def watch(self, base, code):
        """Code from an address on. What only looks like such an instruction is never run as one."""
        for place in range(0, len(code) - 3, 2):
            first, second = (int.from_bytes(code[place + at : place + at + 2], "little") for at in (0, 2))
            offset = offset_of(first, second)
            if offset is not None:
                self._watch_one(base + place, REGISTERS[first & 15], offset)

    def _watch_one(self, place, register, offset):
        def before(engine, at, size, _):
            address = engine.reg_read(register) + offset & 0xFFFF_FFFF
            if not self._may_access(address):
                self.stopped = (at, address)
                engine.emu_stop()

        self._engine.hook_add(UC_HOOK_CODE, before, begin=place, end=place)
