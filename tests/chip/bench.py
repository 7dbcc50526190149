"""What every check works with: chips with the image in them, and facts that are printed beside the verdict."""

from pathlib import Path

from emulated_chip.can_peers import Listener
from emulated_chip.chip import Chip
from emulated_chip.clock import MILLISECOND
from emulated_chip.description import Description
from emulated_chip.flash import Flash
from emulated_chip.image import Image
from unicorn import UC_HOOK_CODE

# Longest start that a check waits for: flash that has to be erased, twice.
LONGEST_START = 9_000 * MILLISECOND


class Bench:
    def __init__(self, image, description, hook, is_long=False):
        self.image = Image(image)
        self.description = Description(description)
        self.is_long = is_long
        self.facts = {}
        self._hook = Path(hook)

    def has_one_bank(self):
        """Whether program and settings share a bank of flash: the processor stands still while it is written."""
        return self.description.settings_bank() == 0

    def flash(self):
        """The bank of the settings, erased."""
        return Flash(self.description.banks()[self.description.settings_bank()][1])

    def chip(self, **options):
        """A chip that has just got its power, on a bus with one node that listens."""
        chip = Chip(self.image, self.description, self._hook, **options)
        chip.listener = Listener(chip.clock)
        chip.can_bus.nodes.append(chip.listener)
        return chip

    def started(self, **options):
        """A chip in its loop."""
        chip = self.chip(**options)
        start(chip)
        return chip

    def note(self, name, value):
        self.facts[name] = value


def start(chip):
    """Runs to the loop, from a reset or from power on."""
    before = chip.sleeps
    chip.run_for(LONGEST_START, stop=lambda: chip.sleeps > before)
    assert chip.sleeps > before and not chip.findings, describe(chip)


def check_sound(chip, resets=1):
    """Nothing forbidden, no fault, no reset but those that were asked for."""
    assert not chip.findings and not chip.exceptions.taken, describe(chip)
    assert len(chip.resets) == resets, describe(chip)
    stale = chip.cache.read_lines.stale_reads
    assert not stale, f"{stale} times the cache gave what the flash holds no more"


def poses(chip, since=0):
    """Times of the frames of poses, node 16."""
    return [time for time, _ in chip.listener.of(0x190, since)]


def longest_gap(times, start, end):
    """The longest time without one, ns."""
    edges = [start, *times, end]
    return max(later - earlier for earlier, later in zip(edges, edges[1:]))


def emergencies(chip, since=0):
    """Codes of the emergency frames of node 16."""
    return [int.from_bytes(frame.data[:2], "little") for _, frame in chip.listener.of(0x90, since)]


# What the program paints the stack with.
PAINT = 0xC0DE_57AC.to_bytes(4, "little")


def stack_of(chip):
    """The stack above its guard: where it begins, and its bytes."""
    top, end, guard = (chip.image.address(name) for name in ("_stack_start", "_stack_end", "_stack_guard"))
    return end + guard, top - end - guard


def deepest_stack(chip):
    """Bytes of the stack that were used since the program painted it; all of them before it has."""
    begin, size = stack_of(chip)
    stack = chip.ram_at(begin).bytes(begin, size)
    unused = next((place for place in range(0, len(stack), 4) if stack[place : place + 4] != PAINT), len(stack))
    return len(stack) - unused


def note_depths(chip):
    """A list that grows by the deepest stack until then whenever the program begins to paint it."""
    place, depths = chip.image.find("stack5paint"), []
    note = lambda *_: depths.append(deepest_stack(chip))
    chip.processor.engine.hook_add(UC_HOOK_CODE, note, begin=place, end=place)
    return depths


def describe(chip):
    """What has gone wrong, in one line."""
    parts = [str(finding.as_json()) for finding in chip.findings]
    parts += [f"exception {number} at {pc:#010x} in {chip.symbol(pc)}" for _, number, pc in chip.exceptions.taken[:3]]
    parts += [f"{cause} reset at {time / 1e6:.1f} ms" for time, cause in chip.resets[1:4]]
    return "; ".join(parts) or f"it is at {chip.processor.pc:#010x} in {chip.symbol(chip.processor.pc)}"
