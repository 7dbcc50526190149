"""Exceptions: which one is taken when, what is kept on the stack (ARMv7-M Architecture Reference Manual, B1.5)."""

from unicorn import arm_const as arm

NON_MASKABLE = 2
HARD_FAULT, MEMORY_FAULT, BUS_FAULT, USAGE_FAULT = 3, 4, 5, 6
SVCALL, PENDSV, SYSTICK = 11, 14, 15
FIRST_INTERRUPT = 16
ENABLE_BITS = {MEMORY_FAULT: 1 << 16, BUS_FAULT: 1 << 17, USAGE_FAULT: 1 << 18}

# Bits of CFSR (B3.2.15).
DATA_VIOLATION, MEMORY_ADDRESS_VALID = 1 << 1, 1 << 7
MEMORY_STACKING_ERROR = 1 << 4
PRECISE_ERROR, STACKING_ERROR, BUS_ADDRESS_VALID = 1 << 9, 1 << 12, 1 << 15
UNDEFINED_INSTRUCTION = 1 << 16
FORCED = 1 << 30

FRAME = (
    arm.UC_ARM_REG_R0,
    arm.UC_ARM_REG_R1,
    arm.UC_ARM_REG_R2,
    arm.UC_ARM_REG_R3,
    arm.UC_ARM_REG_R12,
    arm.UC_ARM_REG_LR,
)
STATE = (arm.UC_ARM_REG_SP, arm.UC_ARM_REG_XPSR, arm.UC_ARM_REG_CONTROL)
FLOATS = (*(arm.UC_ARM_REG_S0 + number for number in range(16)), arm.UC_ARM_REG_FPSCR)
MASKS = (arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_FAULTMASK, arm.UC_ARM_REG_BASEPRI)
FPCA = 1 << 2
PADDED = 1 << 9
THUMB = 1 << 24
LOWEST = 256


