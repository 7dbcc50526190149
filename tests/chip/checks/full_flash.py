"""A page of settings that is full."""

from bench import LONGEST_START, check_sound, describe, emergencies, longest_gap, poses, start
from checks.can import ask
from emulated_chip.clock import MILLISECOND, SECOND
from emulated_chip.flash import ERASE
from stored_settings import ACCEPTS_SETTINGS, FIRST_PAGE, NODE_17, PAGE, fill, starts

# From the reset to the first pose on the bus. With one bank of flash the erasure of a page comes before it.
LONGEST = 1 * SECOND
LONGEST_ERASE = ERASE[3]
PAUSE = 0xFF04


def first_pose(chip):
    return next((time for time, frame in chip.listener.heard if frame.identifier == 0x191), None)


def starts_within_a_second_when_full(bench):
    """The page has no room for one more item: the start does not wait until the other one is made ready."""
    empty = bench.started()
    empty.run_for(50 * MILLISECOND)
    first = empty.settings_flash.bytes[FIRST_PAGE * PAGE :]
    assert bytes(first[32:96]) == starts(1), "the settings are written in another way than this check knows"
    results = {}
    for room in (0, 1) if not bench.is_long else (0, 1, 2, 3):
        flash = bench.flash()
        number = fill(flash, FIRST_PAGE, NODE_17, room)
        chip = bench.chip(settings=flash)
        chip.run_for(LONGEST_START, stop=lambda: first_pose(chip) is not None)
        assert first_pose(chip) is not None, f"no pose of node 17: {describe(chip)}"
        results[room] = round(first_pose(chip) / MILLISECOND, 1)
        bench.note(f"first_pose_ms_with_room_for_{room}", results[room])
        chip.run_for(4 * SECOND if room == 0 else SECOND)
        check_sound(chip)
        # The start was counted all the same, and the setting is still there.
        contents = bytes(flash.bytes[FIRST_PAGE * PAGE :])
        assert starts(number + 1) in contents, f"room for {room}: the start is not counted"
        assert NODE_17 in contents, f"room for {room}: a setting is lost"
    longest = LONGEST + LONGEST_ERASE if bench.has_one_bank() else LONGEST
    late = {room: time for room, time in results.items() if time > longest / MILLISECOND}
    assert not late, f"the first pose comes after {late} ms"


def reads_what_it_has_written(bench):
    """The page is full, so that the other one is written and this one erased; then settings are read again."""
    chip = bench.chip()
    number = fill(chip.settings_flash, FIRST_PAGE, NODE_17)
    chip.run_for(4 * SECOND)
    check_sound(chip)
    assert chip.settings_flash.erases, "nothing was erased"
    assert starts(number + 1) in bytes(chip.settings_flash.bytes), "the start is not counted"


def says_before_it_stands_still(bench):
    """A master of the bus stores a setting while the page is full. With two banks of flash the poses go on; with one the
    processor stands still for as long as a page takes to erase, and says so before."""
    chip = bench.chip()
    fill(chip.settings_flash, FIRST_PAGE, ACCEPTS_SETTINGS, room=2, with_pieces=True)
    start(chip)
    chip.run_for(3 * SECOND)
    erases = chip.settings_flash.erases
    begin = chip.clock.now()
    # The bit rate, object 4134h, and `save` to 1010h (CiA 301, 7.5.2.13).
    assert ask(chip, 0x2B, 0x34, 0x41, 0, 0xFA, 0, 0, 0)[0] == 0x60, "the setting is refused"
    assert ask(chip, 0x23, 0x10, 0x10, 1, *b"save")[0] == 0x60, "to store it is refused"
    chip.run_for(4 * SECOND)
    check_sound(chip)
    assert chip.settings_flash.erases > erases, "nothing was erased"
    gap = longest_gap(poses(chip, begin), begin, chip.clock.now())
    bench.note("longest_gap_ms", round(gap / MILLISECOND, 1))
    told = [time for time, frame in chip.listener.of(0x90, begin) if frame.data[:2] == PAUSE.to_bytes(2, "little")]
    if not bench.has_one_bank():
        assert gap <= 20 * MILLISECOND and not told, f"no pose for {gap / 1e6:.1f} ms"
        return
    assert gap <= LONGEST_ERASE + 50 * MILLISECOND, f"no pose for {gap / 1e6:.1f} ms"
    times = [begin, *poses(chip, begin), chip.clock.now()]
    silent_from = next(earlier for earlier, later in zip(times, times[1:]) if later - earlier == gap)
    assert len(told) == 1 and told[0] <= silent_from + 10 * MILLISECOND, f"emergencies: {emergencies(chip, begin)}"
    bench.note("told_before_ms", round((silent_from - told[0]) / MILLISECOND, 1))


CHECKS = [reads_what_it_has_written, starts_within_a_second_when_full, says_before_it_stands_still]
