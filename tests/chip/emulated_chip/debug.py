"""The chip as a debugger's registers name it (chapter 60)."""

from .registers import RegisterFile

DEVICE = 0x450
REVISIONS = {"Y": 0x1003, "X": 0x2001, "V": 0x2003}


class DebugUnit(RegisterFile):
    def __init__(self, chip, revision):
        super().__init__(chip, "dbgmcu")
        self.revision = revision
        self.on_read("IDC", lambda: REVISIONS[self.revision] << 16 | DEVICE)
