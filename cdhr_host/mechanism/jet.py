"""Quantities along a motion: value, rate and second derivative, carried through sums and products.

``Slope`` carries no second derivative through the same formulas, ``Plain`` nothing but the values.
"""

from typing import NamedTuple, TypeVar

import numpy as np

from cdhr_host.values import Array


class Jet(NamedTuple):
    """A function of time at N instants."""

    value: Array
    rate: Array
    bend: Array

    def plus(self, other: "Jet") -> "Jet":
        """Sum."""
        return Jet(self.value + other.value, self.rate + other.rate, self.bend + other.bend)

    def times(self, other: "Jet") -> "Jet":
        """Product."""
        return Jet(
            self.value * other.value,
            self.rate * other.value + self.value * other.rate,
            self.bend * other.value + 2.0 * (self.rate * other.rate) + self.value * other.bend,
        )

    def scaled(self, factor: float) -> "Jet":
        """Times a constant."""
        return Jet(self.value * factor, self.rate * factor, self.bend * factor)

    def shifted(self, constant: float) -> "Jet":
        """Plus a constant."""
        return Jet(self.value + constant, self.rate, self.bend)

    def inverse_root(self) -> "Jet":
        """To the power of -1/2."""
        root = 1.0 / np.sqrt(self.value)
        cube = root / self.value
        return Jet(
            root,
            -0.5 * cube * self.rate,
            0.75 * cube / self.value * self.rate * self.rate - 0.5 * cube * self.bend,
        )


class Slope(NamedTuple):
    """Value and rate, as a Jet has them."""

    value: Array
    rate: Array

    def plus(self, other: "Slope") -> "Slope":
        """Sum."""
        return Slope(self.value + other.value, self.rate + other.rate)

    def times(self, other: "Slope") -> "Slope":
        """Product."""
        return Slope(self.value * other.value, self.rate * other.value + self.value * other.rate)

    def scaled(self, factor: float) -> "Slope":
        """Times a constant."""
        return Slope(self.value * factor, self.rate * factor)

    def shifted(self, constant: float) -> "Slope":
        """Plus a constant."""
        return Slope(self.value + constant, self.rate)

    def inverse_root(self) -> "Slope":
        """To the power of -1/2."""
        root = 1.0 / np.sqrt(self.value)
        return Slope(root, -0.5 * root / self.value * self.rate)


class Plain(NamedTuple):
    """Values only, as a Jet has them."""

    value: Array

    def plus(self, other: "Plain") -> "Plain":
        """Sum."""
        return Plain(self.value + other.value)

    def times(self, other: "Plain") -> "Plain":
        """Product."""
        return Plain(self.value * other.value)

    def scaled(self, factor: float) -> "Plain":
        """Times a constant."""
        return Plain(self.value * factor)

    def shifted(self, constant: float) -> "Plain":
        """Plus a constant."""
        return Plain(self.value + constant)

    def inverse_root(self) -> "Plain":
        """To the power of -1/2."""
        return Plain(1.0 / np.sqrt(self.value))


Along = TypeVar("Along", Jet, Slope, Plain)
"""With derivatives or without."""


def constant(value: float, like: Along) -> Along:
    """The same number at every instant of ``like``."""
    still = np.zeros_like(like.value)
    return type(like)(still + value, *([still] * (len(like) - 1)))
