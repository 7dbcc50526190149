"""Every check by its name."""

from . import boot

MODULES = [boot]
CHECKS = {check.__name__: check for module in MODULES for check in module.CHECKS}
