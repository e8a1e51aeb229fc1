"""What calibench adds to pytest: how thorough tests made by `calibench.gate` are, from the command line."""

from __future__ import annotations

from argparse import ArgumentTypeError
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest


def _whole(text: str, least: int, wanted: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = least - 1
    if not least <= number < 2**64:
        raise ArgumentTypeError(f"{text!r}: expected {wanted}")
    return number


def _samples(text: str) -> int | str:
    return text if text in ("quick", "thorough") else _whole(text, 1, "quick, thorough or a whole number from 1 on")


def _seed(text: str) -> int:
    return _whole(text, 0, "a whole number from 0 to 2^64 - 1")


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--gate-samples`` and ``--gate-seed``."""
    group = parser.getgroup("calibench")
    group.addoption("--gate-samples", type=_samples, help="samples a scene of tests by calibench.gate: quick, thorough or a number")
    group.addoption("--gate-seed", type=_seed, help="seed of their noise")
