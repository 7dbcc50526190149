"""From reset to the loop."""

from bench import describe
from emulated_chip.clock import MILLISECOND

# The whole start with an empty flash: memory at 64 MHz, oscillators, PHY.
LONGEST_START = 200 * MILLISECOND


def boots(bench):
    """The image comes to its loop, which sleeps, without a fault and without touching what has no clock."""
    chip = bench.chip()
    chip.run_for(LONGEST_START, stop=lambda: chip.sleeps > 0)
    assert chip.sleeps > 0 and not chip.findings and not chip.exceptions.taken, describe(chip)
    bench.note("start_ms", chip.clock.now() / MILLISECOND)


CHECKS = [boots]
