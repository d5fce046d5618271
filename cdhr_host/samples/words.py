"""Numbers as G-code has them."""

DECIMALS = 5
"""of a coordinate in mm: 0.01 µm"""


def word(letter: str, value: float, decimals: int = DECIMALS) -> str:
    """``("X", 1.50)`` -> ``"X1.5"``; never an exponent, never a negative zero."""
    digits = f"{round(float(value), decimals) + 0.0:.{decimals}f}".rstrip("0").rstrip(".")
    return f"{letter}{digits}"


def words(**values: float) -> str:
    """``X=1.5, F=600`` -> ``"X1.5 F600"``."""
    return " ".join(word(letter, value) for letter, value in values.items())
