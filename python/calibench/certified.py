"""Problems whose solution is known to twenty digits, certified by an independent program in numbers of 40 and of 60 digits.

The files are those of `reference/` in the source tree; their README says how they were made. Each is checked against its SHA-256.
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from .records import CertifiedProblem

_LEVELS = ("lower", "average", "higher")


@cache
def certified_problems() -> tuple[CertifiedProblem, ...]:
    """All certified problems, by level and name.

    Raises:
        ValueError: a file is not the one that was certified.
    """
    folder = resources.files("calibench") / "certified"
    listed = (line.split("  ") for line in (folder / "SHA256SUMS").read_text().splitlines())
    problems = [_read(name, (folder / name).read_bytes(), stated) for stated, name in listed if name.endswith(".json")]
    return tuple(sorted(problems, key=lambda problem: (_LEVELS.index(problem.level), problem.name)))


def _read(name: str, content: bytes, stated: str) -> CertifiedProblem:
    found = hashlib.sha256(content).hexdigest()
    if found != stated:
        raise ValueError(f"{name} is not the file whose SHA-256 stands in SHA256SUMS ({stated}): it has {found}")
    return _problem(json.loads(content))


def _problem(fields: dict[str, Any]) -> CertifiedProblem:
    certified = fields["certified"]
    return CertifiedProblem(
        name=fields["id"],
        level=fields["level"],
        about=fields["about"],
        image_size=(fields["image_size"][0], fields["image_size"][1]),
        model=fields.get("model", "brown-conrady"),
        points=tuple(np.array(view["target"], dtype=float) for view in fields["views"]),
        pixels=tuple(np.array(view["pixels"], dtype=float) for view in fields["views"]),
        free=tuple(fields["free"]),
        hold=dict(fields["held"]),
        noise_px=fields["noise_px"],
        starts=fields["starts"],
        parameters=_numbers(certified["parameters"]),
        standard_deviations=_numbers(certified["standard_deviations"]),
        rmse_px=float(certified["rmse"]),
        sigma_px=float(certified["sigma"]),
        sum_of_squares=float(certified["sum_of_squares"]),
        degrees_of_freedom=certified["degrees_of_freedom"],
    )


def _numbers(values: dict[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in values.items()}
