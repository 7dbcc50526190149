"""The watchdog: it bites when something stands still, whichever it is, and never else."""

from bench import check_sound, describe, emergencies, longest_gap, poses
from checks.retained import retained_text
from emulated_chip import watchdog
from emulated_chip.clock import MICROSECOND, MILLISECOND, SECOND
from injected_panic import MESSAGE, hang, panic

# The last meal may have been just before, and the next would have been a second later.
LONGEST_BITE = 12 * SECOND
QUIET = 60 * SECOND
BUS, NETWORK = "UART7", "UART8"


def stands_still_and_restarts(bench, stop, name):
    chip = bench.started()
    chip.run_for(100 * MILLISECOND)
    assert chip.peripherals["IWDG1"].started_at is not None, "the watchdog does not run"
    stop(chip)
    before = chip.clock.now()
    chip.run_for(LONGEST_BITE, stop=lambda: len(chip.resets) > 1)
    assert len(chip.resets) == 2 and chip.resets[1][1] == "watchdog", f"{name}: no bite: {describe(chip)}"
    bench.note(f"bites_after_s_{name}", round((chip.resets[1][0] - before) / SECOND, 2))
    chip.exceptions.blocked = set()
    chip.run_for(200 * MILLISECOND)
    assert 0x6100 in emergencies(chip, chip.resets[1][0]), f"{name}: the bus hears of nothing"


def block(*names):
    """Stops executors: their interrupts never come."""

    def stop(chip):
        chip.exceptions.blocked = {chip.description.interrupts[name] + 16 for name in names}

    return stop


def bites_when_the_bus_stands_still(bench):
    """The executor of the bus runs no more."""
    stands_still_and_restarts(bench, block(BUS), "bus")


def bites_when_the_network_stands_still(bench):
    """The executor of the network runs no more."""
    stands_still_and_restarts(bench, block(NETWORK), "network")


def bites_when_the_localiser_stands_still(bench):
    """The loop below all interrupts runs in a circle."""

    def stop(chip):
        chip.run_for(SECOND, stop=lambda: not chip.exceptions.active)
        hang(chip)

    stands_still_and_restarts(bench, stop, "localiser")


def tells_of_a_bite_behind_a_panic(bench):
    """The program has panicked, and nobody has asked for its text yet, when the watchdog bites: both are told."""
    chip = bench.started()
    chip.run_for(20 * MILLISECOND)
    panic(chip)
    chip.run_for(SECOND, stop=lambda: len(chip.resets) > 1)
    chip.run_for(200 * MILLISECOND)
    block(BUS)(chip)
    chip.run_for(LONGEST_BITE, stop=lambda: len(chip.resets) > 2)
    assert [cause for _, cause in chip.resets] == ["power", "software", "watchdog"], describe(chip)
    chip.exceptions.blocked = set()
    chip.run_for(200 * MILLISECOND)
    text = retained_text(chip)
    missing = [part.decode() for part in (b"the bus stood still", MESSAGE) if part not in text]
    assert not missing, f"nothing is told of {missing[0]}"


def bites_when_everything_stands_still(bench):
    """No interrupt comes, and the loop runs in a circle."""

    def stop(chip):
        chip.run_for(SECOND, stop=lambda: not chip.exceptions.active)
        block(*chip.description.interrupts)(chip)
        hang(chip)

    stands_still_and_restarts(bench, stop, "everything")


def runs_before_anything_else(bench):
    """The watchdog runs before the first wait for anything outside of the processor."""
    chip = bench.chip()
    chip.run_for(SECOND, stop=lambda: chip.peripherals["IWDG1"].started_at is not None)
    assert chip.peripherals["IWDG1"].started_at is not None, describe(chip)
    assert not chip.peripherals["RCC"].get("CR", "HSEON"), "the crystal is waited for without a watchdog"
    bench.note("runs_after_ms", chip.peripherals["IWDG1"].started_at / MILLISECOND)


def quiet(bench, hertz, duration):
    """No laser and no encoders for so long."""
    chip = bench.started(lsi=hertz)
    begin = chip.clock.now()
    chip.run_for(QUIET if bench.is_long else duration)
    check_sound(chip)
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    assert gap <= 20 * MILLISECOND, f"no pose for {gap / 1e6:.1f} ms"
    feeds = chip.peripherals["IWDG1"].feeds
    pauses = [later - earlier for earlier, later in zip(feeds, feeds[1:]) if earlier > begin]
    # The clock that the program reads has steps of a microsecond.
    assert min(pauses) >= SECOND - MICROSECOND, f"fed after {min(pauses) / 1e9:.3f} s"
    bench.note("longest_pause_s", round(max(pauses) / SECOND, 3))
    bench.note("shortest_period_s", round(chip.peripherals["IWDG1"].period() / SECOND, 3))


def stays_calm_without_a_laser(bench):
    """Nobody answers from the laser, whose session waits for longer and longer; the watchdog's oscillator is the fastest."""
    quiet(bench, watchdog.MOST, 48 * SECOND)


def stays_calm_on_a_slow_oscillator(bench):
    """The same with the slowest oscillator."""
    quiet(bench, watchdog.LEAST, 12 * SECOND)


CHECKS = [
    runs_before_anything_else,
    bites_when_the_bus_stands_still,
    bites_when_the_network_stands_still,
    bites_when_the_localiser_stands_still,
    bites_when_everything_stands_still,
    tells_of_a_bite_behind_a_panic,
    stays_calm_without_a_laser,
    stays_calm_on_a_slow_oscillator,
]
