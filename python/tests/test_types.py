"""Types and docstrings: what an editor shows is what runs."""

import doctest
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

import calibench

HERE = Path(__file__).resolve().parent


def run(*command: str) -> None:
    done = subprocess.run([sys.executable, "-m", *command], capture_output=True, text=True, cwd=HERE.parent.parent)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_package_holds_for_mypy() -> None:
    pytest.importorskip("mypy")
    run("mypy", "--strict", "--package", "calibench")


def test_the_stubs_are_those_of_the_compiled_half() -> None:
    pytest.importorskip("mypy")
    run("mypy.stubtest", "calibench._native")


def test_the_tests_use_the_package_as_its_types_allow() -> None:
    pytest.importorskip("mypy")
    run("mypy", "--warn-unused-ignores", str(HERE))


def test_the_quick_start_holds_for_mypy_as_users_run_it(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    (tmp_path / "readme.py").write_text("\n".join(blocks()))
    run("mypy", "--strict", str(tmp_path / "readme.py"))


def blocks() -> list[str]:
    """Every block of Python in the README."""
    return re.findall(r"```python\n(.*?)```", (HERE.parent / "README.md").read_text(), re.DOTALL)


def public() -> list[tuple[str, object]]:
    names = [(name, getattr(calibench, name)) for name in calibench.__all__ if name != "__version__"]
    members = [
        (f"{name}.{member}", value)
        for name, thing in names
        if inspect.isclass(thing) and thing.__module__ == "calibench"
        for member, value in vars(thing).items()
        if not member.startswith("_")
    ]
    return names + members


@pytest.mark.parametrize(("name", "thing"), public(), ids=lambda value: value if isinstance(value, str) else "")
def test_everything_public_says_what_it_is(name: str, thing: object) -> None:
    assert len(inspect.getdoc(thing) or "") > 15, name


def test_the_example_of_the_package_runs() -> None:
    assert doctest.testmod(calibench).attempted > 3 and doctest.testmod(calibench).failed == 0


def test_the_quick_start_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every block of Python in the README, one after the other in one namespace."""
    monkeypatch.chdir(tmp_path)
    assert len(blocks()) >= 3
    namespace: dict[str, object] = {}
    for block in blocks():
        exec(compile(block, "README.md", "exec"), namespace)
