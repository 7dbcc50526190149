"""A page of settings that is full."""

from bench import LONGEST_START, check_sound, describe
from emulated_chip.clock import MILLISECOND, SECOND
from emulated_chip.flash import Flash
from stored_settings import FIRST_PAGE, NODE_17, PAGE, fill, starts

# From the reset to the first pose on the bus.
LONGEST = 1 * SECOND


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
        flash = Flash(len(empty.settings_flash.bytes))
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
    late = {room: time for room, time in results.items() if time > LONGEST / MILLISECOND}
    assert not late, f"the first pose comes after {late} ms"


def reads_what_it_has_written(bench):
    """The page is full, so that the other one is written and this one erased; then settings are read again."""
    chip = bench.chip()
    number = fill(chip.settings_flash, FIRST_PAGE, NODE_17)
    chip.run_for(4 * SECOND)
    check_sound(chip)
    assert chip.settings_flash.erases, "nothing was erased"
    assert starts(number + 1) in bytes(chip.settings_flash.bytes), "the start is not counted"


CHECKS = [reads_what_it_has_written, starts_within_a_second_when_full]
