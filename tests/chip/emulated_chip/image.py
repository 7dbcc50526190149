"""The file that is flashed: what is loaded where, and the names of its places."""

import bisect

from elftools.elf.elffile import ELFFile


class Image:
    def __init__(self, path):
        self.segments = []
        self._starts = []
        self._names = []
        self._addresses = {}
        with open(path, "rb") as file:
            elf = ELFFile(file)
            for segment in elf.iter_segments("PT_LOAD"):
                if segment["p_filesz"]:
                    self.segments.append((segment["p_paddr"], segment.data()))
            symbols = elf.get_section_by_name(".symtab")
            functions = []
            for symbol in symbols.iter_symbols():
                self._addresses.setdefault(symbol.name, symbol["st_value"])
                if symbol["st_info"]["type"] == "STT_FUNC":
                    functions.append((symbol["st_value"] & ~1, symbol.name))
        for start, name in sorted(functions):
            self._starts.append(start)
            self._names.append(name)

    def symbol(self, address):
        """The function that this address is in."""
        place = bisect.bisect_right(self._starts, address) - 1
        return self._names[place] if place >= 0 else "?"

    def address(self, name):
        """Where something is that has exactly this name; None if nothing has."""
        return self._addresses.get(name)

    def find(self, part):
        """Where the only function is whose name has this part."""
        found = [start for start, name in zip(self._starts, self._names) if part in name]
        if len(found) != 1:
            raise LookupError(f"{len(found)} functions have {part} in their names")
        return found[0]
