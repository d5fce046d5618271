"""One line of text -> its block, and everything that is wrong with it."""

import re
from typing import Final

from cdhr_host.errors import Problem
from cdhr_host.program.block import Block, Word
from cdhr_host.program.text import readable
from cdhr_host.program.words import WORDS, KnownWord, unknown

NUMBER: Final = r"[-+]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)"
"""A decimal number; no exponent."""
NUMBER_LIMIT: Final = 1e9
"""No G-code number is as great as this."""

_NUMBERED: Final = re.compile(r"[ \t]*(?=[Nn])")
_CHECKSUM: Final = re.compile(r"\*[ \t]*([0-9]{1,3})[ \t]*\Z")
_HEAD: Final = re.compile(
    r"[ \t]*(?:[Nn][ \t]*[0-9]++[ \t]*)?([A-Za-z])[ \t]*(" + NUMBER + r")(?=[ \t;*]|\Z)[ \t]*"
)
_COMMENT: Final = re.compile(r";.*|\([^()]*+\)")
_BRACKET: Final = re.compile(r"[()]")
_WORD: Final = re.compile(r"([A-Za-z])[ \t]*(" + NUMBER + r")?")
_GAP: Final = re.compile(r"[ \t]*")
_TOKEN: Final = re.compile(r"[^ \t]+")
_REST: Final = re.compile(r"[^A-Za-z \t]+")
_EXPONENT: Final = re.compile(r"[eE]([-+]?)([0-9]++)")
_WORD_E: Final = re.compile(r"[eE]")
_COMMA: Final = re.compile(r",[0-9]++")
_NOT_FINITE: Final = re.compile(r"[ \t]*[-+]?(?:nan|inf(?:inity)?)(?![A-Za-z])", re.IGNORECASE)


def parse_line(text: str, line: int) -> tuple[Block | None, list[Problem]]:
    """One line without its line end -> (its block or None, problems).

    There is no block when the line is empty, a comment or refused. ``line`` is only noted.
    """
    parser = _Parser(line)
    block = parser.block(text)
    problems = sorted(parser.problems, key=lambda problem: problem.column or 0)
    return (None if problems else block), problems


