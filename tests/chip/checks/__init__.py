"""Every check by its name."""

from . import boot, can, dead_parts, full_flash, retained, torn_flash, watchdog

MODULES = [boot, can, dead_parts, full_flash, retained, torn_flash, watchdog]
CHECKS = {check.__name__: check for module in MODULES for check in module.CHECKS}
