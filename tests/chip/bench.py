"""What every check works with: chips with the image in them, and facts that are printed beside the verdict."""

from pathlib import Path

from emulated_chip.chip import Chip
from emulated_chip.description import Description
from emulated_chip.image import Image


class Bench:
    def __init__(self, image, description, hook, is_long=False):
        self.image = Image(image)
        self.description = Description(description)
        self.is_long = is_long
        self.facts = {}
        self._hook = Path(hook)

    def chip(self, **options):
        """A chip that has just got its power."""
        return Chip(self.image, self.description, self._hook, **options)

    def note(self, name, value):
        self.facts[name] = value


def describe(chip):
    """What has gone wrong, in one line."""
    parts = [str(finding.as_json()) for finding in chip.findings]
    parts += [f"exception {number} at {pc:#010x} in {chip.symbol(pc)}" for _, number, pc in chip.exceptions.taken[:3]]
    parts += [f"{cause} reset at {time / 1e6:.1f} ms" for time, cause in chip.resets[1:4]]
    return "; ".join(parts) or f"it is at {chip.processor.pc:#010x} in {chip.symbol(chip.processor.pc)}"
