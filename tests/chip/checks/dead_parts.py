"""Parts that are dead from the start: the pose goes on, and the bus is told."""

from bench import check_sound, describe, emergencies, longest_gap, poses
from emulated_chip.clock import MILLISECOND, SECOND

HARDWARE = 0x5000
TOLD_WITHIN = 200 * MILLISECOND


# Bits of the first detail byte.
ETHERNET, OPTION_BYTES = 0x01, 0x04


def lives_with(bench, change, parts):
    """Poses go on with what `change` does to the chip, and these parts are told; none if it is 0."""
    chip = bench.chip()
    change(chip)
    chip.run_for(2 * SECOND, stop=lambda: chip.sleeps > 0)
    assert chip.sleeps > 0, describe(chip)
    begin = chip.clock.now()
    bench.note("start_ms", begin / MILLISECOND)
    chip.run_for(60 * SECOND if bench.is_long else 5 * SECOND)
    check_sound(chip)
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    assert gap <= 20 * MILLISECOND, f"no pose for {gap / 1e6:.1f} ms"
    code = HARDWARE.to_bytes(2, "little")
    told = [(time, frame.data[3]) for time, frame in chip.listener.of(0x90) if frame.data[:2] == code]
    assert [found for _, found in told] == ([parts] if parts else []), f"emergencies: {emergencies(chip)}"
    assert all(time <= begin + TOLD_WITHIN for time, _ in told), told


def lives_without_a_phy(bench):
    """Nobody answers on the management bus of the Ethernet."""

    def change(chip):
        chip.phy.is_there = False

    lives_with(bench, change, ETHERNET)


def lives_without_a_reference_clock(bench):
    """The PHY answers, and gives no clock."""

    def change(chip):
        chip.phy.has_clock = False

    lives_with(bench, change, ETHERNET)


def lives_without_a_cable(bench):
    """Everything is sound but the cable: no trouble of the board."""

    def change(chip):
        chip.phy.has_cable = False

    lives_with(bench, change, 0)


def tells_of_option_bytes(bench):
    """The brown-out reset is off, as at the factory; or the banks of flash are exchanged, where there are two."""

    def without_brown_out(chip):
        chip.peripherals["FLASH"].put("OPTSR_CUR", "BOR_LEV", 0)

    lives_with(bench, without_brown_out, OPTION_BYTES)
    if bench.has_one_bank():
        return

    def exchanged(chip):
        chip.peripherals["FLASH"].put("OPTSR_CUR", "SWAP_BANK_OPT", 1)

    lives_with(bench, exchanged, OPTION_BYTES)


def only_listens_without_a_crystal(bench):
    """The chip's own oscillator is too far off for CAN at this bit timing: the controller runs, and disturbs nobody."""
    chip = bench.chip()
    chip.peripherals["RCC"].has_hse = False
    chip.run_for(2 * SECOND, stop=lambda: chip.sleeps > 0)
    assert chip.sleeps > 0, describe(chip)
    chip.run_for(60 * SECOND if bench.is_long else 5 * SECOND)
    check_sound(chip)
    assert chip.peripherals["RCC"].processor_clock() == 480_000_000, "the clock is another one"
    fdcan = chip.peripherals["FDCAN1"]
    assert fdcan.get("CCCR", "MON") == 1, "the controller would acknowledge"
    assert not chip.listener.heard, "the controller sends"


CHECKS = [
    lives_without_a_phy,
    lives_without_a_reference_clock,
    lives_without_a_cable,
    tells_of_option_bytes,
    only_listens_without_a_crystal,
]