class _Parser:
    """What is found in one line."""

    def __init__(self, line: int) -> None:
        self.line = line
        self.problems: list[Problem] = []

    def refuse(self, kind: str, message: str, at: int, hint: str, value: str | None = None) -> None:
        self.problems.append(Problem(kind, message, self.line, at + 1, value=value, hint=hint))

    def block(self, text: str) -> Block | None:
        head = _HEAD.match(text)
        if head is not None:
            code = _code(head[1], head[2])
            row = WORDS.get(code)
            if row is not None and row.text:
                return self._text_block(text, head, code)
        bare = self._without_comments(text)
        words = [] if self.problems else self._words(self._without_checksum(bare, text))
        if words and words[0].letter == "N" and words[0].value is not None:
            del words[0]
        return self._checked(words) if words else None

    def _text_block(self, text: str, head: re.Match[str], code: str) -> Block:
        end = text.find(";")
        text = text if end < 0 else text[:end]
        if _NUMBERED.match(text):
            text = self._without_checksum(text, text)
        return Block(
            self.line, code, text=readable(text[head.end() :].strip(" \t")), column=head.start(1) + 1
        )

    def _without_comments(self, text: str) -> str:
        """Comments blanked, so that columns stay."""
        bare = _COMMENT.sub(lambda found: " " * len(found.group()) if found.group()[0] == "(" else "", text)
        bracket = _BRACKET.search(bare)
        if bracket is not None:
            missing = "no ')' after it" if bracket.group() == "(" else "no '(' before it"
            self.refuse(
                "comment",
                f"a '{bracket.group()}' with {missing}",
                bracket.start(),
                "comments in parentheses end in the same line and hold no other; or use ';'",
            )
        return bare

    def _without_checksum(self, text: str, written: str) -> str:
        """``N12 G1 X1*71``: the XOR of the bytes before ``*``, counted from N."""
        star = text.rfind("*")
        if star < 0:
            return text
        found = _CHECKSUM.match(text, star)
        actual = 0
        for byte in written[:star].lstrip(" \t").encode("latin-1"):
            actual ^= byte
        if found is None:
            self.refuse("checksum", "no checksum after '*'", star, f"the line's checksum is *{actual}")
        elif int(found[1]) != actual:
            message = f"checksum *{found[1]} does not fit the line"
            self.refuse("checksum", message, star, f"it would be *{actual}: the line was damaged")
        return text[:star]

    def _words(self, text: str) -> list[Word]:
        words: list[Word] = []
        at = _end(_GAP.match(text))
        while at < len(text):
            found = _WORD.match(text, at)
            at = self._stray(text, at) if found is None else self._word(text, found, words)
            at = _end(_GAP.match(text, at))
        return words

    def _word(self, text: str, found: re.Match[str], words: list[Word]) -> int:
        end = self._malformed(text, found)
        if end is not None:
            return end
        value = float(found[2]) if found[2] else None
        words.append(Word(found[1].upper(), value, found.start() + 1, found[2] or ""))
        return found.end()

    def _stray(self, text: str, at: int) -> int:
        token = _TOKEN.match(text, at)
        assert token is not None
        shown = readable(token.group())[:40]
        self.refuse("word", f"'{shown}' is not a word", at, "a word is a letter and a number: X10.5", shown)
        return token.end()

    def _malformed(self, text: str, found: re.Match[str]) -> int | None:
        """Where a number that is not one ends, or None when it is one; says what is wrong."""
        letter, digits, end = found[1], found[2], found.end()
        if not digits:
            bad = _NOT_FINITE.match(text, found.start() + 1)
            rest = _REST.match(text, found.start() + 1)
            if bad is None:
                return None if rest is None else self._rest(found, rest)
            self.refuse(
                "number", f"{letter}{bad.group().strip()} is not a number", found.start(), "give a number"
            )
            return bad.end()
        exponent = _EXPONENT.match(text, end)
        if exponent is not None and _is_exponent(text, found, exponent):
            return self._exponent(found, exponent)
        rest = _REST.match(text, end)
        if rest is not None:
            return self._rest(found, rest)
        if abs(float(digits)) >= NUMBER_LIMIT:
            message = f"{letter}{digits[:40]} is too great a number"
            self.refuse("number", message, found.start(), f"numbers are less than {NUMBER_LIMIT:.0f}")
            return end
        return None

    def _rest(self, found: re.Match[str], rest: re.Match[str]) -> int:
        shown = readable(rest.group())[:40]
        hint = "a number is written as 10, -2.5 or .5"
        if _COMMA.fullmatch(shown):
            hint = f"decimals are written with a point: {found.group()}.{shown[1:]}"
        self.refuse("number", f"{found.group()[:40]}{shown} is not a number", found.start(), hint)
        return rest.end()

    def _exponent(self, found: re.Match[str], exponent: re.Match[str]) -> int:
        shown = found[2] + exponent.group()
        plain = f"{float(shown):.12f}".rstrip("0").rstrip(".")
        self.refuse(
            "number",
            f"{found[1]}{shown}: exponents are not allowed",
            found.start(),
            f"write {found[1]}{plain}, or a space before {exponent.group()[0]} if that is a word of its own",
        )
        return exponent.end()

    def _checked(self, words: list[Word]) -> Block | None:
        first, *others = words
        if first.letter not in "GMT":
            self.refuse(
                "word", f"{first.letter} without a command", first.column - 1, "begin the line with G1"
            )
            return None
        if first.value is None or first.value < 0:
            hint = f"a command is {first.letter} and a number"
            self.refuse("missing", f"{first.letter} has no number", first.column - 1, hint)
            return None
        code = _code(first.letter, first.digits)
        row = WORDS.get(code)
        if row is None:
            self.problems.append(unknown(code, self.line, first.column))
            return None
        self._check_others(row, others)
        return Block(self.line, code, tuple(others), column=first.column)

    def _check_others(self, row: KnownWord, words: list[Word]) -> None:
        seen: set[str] = set()
        known = f"known: {' '.join(row.letters)}" if row.letters else "it has none"
        for word in words:
            at = word.column - 1
            if word.letter in "GM" and word.letter not in row.letters:
                other = f"{word.letter}{word.digits}"
                self.refuse(
                    "word", f"two commands in a line: {row.code} and {other}", at, "one command per line"
                )
            elif word.letter in seen:
                self.refuse("repeated", f"{word.letter} is given twice", at, "one of each letter in a line")
            elif word.letter not in row.letters:
                self.refuse("word", f"{row.code} has no word {word.letter}", at, known, word.letter)
            elif word.value is None and not row.bare:
                self.refuse(
                    "missing", f"{word.letter} has no number", at, f"write {word.letter}0 or leave it out"
                )
            elif word.letter == "F" and not (word.value or 0.0) > 0:
                self._slow(word)
            seen.add(word.letter)
        for letter in row.needs:
            if letter not in seen:
                self.refuse(
                    "missing", f"{row.code} needs {letter}", len(row.code), f"{row.code}: {row.meaning}"
                )

    def _slow(self, word: Word) -> None:
        self.problems.append(
            Problem(
                "feed",
                f"F{word.digits[:40]} is no speed: it must be above 0",
                self.line,
                word.column,
                value=word.value,
                limit=0.0,
                hint="F is in units per minute, such as F1200",
            )
        )


def _end(found: re.Match[str] | None) -> int:
    """Where a match that cannot fail ends."""
    assert found is not None
    return found.end()


def _code(letter: str, digits: str) -> str:
    """``("g", "01")`` -> ``"G1"``; ``("G", "5.1")`` -> ``"G5.1"``."""
    value = float(digits)
    return letter.upper() + (str(int(value)) if value.is_integer() else f"{value:g}")


def _is_exponent(text: str, found: re.Match[str], exponent: re.Match[str]) -> bool:
    """Whether an E glued to a number is an exponent rather than the word E.

    It is one after a word that stands apart, where its case differs from the letter's, where
    it is written as programs print exponents (a sign and two digits from 0), in an E word,
    and where an E word follows.
    """
    e, sign, digits = exponent.group()[0], exponent[1], exponent[2]
    apart = text[max(found.start() - 1, 0)] in " \t"
    printed = bool(sign) and len(digits) >= 2 and digits[0] == "0"
    another = found[1] in "eE" or _WORD_E.search(text, exponent.end()) is not None
    return apart or e.isupper() != found[1].isupper() or printed or another
