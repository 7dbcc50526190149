"""Every check by its name."""

from . import boot, can, dead_parts, full_flash, gyro, lines, log_port, retained, torn_flash, watchdog

MODULES = [boot, can, dead_parts, full_flash, gyro, lines, log_port, retained, torn_flash, watchdog]
CHECKS = {check.__name__: check for module in MODULES for check in module.CHECKS}


def checks_of(chip):
    """The names of those that a chip of that name is asked: all, but for those that are of other chips."""
    return [name for name, check in CHECKS.items() if chip in getattr(check, "chips", [chip])]
