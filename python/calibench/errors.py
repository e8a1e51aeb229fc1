"""What calibench refuses, and why: exceptions with the numbers of the refusal.

Every one has its text (``str``), a ``kind``, which is the name of the reason in the Rust library, and ``numbers``, the fields of that reason by
name. All are ``ValueError``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class CalibenchError(ValueError):
    """Anything that calibench refuses."""

    kind: str
    numbers: dict[str, Any]

    def __init__(self, message: str, kind: str = "other", numbers: Mapping[str, Any] | None = None) -> None:
        super().__init__(message, kind, dict(numbers or {}))
        self.message = message
        self.kind = kind
        self.numbers = dict(numbers or {})

    def __str__(self) -> str:
        return self.message


class ArrayError(CalibenchError):
    """What is no array of numbers as it is needed: another shape, complex, masked; ``numbers["argument"]`` says which argument."""


class CalibrationError(CalibenchError):
    """The data determine no camera: too few views or points, degenerate views, gross errors, a model that cannot be told from the data."""


class SettingsError(CalibenchError):
    """An argument that cannot be: an unknown parameter or lens model, a loss without a scale, a number out of its range."""


class ViewError(CalibenchError):
    """Points and pixels that do not pair up, are not finite, or lie outside of the image for the most part; ``numbers["view"]`` says in which view."""


class UndistortError(CalibenchError):
    """A pixel outside the image of the lens; ``numbers["index"]`` says which."""


class SceneError(CalibenchError):
    """A scene that cannot be photographed."""


class BoundError(CalibenchError):
    """A scene that bounds nothing: it does not determine the free parameters."""


class BoardError(CalibenchError):
    """A board that cannot exist, or a text that is none."""


class DetectError(CalibenchError):
    """The board is not seen whole and clearly."""


class RectifyError(CalibenchError):
    """An image that cannot be rectified."""


class FormatError(CalibenchError):
    """A file that cannot be read, or that cannot hold what is to be written; ``numbers`` has its line and column where there is one."""


class StudyError(CalibenchError):
    """A study that cannot be run as written; ``numbers`` has line and column where there are some."""