class Exceptions:
    def __init__(self, chip):
        self.chip = chip
        self.active = []
        self.taken = []
        self.pending = set()
        self.levels = set()
        # Interrupts that never come, for tests in which somebody stands still.
        self.blocked = set()

    def reset(self):
        self.active = []
        self.pending = set()
        self.levels = set()
        self.chip.processor.progress.is_pending = 0

    # Interrupts as their peripherals see them

    def set_level(self, number, is_high):
        """The line of an interrupt, which asks until its peripheral is content."""
        number += FIRST_INTERRUPT
        if is_high:
            if number not in self.levels:
                self.levels.add(number)
                if number not in self.active:
                    self.pend(number)
        else:
            self.levels.discard(number)

    def pend(self, number):
        self.pending.add(number)
        self._tell()

    def unpend(self, number):
        if number not in self.levels:
            self.pending.discard(number)
        self._tell()

    def _tell(self):
        """Something may have to be taken: the processor looks at PRIMASK after each block."""
        processor = self.chip.processor
        is_due = self._candidate() is not None
        processor.progress.is_pending = int(is_due)

    # Priorities

    def priority(self, number):
        if number == HARD_FAULT:
            return -1
        if number in (1, 2):
            return number - 4
        return self.chip.system.priority(number)

    def current_priority(self):
        return min((self.priority(number) for number in self.active), default=LOWEST)

    def _is_enabled(self, number):
        return number < FIRST_INTERRUPT or self.chip.system.is_enabled(number - FIRST_INTERRUPT)

    def _candidate(self):
        """What would be taken if nothing were masked."""
        ready = [number for number in self.pending - self.blocked if self._is_enabled(number)]
        best = min(ready, key=lambda number: (self.priority(number), number), default=None)
        if best is None or self.priority(best) >= self.current_priority():
            return None
        return best

    def has_wakeup(self):
        """Whether something ends a sleep: PRIMASK does not matter to it (B1.5.18)."""
        return self._candidate() is not None

    def take(self):
        """Takes what is due and not masked."""
        processor = self.chip.processor
        best = self._candidate()
        processor.progress.is_pending = int(best is not None)
        if best is None:
            return
        primask, faultmask, base = processor.get_all(MASKS)
        is_masked = primask & 1 or faultmask & 1 or base and self.priority(best) >= base
        if is_masked and best != NON_MASKABLE:
            return
        self.pending.discard(best)
        self._enter(best, processor.pc)

    # Entry and return

    def _enter(self, number, return_address):
        processor, system = self.chip.processor, self.chip.system
        *words, stack, status, control = processor.get_all(FRAME + STATE)
        has_floats = bool(control & FPCA)
        pad = stack & 4
        words = list(words) + [return_address, status & ~PADDED | (PADDED if pad else 0) | THUMB]
        if has_floats:
            words += list(processor.get_all(FLOATS)) + [0]
        stack = (stack - pad - 4 * len(words)) & 0xFFFF_FFFF
        if self.chip.is_stack(stack, 4 * len(words)):
            data = b"".join((word & 0xFFFF_FFFF).to_bytes(4, "little") for word in words)
            processor.engine.mem_write(stack, data)
        else:
            # The frame is lost, and the fault of stacking it is taken instead, without another one (B1.5.11).
            cause = MEMORY_STACKING_ERROR if system.forbids(stack, True) else STACKING_ERROR
            system.note_fault(cause, FORCED)
            number = HARD_FAULT
        link = 0xFFFF_FFF1 if self.active else 0xFFFF_FFF9
        processor.set_all(STATE, [stack, THUMB | number, control & ~FPCA])
        processor.set(arm.UC_ARM_REG_LR, link & ~0x10 if has_floats else link)
        self.active.append(number)
        if number < FIRST_INTERRUPT:
            self.taken.append((self.chip.clock.now(), number, return_address))
        processor.pc = processor.word(system.vector_table() + 4 * number) & ~1
        processor.progress.is_pending = int(self._candidate() is not None)

    def leave(self, link):
        """Returns from the exception that runs (B1.5.8)."""
        processor = self.chip.processor
        number = self.active.pop()
        stack = processor.get(arm.UC_ARM_REG_SP)
        has_floats = not link & 0x10
        count = 26 if has_floats else 8
        data = bytes(processor.engine.mem_read(stack, 4 * count))
        words = [int.from_bytes(data[place : place + 4], "little") for place in range(0, len(data), 4)]
        status = words[7]
        stack += 4 * count + (4 if status & PADDED else 0)
        # Returning lifts FAULTMASK, unless from a non-maskable interrupt.
        processor.set(arm.UC_ARM_REG_FAULTMASK, 0)
        control = processor.get(arm.UC_ARM_REG_CONTROL) & ~FPCA
        if has_floats:
            processor.set_all(FLOATS, words[8:25])
            control |= FPCA
        processor.set_all(STATE, [stack, status & ~PADDED, control])
        processor.set_all(FRAME, words[:6])
        processor.pc = words[6] & ~1
        if number in self.levels:
            self.pend(number)

    # Faults

    def undefined_instruction(self):
        self.fault(USAGE_FAULT, UNDEFINED_INSTRUCTION)

    def bus_fault(self, address):
        """A load or store was answered with an error."""
        self.fault(BUS_FAULT, PRECISE_ERROR | BUS_ADDRESS_VALID, address)

    def memory_fault(self, address):
        """A load or store was refused by the memory protection unit."""
        self.fault(MEMORY_FAULT, DATA_VIOLATION | MEMORY_ADDRESS_VALID, address)

    def ignores_bus_faults(self):
        """Whether data bus faults are ignored (B3.2.8, BFHFNMIGN): in handlers of priority -1 and -2, with FAULTMASK too."""
        masked = self.chip.processor.get(arm.UC_ARM_REG_FAULTMASK) & 1 or self.current_priority() < 0
        return bool(masked and self.chip.system.ignores_bus_faults())

    def fault(self, number, cause, address=None):
        processor, system = self.chip.processor, self.chip.system
        masked = processor.get(arm.UC_ARM_REG_PRIMASK) & 1 or processor.get(arm.UC_ARM_REG_FAULTMASK) & 1
        can_take = (
            system.is_fault_enabled(ENABLE_BITS[number])
            and not masked
            and self.priority(number) < self.current_priority()
        )
        system.note_fault(cause, 0 if can_take else FORCED, address, number)
        if can_take:
            self._enter(number, processor.pc)
        elif self.current_priority() < 0 or processor.get(arm.UC_ARM_REG_FAULTMASK) & 1:
            self.chip.lock_up(f"a fault in a fault handler at {processor.pc:#010x} in {self.chip.symbol(processor.pc)}")
        else:
            self._enter(HARD_FAULT, processor.pc)

    def on_breakpoint(self):
        """Without a debugger a breakpoint is a fault (C1.6.3)."""
        self.fault(USAGE_FAULT, 0)
