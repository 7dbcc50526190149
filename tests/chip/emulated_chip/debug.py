"""The chip as a debugger's registers name it (chapter 60)."""

from .registers import RegisterFile


class DebugUnit(RegisterFile):
    def __init__(self, chip, revision):
        super().__init__(chip, "dbgmcu")
        self.revision = revision
        variant = chip.description.variant
        self.on_read("IDC", lambda: variant.revisions[self.revision] << 16 | variant.device)
