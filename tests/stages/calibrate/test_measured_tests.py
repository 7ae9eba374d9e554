"""Which rows are one test: names, time, strain and a measured confining stress that wanders."""

import numpy as np
import pytest

from graben.errors import BadInput
from graben.stages.calibrate.measured import Reading, read_files

COMPRESSION = Reading("triaxial", "compression-positive")
STEPS = 40


def block(cell, scatter=0.0, seed=0, start=0.0, begin=0.0, lateral=True):
    """Rows of one elastic-plastic test in MPa and percent: cell, time, axial stress, lateral stress, strains."""
    confining = cell * (1 + scatter * np.random.default_rng(seed).uniform(-1, 1, STEPS))
    strain = np.linspace(0.0, 1.2, STEPS)
    axial = cell + np.minimum(120.0 * strain, 60.0 + 3 * cell)
    time = start + 30.0 * np.arange(STEPS)
    return np.stack([confining, time, axial, confining, begin + strain, -0.3 * strain], axis=1)


TITLES = (
    "confining_stress_mpa",
    "time_s",
    "stress_yy_mpa",
    "stress_xx_mpa",
    "strain_yy_percent",
    "strain_xx_percent",
)


def put(folder, rows, leave=(), names=None):
    keep = [k for k, t in enumerate(TITLES) if t not in leave]
    lines = [",".join([*(["name"] if names else []), *(TITLES[k] for k in keep)])]
    for i, row in enumerate(rows):
        lines.append(",".join([*([names[i]] if names else []), *(f"{row[k]:.9g}" for k in keep)]))
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n")
    return path


def read(folder, rows, **how):
    (part,) = read_files([put(folder, rows, **how)], COMPRESSION)
    return part.curves, part.read["tests"]


def refused(folder, rows, **how):
    with pytest.raises(BadInput) as error:
        read(folder, rows, **how)
    return str(error.value)


@pytest.mark.parametrize("leave", [(), ("time_s",), ("stress_xx_mpa",), ("time_s", "stress_xx_mpa")])
@pytest.mark.parametrize("scatter", [0.0, 0.004, 0.08])
def test_a_measured_confining_stress_stays_one_test_with_its_mean(tmp_path, leave, scatter):
    (curve,), (about,) = read(tmp_path, block(5.0, scatter), leave=leave)
    assert len(curve.stress) == STEPS
    mean = block(5.0, scatter)[:, 0].mean() * 1e6
    assert about["confining_stress_pa"] == pytest.approx(mean, rel=1e-6)
    assert about["confining_stress_deviation_pa"] == pytest.approx(np.std(block(5.0, scatter)[:, 0]) * 1e6, abs=0.1)
    assert curve.name == f"{float(f'{mean:.3g}') / 1e6:g} MPa"


@pytest.mark.parametrize("leave", [(), ("time_s",)])
@pytest.mark.parametrize("scatter", [0.0, 0.02])
def test_levels_are_tests(tmp_path, leave, scatter):
    rows = np.concatenate(
        [block(cell, scatter, seed, begin=0.01 * seed) for seed, cell in enumerate((2.0, 5.0, 9.0))]
    )
    curves, tests = read(tmp_path, rows, leave=leave)
    assert [len(c.stress) for c in curves] == [STEPS] * 3
    assert [round(t["confining_stress_pa"] / 1e6) for t in tests] == [2, 5, 9]
    assert tests[0]["told_by"] == "one test in the file" or "confining" in tests[0]["told_by"]
    assert ("strain" if leave else "time") in tests[1]["told_by"]


def test_two_specimens_at_one_confining_stress_stay_two(tmp_path):
    rows = np.concatenate([block(5.0, 0.01), block(5.0, 0.01, 1)])
    curves, tests = read(tmp_path, rows)
    assert [len(c.stress) for c in curves] == [STEPS] * 2 and len({c.name for c in curves}) == 2
    assert "time" in tests[1]["told_by"]
    message = refused(tmp_path, rows, leave=("time_s",))
    assert f"row {STEPS + 2}" in message and "one test or two" in message and "`name`" in message
    nominal = np.concatenate([block(5.0), block(5.0)])
    assert "one test or two" in refused(tmp_path, nominal, leave=("time_s",))
    names = ["A"] * STEPS + ["B"] * STEPS
    curves, tests = read(tmp_path, rows, leave=("time_s",), names=names)
    assert [c.name for c in curves] == ["A", "B"] and tests[0]["told_by"] == "column name"


