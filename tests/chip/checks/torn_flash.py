"""Power that goes while the flash is written: the chip starts again, and has lost nothing that was there before."""

from bench import LONGEST_START, check_sound, describe, start
from emulated_chip.clock import MILLISECOND, SECOND
from emulated_chip.flash import PowerCut
from stored_settings import FIRST_PAGE, NODE_17, fill, starts, write

# Starts in which power goes at each of the words that a start programs.
WORDS = 6


def node_of(chip):
    """The node that the chip takes part as, by its heartbeat; a setting that is not the default one tells that it is kept."""
    chip.run_for(200 * MILLISECOND)
    found = {frame.identifier - 0x700 for _, frame in chip.listener.heard if frame.identifier >= 0x700}
    assert len(found) == 1, f"nodes {found}: {describe(chip)}"
    return found.pop()


def survives_torn_words(bench):
    """Power goes at each flash word that a start programs, at several starts in a row; the chip starts each time."""
    flash = bench.flash()
    write(flash, FIRST_PAGE, NODE_17)
    torn = 0
    for number in range(1, WORDS + 1 if not bench.is_long else 40):
        for at in (1, 2, 3):
            chip = bench.chip(settings=flash)
            chip.cut = PowerCut(at)
            chip.run_for(9 * SECOND, stop=lambda: chip.sleeps > 40)
            flash = chip.settings_flash
            torn += not chip.has_power
            assert not chip.has_power or chip.sleeps > 0, f"start {number}, word {at}: {describe(chip)}"
            assert not chip.findings and not chip.exceptions.taken, f"start {number}, word {at}: {describe(chip)}"
    assert torn > 0, "no word was torn"
    bench.note("torn_words", torn)
    chip = bench.chip(settings=flash)
    start(chip)
    assert node_of(chip) == 17, "a setting is lost"
    check_sound(chip)


def survives_a_cut_while_a_page_is_moved(bench):
    """Power goes while the items of a page that is full are moved to the other one, and while the old one is erased."""
    cuts = [("program", 2), ("erase", 1)]
    if bench.is_long:
        cuts = [("program", at) for at in range(1, 12)] + [("erase", 1)]
    for kind, at in cuts:
        flash = bench.flash()
        number = fill(flash, FIRST_PAGE, NODE_17)
        chip = bench.chip(settings=flash)
        chip.cut = PowerCut(at, kind)
        chip.run_for(4 * SECOND)
        if kind == "program" and chip.has_power:
            break
        assert not chip.has_power and not chip.findings, f"{kind} {at}: no cut: {describe(chip)}"
        again = bench.chip(settings=flash)
        start(again)
        assert node_of(again) == 17, f"{kind} {at}: a setting is lost"
        # A count that never comes again (the nonces of the service port stand on it). It comes behind the start, when the pages are ready.
        begin, counted = again.clock.now(), number
        while counted == number and again.clock.now() < begin + LONGEST_START:
            again.run_for(SECOND // 2)
            counted = max(count for count in range(number + 4) if starts(count) in bytes(flash.bytes))
        bench.note(f"{kind}_{at}_counted_s", round((again.clock.now() - begin) / SECOND, 1))
        check_sound(again)
        assert counted > number, f"{kind} {at}: the last count is {counted}, and {number} was before"


def survives_an_erase_cut_short(bench):
    """Both pages hold words with double errors throughout, as an erase that was cut short leaves them."""
    for pages in ((6,), (7,), (6, 7)) if bench.is_long else ((7,),):
        chip = bench.started()
        chip.run_for(50 * MILLISECOND)
        flash = chip.settings_flash.copy()
        for page in pages:
            first = page * 128 * 1024
            for word in range(first, first + 128 * 1024, 32):
                flash.bad.add(word)
                flash.bytes[word : word + 32] = bytes([word >> 5 & 0xFF, word >> 13 & 0xFF] * 16)
        again = bench.chip(settings=flash)
        start(again)
        check_sound(again)
        again.run_for(100 * MILLISECOND)
        check_sound(again)
        bad = [word for word in flash.bad if word >= 6 * 128 * 1024]
        assert not bad, f"pages {pages}: {len(bad)} words are still bad"


def writes_after_an_error(bench):
    """An error of the flash is left over: what is written after it is written."""
    chip = bench.chip()
    chip.settings_bank().fail("PGSERR")
    start(chip)
    chip.run_for(50 * MILLISECOND)
    check_sound(chip)
    first = bytes(chip.settings_flash.bytes[6 * 128 * 1024 :])
    assert starts(1) in first, "the start is not counted"


CHECKS = [survives_torn_words, survives_a_cut_while_a_page_is_moved, survives_an_erase_cut_short, writes_after_an_error]
