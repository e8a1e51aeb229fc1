"""Studies in Python: those of the command, as arrays.

`study/trials.csv` is what `calibench study run python/tests/study/views.toml` wrote.
"""

import csv
from pathlib import Path

import numpy as np
import pytest

import calibench
from calibench import records

FOLDER = Path(__file__).resolve().parent / "study"
TEXT = (FOLDER / "views.toml").read_text()


@pytest.fixture(scope="module")
def study() -> records.Study:
    return calibench.run_study(TEXT)


def test_trials_are_those_of_the_command_to_the_last_bit(study: records.Study) -> None:
    with open(FOLDER / "trials.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(study.trials) == list(rows[0]) and len(rows) == 24
    for name, column in study.trials.items():
        written = [row[name] for row in rows]
        if name == "outcome":
            assert column == written
        else:
            assert np.array_equal(column, [float(value or "nan") for value in written], equal_nan=True), name


def test_statistics_are_those_of_the_trials(study: records.Study) -> None:
    one, four = study.cells
    assert (study.name, study.confidence, one.labels, four.name) == ("views", 0.95, ("1",), "views = 4")
    assert one.outcomes == {"converged": 0, "refused-too-few-views": 12} and one.statistics["fx"].sd is None
    errors = study.trials["fx_error [px]"][study.trials["cell"] == 1]
    fx = four.statistics["fx"]
    assert fx.mean is not None and fx.sd is not None and fx.rms is not None and fx.ratio is not None
    assert fx.predicted_sd is not None and (fx.unit, fx.count) == ("px", 12)
    assert fx.mean.value == pytest.approx(errors.mean(), rel=1e-12)
    assert fx.sd.value == pytest.approx(errors.std(ddof=1), rel=1e-12)
    assert fx.rms.value == pytest.approx(np.sqrt((errors**2).mean()), rel=1e-12)
    assert fx.ratio.value == pytest.approx(fx.sd.value / fx.predicted_sd, rel=1e-12)


def test_trials_become_a_data_frame_and_parquet(study: records.Study, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = study.to_frame()
    assert frame.shape == (24, 13) and frame.groupby("cell")["rmse [px]"].count().tolist() == [0, 12]
    pytest.importorskip("pyarrow")
    frame.to_parquet(tmp_path / "trials.parquet")
    pandas.testing.assert_frame_equal(pandas.read_parquet(tmp_path / "trials.parquet"), frame)


def test_a_study_that_cannot_be_run_says_where() -> None:
    with pytest.raises(calibench.StudyError, match="unknown field") as raised:
        calibench.run_study(TEXT.replace("noise_px", "noise"))
    assert raised.value.kind == "Toml" and raised.value.numbers["line"] > 1
    with pytest.raises(calibench.StudyError) as raised:
        calibench.run_study(TEXT.replace("per_cell = 12", "per_cell = 1000000000000"))
    assert raised.value.kind == "TooMuch" and raised.value.numbers["needed"] > raised.value.numbers["limit"]
