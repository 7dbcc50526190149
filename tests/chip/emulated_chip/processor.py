"""The Cortex-M7: Unicorn for its instructions, and what stands around them."""

import ctypes
from pathlib import Path

from unicorn import UC_ARCH_ARM, UC_HOOK_BLOCK, UC_HOOK_INTR, UC_HOOK_MEM_INVALID, UC_MODE_THUMB, Uc, UcError
from unicorn import arm_const as arm
from unicorn import unicorn_const as const
from unicorn.unicorn_py3 import unicorn as binding

from .exclusives import Exclusives
from .finding import Finding

# Nothing is there: where Unicorn would stop by itself.
NOWHERE = 0xDEAD_0000
WFI = b"\x30\xbf"
NEVER = (1 << 64) - 1

INVALID_WRITES = (const.UC_MEM_WRITE_UNMAPPED, const.UC_MEM_WRITE_PROT)
INVALID_FETCHES = (const.UC_MEM_FETCH_UNMAPPED, const.UC_MEM_FETCH_PROT)


class Progress(ctypes.Structure):
    """`struct progress` of block_hook.c."""

    _fields_ = [
        ("halfwords", ctypes.c_uint64),
        ("limit", ctypes.c_uint64),
        ("block", ctypes.c_uint64),
        ("is_pending", ctypes.c_uint32),
        ("masks", ctypes.c_int32 * 3),
        ("stop", ctypes.c_void_p),
        ("read", ctypes.c_void_p),
    ]


class RegisterSet:
    """Registers that are read and written together; Unicorn's own way for it takes ten times as long."""

    def __init__(self, engine, registers):
        count = len(registers)
        self._handle = engine._uch
        self._count = count
        self._numbers = (ctypes.c_int * count)(*registers)
        self._values = (ctypes.c_uint64 * count)()
        first = ctypes.addressof(self._values)
        self._places = (ctypes.c_void_p * count)(*(first + 8 * number for number in range(count)))

    def read(self):
        binding.uclib.uc_reg_read_batch(self._handle, self._numbers, self._places, self._count)
        return list(self._values)

    def write(self, values):
        self._values[:] = values
        binding.uclib.uc_reg_write_batch(self._handle, self._numbers, self._places, self._count)


class Processor:
    """Runs code until something is due. `chip` decides about memory that is not plain and about exceptions."""

    def __init__(self, chip, hook_library: Path):
        self.chip = chip
        self.engine = Uc(UC_ARCH_ARM, UC_MODE_THUMB)
        self.engine.ctl_set_cpu_model(arm.UC_CPU_ARM_CORTEX_M7)
        self.progress = Progress(masks=(arm.UC_ARM_REG_PRIMASK, arm.UC_ARM_REG_FAULTMASK, arm.UC_ARM_REG_BASEPRI))
        self._hook = ctypes.CDLL(str(hook_library))
        self._count_blocks()
        self.engine.hook_add(UC_HOOK_INTR, self._on_interrupt)
        self.engine.hook_add(UC_HOOK_MEM_INVALID, self._on_invalid)
        self.exclusives = Exclusives(self.engine, lambda address: not chip.system.is_shared(address))
        self._interrupt = None
        self._invalid = None
        self._sets = {}

    def _count_blocks(self):
        library = binding.uclib
        self.progress.stop = ctypes.cast(library.uc_emu_stop, ctypes.c_void_p)
        self.progress.read = ctypes.cast(library.uc_reg_read, ctypes.c_void_p)
        handle = ctypes.c_size_t()
        status = library.uc_hook_add(
            self.engine._uch,
            ctypes.byref(handle),
            UC_HOOK_BLOCK,
            ctypes.cast(self._hook.count_block, ctypes.c_void_p),
            ctypes.cast(ctypes.byref(self.progress), ctypes.c_void_p),
            ctypes.c_uint64(1),
            ctypes.c_uint64(0),
        )
        if status != 0:
            raise UcError(status)

    def _on_interrupt(self, engine, number, _):
        self._interrupt = number
        engine.emu_stop()

    def _on_invalid(self, engine, access, address, size, value, _):
        self._invalid = (access, address, size, value)
        return False

    # Registers

    def _set_of(self, registers):
        found = self._sets.get(registers)
        if found is None:
            found = self._sets[registers] = RegisterSet(self.engine, registers)
        return found

    def get(self, register):
        return self._set_of((register,)).read()[0]

    def set(self, register, value):
        self._set_of((register,)).write([value & 0xFFFF_FFFF])

    def get_all(self, registers):
        return self._set_of(registers).read()

    def set_all(self, registers, values):
        self._set_of(registers).write(values)

    @property
    def pc(self):
        return self.get(arm.UC_ARM_REG_PC)

    @pc.setter
    def pc(self, value):
        self.set(arm.UC_ARM_REG_PC, value)

    def word(self, address):
        return int.from_bytes(self.engine.mem_read(address, 4), "little")

    def put_word(self, address, word):
        self.engine.mem_write(address, (word & 0xFFFF_FFFF).to_bytes(4, "little"))

    def stop_soon(self):
        """The block that runs is the last one before something is looked at."""
        self.progress.limit = self.progress.halfwords

    def forget_code(self):
        """Code was written."""
        self.engine.ctl_flush_tb()

    # Running

    def run(self, cycles):
        """Runs at most about so many halfwords. True if it sleeps."""
        self.progress.limit = min(self.progress.halfwords + cycles, NEVER)
        self._interrupt = self._invalid = self.exclusives.stopped = None
        start = self.pc
        try:
            self.engine.emu_start(start | 1, NOWHERE)
        except UcError as error:
            self._fail(error)
            return False
        if self.exclusives.stopped is not None:
            self.pc, address = self.exclusives.stopped
            self.chip.exceptions.bus_fault(address)
            return False
        if self._interrupt is not None:
            self._on_stop_by_interrupt(self._interrupt)
            return False
        here = self.pc
        return self._invalid is None and here >= 2 and bytes(self.engine.mem_read(here - 2, 2)) == WFI

    def step(self):
        """One instruction."""
        limit, self.progress.limit = self.progress.limit, NEVER
        here = self.pc
        # A block that was translated from here on would be run to its end.
        self.engine.ctl_remove_cache(here, here + 4)
        self.engine.emu_start(here | 1, NOWHERE, count=1)
        self.engine.ctl_remove_cache(here, here + 4)
        self.progress.limit = limit

    def _on_stop_by_interrupt(self, number):
        here = self.pc
        # A jump to such an address is a return wherever an exception is handled; Unicorn does not always know that one is.
        if here >= 0xFFFF_FF00 and self.chip.exceptions.active:
            self.chip.exceptions.leave(here)
            return
        if number == 7:
            self.chip.exceptions.on_breakpoint()
            return
        self.chip.end(Finding("exception", f"the processor reports exception {number}", pc=here))

    def _fail(self, error):
        here = self.pc
        if error.errno == const.UC_ERR_INSN_INVALID:
            self.chip.exceptions.undefined_instruction()
            return
        if self._invalid is None:
            if error.errno == const.UC_ERR_EXCEPTION and here >= 0xFFFF_FF00:
                self.chip.exceptions.leave(here)
                return
            self.chip.end(Finding("emulator", str(error), pc=here))
            return
        access, address, size, value = self._invalid
        if access in INVALID_FETCHES:
            self.chip.on_fetch_fault(address)
        else:
            self.chip.on_access_fault(address, size, access in INVALID_WRITES, value)
