"""What one chip of the family has and another has not. `stm32-metapac` tells the rest."""


class Variant:
    """A chip. `board` is what the image calls itself, `renamed` says what the manual calls memories that the description calls otherwise, `clocks` which memories need
    a clock (register and field), `settings` the first address of the settings, in the last pages of a bank."""

    def __init__(self, *, board, renamed, clocks, settings, device, revisions, newest, has_overdrive):
        self.board = board
        self.renamed = renamed
        self.clocks = clocks
        self.settings = settings
        self.device = device
        self.revisions = revisions
        self.newest = newest
        self.has_overdrive = has_overdrive


VARIANTS = {
    # RM0433: clocks 8.7.42 and 2.4, device 60.5.8.
    "STM32H743ZI": Variant(
        board="Nucleo-H743ZI",
        renamed={},
        clocks={
            "SRAM1": ("AHB2ENR", "SRAM1EN"),
            "SRAM2": ("AHB2ENR", "SRAM2EN"),
            "SRAM3": ("AHB2ENR", "SRAM3EN"),
            "BKPSRAM": ("AHB4ENR", "BKPSRAMEN"),
        },
        settings=0x081C_0000,
        device=0x450,
        revisions={"Y": 0x1003, "X": 0x2001, "V": 0x2003},
        newest="V",
        has_overdrive=True,
    ),
    # RM0468: memories 2.3 (what the description calls SRAM2 and SRAM3 is SRAM1 and SRAM2 there), clocks 8.7.42, device 65.5.8.
    "STM32H723ZG": Variant(
        board="Nucleo-H723ZG",
        renamed={"SRAM2": "SRAM1", "SRAM3": "SRAM2"},
        clocks={
            "SRAM1": ("AHB2ENR", "SRAM1EN"),
            "SRAM2": ("AHB2ENR", "SRAM2EN"),
            "BKPSRAM": ("AHB4ENR", "BKPSRAMEN"),
        },
        settings=0x080C_0000,
        device=0x483,
        revisions={"A": 0x1000, "Z": 0x1001},
        newest="Z",
        has_overdrive=False,
    ),
}
