"""A gyro on the board's I2C."""

import struct

from bench import check_sound, longest_gap, poses, start
from checks.log_port import host_of, listen
from emulated_chip.bmi160 import Bmi160
from emulated_chip.clock import SECOND
from stored_settings import FIRST_PAGE, GYRO_ON_I2C, write

STEPS = 1000
# Fast mode (UM10204, table 10): no bit is shorter, ns.
SHORTEST_BIT = 2500
# The chip measures a hundred times a second, by its own clock and within a hundredth.
READINGS = range(98, 103)


def with_gyro(bench):
    """A chip whose settings have a gyro on I2C, which is there, a second and more after the start."""
    flash = bench.flash()
    write(flash, FIRST_PAGE, GYRO_ON_I2C)
    chip = bench.chip(settings=flash)
    gyro = Bmi160(chip.clock)
    # The third axis points up, as the settings have it at first.
    gyro.steps = (1, 2, STEPS)
    chip.peripherals["I2C1"].devices.append(gyro)
    start(chip)
    chip.run_for(3 * SECOND)
    return chip, gyro


def told(chip, gyro, log):
    """How often the log tells the gyro's rate in a second."""
    before = len(log.received)
    chip.run_for(SECOND)
    return bytes(log.received[before:]).count(struct.pack("<d", gyro.rate(STEPS)))


def has_poses(chip, begin):
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    assert gap <= 20_000_000, f"no pose for {gap / 1e6:.1f} ms"


def reads_its_gyro(bench):
    """Each reading comes to the log, with the rate that its registers have, in the smallest range that holds the settings' one."""
    chip, gyro = with_gyro(bench)
    bit_time = chip.peripherals["I2C1"].bit_time()
    bench.note("bit_ns", bit_time)
    assert bit_time >= SHORTEST_BIT, f"a bit takes {bit_time:.0f} ns"
    log = listen(chip, host_of(chip))
    begin = chip.clock.now()
    for _ in range(10 if bench.is_long else 3):
        count = told(chip, gyro, log)
        assert count in READINGS, f"{count} readings in a second"
    has_poses(chip, begin)
    check_sound(chip)


def lives_without_its_gyro(bench):
    """The gyro goes, or somebody holds the wires: poses go on, and the gyro is heard again when it is back."""
    chip, gyro = with_gyro(bench)
    log = listen(chip, host_of(chip))
    wires = chip.peripherals["I2C1"]

    def is_away(away):
        gyro.is_there = not away

    for disturb in (is_away, wires.hold):
        begin = chip.clock.now()
        disturb(True)
        told(chip, gyro, log)
        count = told(chip, gyro, log)
        assert count == 0, f"{count} readings of no gyro"
        disturb(False)
        chip.run_for(SECOND)
        count = told(chip, gyro, log)
        assert count in READINGS, f"{count} readings in a second, when it is back"
        has_poses(chip, begin)
    check_sound(chip)


CHECKS = [reads_its_gyro, lives_without_its_gyro]
