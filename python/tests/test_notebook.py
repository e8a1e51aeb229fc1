"""The notebook runs from its first cell to its last, and its figures are drawn."""

import json
from pathlib import Path

import pytest

NOTEBOOK = Path(__file__).resolve().parent.parent / "notebooks/four_pose.ipynb"


def test_the_notebook_runs_and_draws_its_figures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    cells = json.loads(NOTEBOOK.read_text())["cells"]
    assert all(not cell["outputs"] for cell in cells if cell["cell_type"] == "code"), "outputs are not committed"
    namespace: dict[str, object] = {}
    for number, cell in enumerate(cells):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"cell {number}", "exec"), namespace)
    figures = [plt.figure(number) for number in plt.get_fignums()]
    for number, figure in enumerate(figures):
        figure.savefig(tmp_path / f"{number}.png")
    assert len(figures) == 3 and all((tmp_path / f"{n}.png").stat().st_size > 10_000 for n in range(3))
    said = capsys.readouterr().out
    assert "fx" in said and "599.71848" in said and "NotIdentifiable ['focal-length', 'distance'" in said
    plt.close("all")
