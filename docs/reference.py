"""Writes the pages that follow from tables of the code: ``python docs/reference.py [FOLDER]``."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cdhr_host.profile import Profile
from cdhr_host.program.words import REASONS, WORDS
from cdhr_host.units import split_unit

HERE = Path(__file__).parent
GENERATED = "<!-- Written by docs/reference.py from the code's own table; edit that. -->"
BOUNDS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}


def word_page() -> str:
    """Every G-code word that is understood."""
    rows = (
        f"| `{word.code}` | {_letters(word.letters, word.needs, text=word.text)} | {word.meaning} |"
        for word in WORDS.values()
    )
    reasons = (f"| `{code}` | {reason} |" for code, reason in REASONS.items())
    return "\n".join(
        (
            "# G-code words",
            "",
            GENERATED,
            "",
            "What is not in this table is refused before anything moves, with the line, the column and the",
            "nearest known word; so is a letter that the word's row does not list. Letters in bold must be",
            "there. Comments are `;` to the end of the line and `( … )`; `N` numbers and `*` checksums are",
            "accepted and checked.",
            "",
            "| word | letters | meaning |",
            "|---|---|---|",
            *rows,
            "",
            "## Words with a reason of their own",
            "",
            "| word | what to do instead |",
            "|---|---|",
            *reasons,
            "",
        )
    )


def _letters(letters: str, needs: str, *, text: bool) -> str:
    shown = [f"**{letter}**" if letter in needs else letter for letter in letters]
    return " ".join(shown) or ("text" if text else "–")


def key_page() -> str:
    """Every key of a profile: unit, bounds, default, meaning."""
    schema = Profile.model_json_schema()
    parts = [
        "# Profile keys",
        "",
        GENERATED,
        "",
        "A profile is a TOML file. Every key wears its unit. A key that is not listed here, a value outside",
        "its bounds and a missing key without a default are refused, all at once, each with its section and",
        "the nearest known key. `cdhr profile show paper > mine.toml` writes a complete one to start from,",
        "`cdhr profile check mine.toml` says what is wrong with it.",
    ]
    for name, section in schema["properties"].items():
        found = schema["$defs"][_reference(section)]
        parts += ["", f"## [{name}]", "", *_about(found), "| key | allowed | default | meaning |"]
        parts += ["|---|---|---|---|", *_rows(found, schema)]
    return "\n".join((*parts, ""))


def _reference(field: dict[str, Any]) -> str:
    """The name of the definition a field refers to."""
    found = field.get("$ref") or field["allOf"][0]["$ref"]
    return str(found).rpartition("/")[2]


def _about(section: dict[str, Any]) -> Iterator[str]:
    _, _, text = section.get("description", "").partition(": ")
    if text:
        first = text.split("\n\n")[0].replace("\n", " ").replace("``", "`")
        yield f"{first[0].upper()}{first[1:]}"
        yield ""


def _rows(section: dict[str, Any], schema: dict[str, Any]) -> Iterator[str]:
    for key, field in section["properties"].items():
        default = f"`{_toml(key, field['default'])}`" if "default" in field else "–"
        yield f"| `{key}` | {_allowed(field, schema)} | {default} | {field.get('description', '')} |"


def _toml(key: str, value: Any) -> str:
    """As it would stand in the file: defaults are in SI, as all values of the code."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"{value / split_unit(key)[1]:.12g}" if isinstance(value, float) else repr(value).replace("'", '"')


def _allowed(field: dict[str, Any], schema: dict[str, Any]) -> str:
    if "$ref" in field:
        field = schema["$defs"][_reference(field)]
    if "enum" in field:
        return ", ".join(f"`{choice}`" for choice in field["enum"])
    if "anyOf" in field:
        return " or ".join(_allowed(choice, schema) for choice in field["anyOf"])
    limits = [f"{sign} {field[bound]:g}" for bound, sign in BOUNDS.items() if bound in field]
    return ", ".join(limits) or str(field.get("type", field.get("const", "")))


PAGES = {"gcode-words.md": word_page, "profile-keys.md": key_page}


def main(folder: Path) -> None:
    """Write every page into a folder."""
    for name, page in PAGES.items():
        (folder / name).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
