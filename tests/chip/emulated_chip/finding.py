"""What ends a run: something that the real chip would not do, or would do to nobody's good."""


class Finding:
    def __init__(self, kind, text, address=None, pc=None, symbol=None):
        self.kind = kind
        self.text = text
        self.address = address
        self.pc = pc
        self.symbol = symbol

    def as_json(self):
        number = lambda value: None if value is None else f"{value:#010x}"
        return {
            "kind": self.kind,
            "text": self.text,
            "address": number(self.address),
            "pc": number(self.pc),
            "symbol": self.symbol,
        }
