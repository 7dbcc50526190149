"""Parts that are dead from the start: the pose goes on, and the bus is told."""

from bench import check_sound, describe, emergencies, longest_gap, poses
from checks.retained import retained_text
from emulated_chip.clock import MICROSECOND, MILLISECOND, SECOND
from emulated_chip.phy import SPEEDS

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


def offers_the_speed_that_it_has(bench):
    """Whatever the other end of the cable offers: the PHY agrees on what the controller is set to, or on nothing."""
    for speeds in range(1 << len(SPEEDS)) if bench.is_long else (0b1111, 0b1110, 0b1000):
        chip = bench.chip()
        chip.phy.partner = sum(bit for number, (bit, _) in enumerate(SPEEDS) if speeds >> number & 1) | 1
        chip.run_for(2 * SECOND, stop=lambda: chip.sleeps > 0)
        check_sound(chip)
        agreed = chip.phy.speed()
        has_common = bool(chip.phy.partner & SPEEDS[0][0])
        assert agreed == (chip.peripherals["ETH"].speed() if has_common else None), f"{chip.phy.partner:#06x}: agreed on {agreed}"


def restarts_when_its_clock_stops(bench):
    """The debugger's clock stops while the chip runs: it starts again on its own oscillator, says why, and only listens."""
    chip = bench.started()
    chip.run_for(200 * MILLISECOND)
    stopped = chip.clock.now()
    chip.peripherals["RCC"].stop_crystal()
    chip.run_for(SECOND, stop=lambda: len(chip.resets) > 1)
    assert [cause for _, cause in chip.resets] == ["power", "software"], f"it goes on: {describe(chip)}"
    bench.note("restarts_after_us", (chip.resets[1][0] - stopped) / MICROSECOND)
    chip.exceptions.taken.clear()
    chip.run_for(2 * SECOND)
    check_sound(chip, resets=2)
    assert chip.peripherals["RCC"].processor_clock() == 480_000_000, "the clock is another one"
    assert chip.peripherals["FDCAN1"].get("CCCR", "MON") == 1, "the controller would acknowledge"
    # What was on the bus when the clock stopped is sent to its end.
    late = [time for time, _ in chip.listener.heard if time > stopped + MILLISECOND]
    assert not late, f"{len(late)} frames are sent with the wrong clock"
    assert b"clock" in retained_text(chip), "nothing is told of it"


# The only channel of the log, behind the identification and two counts (SEGGER RTT): its fields in words of four bytes, and the
# mode in which the program waits for room.
CHANNEL, SIZE, WRITTEN, READ, FLAGS, BLOCKING = 24, 2, 3, 4, 5, 2


def lives_without_its_probe(bench):
    """Who has read the log has gone, and left it full, and the program told to wait for room: nothing waits."""
    chip = bench.started()
    channel = chip.image.address("_SEGGER_RTT") + CHANNEL
    field = lambda number: chip.processor.word(channel + 4 * number)
    put = lambda number, word: chip.processor.put_word(channel + 4 * number, word)
    full = (field(READ) + field(SIZE) - 1) % field(SIZE)
    put(WRITTEN, full)
    put(FLAGS, BLOCKING)
    begin = chip.clock.now()
    chip.run_for(60 * SECOND if bench.is_long else 3 * SECOND)
    check_sound(chip)
    # What the stack has come to is logged once a second while it grows, the first time a second after the start.
    assert field(WRITTEN) != full, "nothing was logged"
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    assert gap <= 20 * MILLISECOND, f"no pose for {gap / 1e6:.1f} ms"


CHECKS = [
    lives_without_a_phy,
    lives_without_a_reference_clock,
    lives_without_a_cable,
    tells_of_option_bytes,
    only_listens_without_a_crystal,
    offers_the_speed_that_it_has,
    restarts_when_its_clock_stops,
    lives_without_its_probe,
]
