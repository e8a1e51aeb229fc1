"""What calibench adds to pytest: how thorough tests made by `calibench.gate` are, from the command line."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest


def _samples(text: str) -> int | str:
    return text if text in ("quick", "thorough") else int(text)


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--gate-samples`` and ``--gate-seed``."""
    group = parser.getgroup("calibench")
    group.addoption("--gate-samples", type=_samples, help="samples a scene of tests by calibench.gate: quick, thorough or a number")
    group.addoption("--gate-seed", type=int, help="seed of their noise")
