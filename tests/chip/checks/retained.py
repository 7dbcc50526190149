"""What the chip tells after a restart of why it restarted."""

from bench import describe, emergencies
from emulated_chip.clock import MILLISECOND, SECOND
from injected_panic import MESSAGE, fault, overflow, panic

INTERNAL_SOFTWARE = 0x6100


def restarted_after(bench, cause):
    """A chip in its loop after a restart that `cause` has brought."""
    chip = bench.started()
    chip.run_for(20 * MILLISECOND)
    chip.track_written_lines()
    before = chip.clock.now()
    cause(chip)
    chip.run_for(SECOND, stop=lambda: len(chip.resets) > 1)
    assert len(chip.resets) == 2 and not chip.findings, f"there was no restart: {describe(chip)}"
    bench.note("restart", chip.resets[-1][1])
    chip.run_for(100 * MILLISECOND)
    chip.before = before
    return chip


def retained_text(chip):
    """Everything that RAM which outlives a reset holds."""
    return b"".join(bytes(ram.memory) for ram in chip.rams.values())


def a_panic_is_told(bench):
    """A panic's text outlives the reset, although the reset throws dirty lines of the cache away."""
    chip = restarted_after(bench, panic)
    assert INTERNAL_SOFTWARE in emergencies(chip, chip.before), f"the bus hears of nothing: {describe(chip)}"
    assert MESSAGE in retained_text(chip), "the text is lost"


def a_fault_is_told(bench):
    """A fault restarts the chip at once, and cause, place and caller are kept."""
    place = []
    chip = restarted_after(bench, lambda chip: place.append(fault(chip)))
    assert INTERNAL_SOFTWARE in emergencies(chip, chip.before), f"the bus hears of nothing: {describe(chip)}"
    text = retained_text(chip)
    # CFSR: an undefined instruction (ARMv7-M ARM, B3.2.15).
    wanted = [b"CFSR 0x00010000", b"PC 0x%08x" % place[0], b"LR 0x08012345"]
    missing = [part.decode() for part in wanted if part not in text]
    assert not missing, f"nothing is told of {', '.join(missing)}"


def a_stack_that_is_full_is_told(bench):
    """The stack comes to its end: nothing else is overwritten, and it is told."""
    chip = restarted_after(bench, overflow)
    assert INTERNAL_SOFTWARE in emergencies(chip, chip.before), f"the bus hears of nothing: {describe(chip)}"
    # CFSR: access refused, at an address that is known, and the frame could not be kept (ARMv7-M ARM, B3.2.15).
    text = retained_text(chip)
    told = [part for part in text.split(b"fault: ") if part.startswith(b"CFSR")]
    assert told and told[0].startswith(b"CFSR 0x00000092"), f"told is {told[:1]}"


CHECKS = [a_panic_is_told, a_fault_is_told, a_stack_that_is_full_is_told]
