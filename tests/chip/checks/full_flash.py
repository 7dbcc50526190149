"""A page of settings that is full."""

from bench import LONGEST_START, check_sound, describe, emergencies, longest_gap, poses, start
from checks.can import ask
from checks.log_port import host_of, listen
from emulated_chip.can_bus import CanFrame
from emulated_chip.clock import MILLISECOND, SECOND
from emulated_chip.flash import ERASE
from stored_settings import ACCEPTS_SETTINGS, BIT_RATE_250, FIRST_PAGE, NODE_17, PAGE, fill, starts

# From the reset to the first pose on the bus. With one bank of flash the erasure of a page comes before it.
LONGEST = 1 * SECOND
LONGEST_ERASE = ERASE[3]
# The bit rate, object 4134h, and `save` to 1010h (CiA 301, 7.5.2.13), which the book says to wait 3 s for.
BIT_RATE = (0x2B, 0x34, 0x41, 0, 0xFA, 0, 0, 0)
SAVE = (0x23, 0x10, 0x10, 1, *b"save")
PATIENCE = 3 * SECOND
PAUSE, SETTINGS_LOST = 0xFF04, 0x6300


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
    assert ask(chip, *BIT_RATE)[0] == 0x60, "the setting is refused"
    assert ask(chip, *SAVE, patience=PATIENCE)[0] == 0x60, "to store it is refused"
    bench.note("stored_after_ms", round((chip.clock.now() - begin) / MILLISECOND, 1))
    # It is told when it is done (CiA 301, 7.5.2.13).
    assert chip.settings_flash.erases > erases, "nothing was erased"
    assert BIT_RATE_250 in bytes(chip.settings_flash.bytes), "it is confirmed before it is stored"
    chip.run_for(2 * SECOND)
    check_sound(chip)
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


def goes_on_while_it_stores(bench):
    """A page is erased for a setting that is stored: localiser, bus and network go on, where the program is in another bank."""
    chip = bench.chip()
    fill(chip.settings_flash, FIRST_PAGE, ACCEPTS_SETTINGS, room=2, with_pieces=True)
    start(chip)
    chip.run_for(3 * SECOND)
    log = listen(chip, host_of(chip))
    assert ask(chip, *BIT_RATE)[0] == 0x60, "the setting is refused"
    begin = chip.clock.now() + 1
    chip.can_bus.send(chip.listener, CanFrame(0x610, bytes(SAVE)))
    silent = {"the loop of the localiser": 0, "the network": 0}
    longest = dict(silent)
    while not chip.listener.of(0x590, begin) and chip.clock.now() < begin + PATIENCE:
        before = (chip.sleeps, len(log.received))
        chip.run_for(STEP)
        for name, has_run in zip(silent, (chip.sleeps > before[0], len(log.received) > before[1])):
            silent[name] = 0 if has_run else silent[name] + STEP
            longest[name] = max(longest[name], silent[name])
    check_sound(chip)
    assert chip.settings_flash.erases, "nothing was erased"
    bench.note("stored_after_ms", round((chip.clock.now() - begin) / MILLISECOND, 1))
    bench.note("longest_silence_ms", {name: time / MILLISECOND for name, time in longest.items()})
    late = {name: time / MILLISECOND for name, time in longest.items() if time > LONGEST_SILENCE}
    assert not late, f"silent for so many ms: {late}"


# A revolution of the laser comes every 125 ms.
STEP, LONGEST_SILENCE = 10 * MILLISECOND, 60 * MILLISECOND


def says_what_it_cannot_store(bench):
    """The flash refuses what is written: who has asked is told that, and so is the bus."""
    chip = bench.chip()
    fill(chip.settings_flash, FIRST_PAGE, ACCEPTS_SETTINGS, room=9, with_pieces=True)
    start(chip)
    chip.run_for(3 * SECOND)
    bank = chip.settings_bank()
    bank.store = lambda *_: bank.fail("WRPERR")
    begin = chip.clock.now()
    assert ask(chip, *BIT_RATE)[0] == 0x60, "the setting is refused"
    answer = ask(chip, *SAVE, patience=PATIENCE)
    # "Access failed due to an hardware error" (CiA 301, table 22).
    assert answer == bytes([0x80, 0x10, 0x10, 1, 0, 0, 0x06, 0x06]), f"the answer is {answer.hex()}"
    chip.run_for(100 * MILLISECOND)
    assert SETTINGS_LOST in emergencies(chip, begin), f"emergencies: {emergencies(chip, begin)}"
    check_sound(chip)


CHECKS = [
    goes_on_while_it_stores,
    says_what_it_cannot_store,
    reads_what_it_has_written,
    starts_within_a_second_when_full,
    says_before_it_stands_still,
]
goes_on_while_it_stores.chips = ["STM32H743ZI"]
