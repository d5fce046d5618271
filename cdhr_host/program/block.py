"""One line of G-code, taken apart and put together again."""

from dataclasses import dataclass, field
from decimal import Decimal


@dataclass(frozen=True, slots=True)
class Word:
    """A letter and its number, as written."""

    letter: str
    """upper case"""
    value: float | None
    """None for a letter alone"""
    column: int = field(default=1, compare=False)
    digits: str = field(default="", compare=False)
    """the number as written"""


@dataclass(frozen=True, slots=True)
class Block:
    """The command of one line."""

    line: int
    code: str
    """such as ``"G1"``: letter in upper case, number without leading zeros"""
    words: tuple[Word, ...] = ()
    """in the order of the line, no letter twice"""
    text: str = ""
    """what follows a command that takes text (M117)"""
    column: int = field(default=1, compare=False)

    def __contains__(self, letter: str) -> bool:
        return any(word.letter == letter for word in self.words)

    def word(self, letter: str) -> Word:
        """The word with this letter; it must be there."""
        return next(word for word in self.words if word.letter == letter)

    def get(self, letter: str, default: float = 0.0) -> float:
        """The number after a letter, or the default where the letter or its number is missing."""
        value = next((word.value for word in self.words if word.letter == letter), None)
        return default if value is None else value


def print_number(value: float) -> str:
    """The shortest decimal that reads back as the same number, never with an exponent."""
    text = format(Decimal(repr(value)), "f")
    return text.rstrip("0").rstrip(".") if "." in text else text


def print_block(block: Block) -> str:
    """A line of G-code without its line end; ``parse_line`` gives the block back."""
    words = [word.letter + ("" if word.value is None else print_number(word.value)) for word in block.words]
    return " ".join([block.code, *words, *([block.text] if block.text else [])])