def test_a_clock_that_runs_on_does_not_join_specimens(tmp_path):
    rows = np.concatenate([block(5.0), block(5.0, start=5000.0)])
    assert "one test or two" in refused(tmp_path, rows)
    rows = np.concatenate([block(5.0), block(8.0, start=5000.0)])
    curves, _tests = read(tmp_path, rows)
    assert [c.name for c in curves] == ["5 MPa", "8 MPa"]


def test_names_win_over_everything_measured(tmp_path):
    rows = block(5.0, 0.5)
    (curve,), (about,) = read(tmp_path, rows, names=["core 7"] * STEPS)
    assert curve.name == "core 7" and about["confining_stress_deviation_pa"] > 1e6
    mixed = np.empty((2 * STEPS, 6))
    mixed[::2], mixed[1::2] = block(2.0), block(5.0)
    curves, _tests = read(tmp_path, mixed, names=["A", "B"] * STEPS)
    np.testing.assert_allclose(curves[1].stress[:, 0], -5e6)
    again = np.concatenate([block(5.0), block(2.0), block(5.0)])
    names = ["5"] * STEPS + ["2"] * STEPS + ["5"] * STEPS
    assert "another name" in refused(tmp_path, again, names=names, leave=("time_s",))
    assert "a time that increases" in refused(tmp_path, again, names=names)


def test_a_counter_is_no_name(tmp_path):
    message = refused(tmp_path, block(5.0), names=[str(i) for i in range(STEPS)])
    assert "name = 40 names in 40 rows" in message and message.count("\n") == 0


def test_stages_of_one_specimen_and_a_cell_that_fills_are_refused(tmp_path):
    stages = block(5.0)
    stages[20:, 0] = 10.0
    message = refused(tmp_path, stages)
    assert "row 22, confining_stress_mpa" in message and "10 MPa, after 5 MPa" in message and "`name`" in message
    filling = block(5.0)
    filling[:10, 0] = np.linspace(0.0, 5.0, 10)
    assert "begins when its confining stress is on" in refused(tmp_path, filling)


def test_a_loop_of_unloading_does_not_split_a_test(tmp_path):
    rows = block(5.0, 0.01)
    down = rows[20:4:-1].copy()
    rows = np.concatenate([rows[:21], down, rows[5:]])
    rows[:, 1] = np.arange(len(rows))
    for leave in ((), ("time_s",)):
        (curve,), _tests = read(tmp_path, rows, leave=leave)
        assert len(curve.stress) == len(rows)


def test_a_uniaxial_test_whose_cell_shows_noise(tmp_path):
    rows = block(0.0)
    rows[:, 0] = rows[:, 3] = np.random.default_rng(0).normal(0.0, 0.02, STEPS)
    (curve,), _tests = read(tmp_path, rows)
    assert len(curve.stress) == STEPS


def test_a_file_without_labels_is_split_where_time_begins_anew(tmp_path):
    rows = np.concatenate([block(2.0), block(5.0)])
    curves, _tests = read(tmp_path, rows, leave=("confining_stress_mpa",))
    assert [c.name for c in curves] == ["log (1)", "log (2)"]


def test_a_curve_that_begins_under_a_deviator_is_told(tmp_path, caplog):
    (curve,), (about,) = read(tmp_path, block(5.0)[10:])
    assert about["begins_loaded"] and about["first_deviator_pa"] < -1e6
    assert "begins under a deviator" in caplog.text
    np.testing.assert_array_equal(curve.strain[0], 0.0)


def test_many_rows_are_read_in_good_time(tmp_path):
    rows = np.repeat(block(5.0, 0.01), 100, axis=0)
    rows[:, 1] = np.arange(len(rows))
    (curve,), _tests = read(tmp_path, rows)
    assert len(curve.stress) == 100 * STEPS
