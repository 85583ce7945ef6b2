"""Logs from memory: what is taken, and what is refused with which cure."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import gapscope as gs
import numpy as np
import pandas as pd
import pytest

ROWS = 50


def frame() -> pd.DataFrame:
    t = np.arange(ROWS) * 0.002
    return pd.DataFrame({"t": t, "u": np.sin(t), "q": np.cos(t)})


def changed(change: Callable[[pd.DataFrame], pd.DataFrame | None]) -> pd.DataFrame:
    data = frame()
    result = change(data)
    return data if result is None else result


def with_stamp(row: int, stamp: float) -> pd.DataFrame:
    data = frame()
    data.loc[row, "t"] = stamp
    return data


REFUSED = {
    "object column": (lambda: changed(lambda d: d.assign(mode="idle")), "mode", "pd.to_numeric"),
    "category": (lambda: changed(lambda d: d.assign(mode=pd.Categorical(["a"] * ROWS))), "mode", "df.drop(columns"),
    "complex": (lambda: changed(lambda d: d.assign(q=1j)), "complex128", "pd.to_numeric"),
    "unsorted": (lambda: with_stamp(7, 0.001), "row 7", "df.sort_values('t')"),
    "repeated": (lambda: with_stamp(7, 0.012), "repeats", "df.drop_duplicates('t')"),
    "no stamp": (lambda: with_stamp(7, np.nan), "row 7", "df.dropna(subset=['t'])"),
    "infinite stamp": (lambda: with_stamp(7, np.inf), "inf", "df.dropna(subset=['t'])"),
    "NaT": (lambda: changed(lambda d: d.assign(t=pd.to_datetime(d.t, unit="s").where(d.t != 0.004))), "NaT", "dropna"),
    "dates in a signal": (lambda: changed(lambda d: d.assign(q=pd.to_datetime(d.t, unit="s"))), "'q'", "df.drop"),
    "rows of several levels": (lambda: frame().set_index(["t", "u"]), "MultiIndex", "df.reset_index()"),
    "columns of several levels": (
        lambda: frame().set_axis(pd.MultiIndex.from_product([["a"], ["t", "u", "q"]]), axis=1),
        "MultiIndex",
        "'/'.join",
    ),
    "a name twice": (lambda: frame().set_axis(["t", "q", "q"], axis=1), "'q'", "columns.duplicated()"),
    "numbers for names": (lambda: frame().set_axis([0, 1, 2], axis=1), "0", "df.columns.map(str)"),
    "an array without names": (lambda: np.zeros((5, 2)), "ndarray", "{'time_s'"),
    "unequal lengths": (lambda: {"t": [0, 1], "q": [1]}, "1 rows, 2", "NaN"),
    "three axes": (lambda: {"t": [0, 1], "q": np.zeros((2, 3, 4))}, "(2, 3, 4)", "(rows, n)"),
    "nothing": (lambda: {}, "without columns", "time"),
    "no such file": (lambda: "gone.csv", "gone.csv", "name the right log"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_its_cure(name: str) -> None:
    make, says, cure = REFUSED[name]
    with pytest.raises(gs.InputError) as raised:
        gs.Log(make())
    error = raised.value
    assert says in str(error) and cure in str(error)
    assert error.what and (error.cure or error.allowed)


def test_times_of_every_kind_are_seconds() -> None:
    t = frame().t.to_numpy()
    stamps = pd.Timestamp("2026-11-27") + pd.to_timedelta(t, unit="s")
    for data in (
        frame().assign(t=stamps),
        frame().assign(t=stamps.tz_localize("Europe/Berlin")),
        frame().assign(t=pd.to_timedelta(t, unit="s")),
        frame().drop(columns="t").set_index(stamps.rename("t")),
    ):
        log = gs.Log(data)
        assert log.time == "t"
        np.testing.assert_allclose(log["t"], t, atol=1e-12)
    assert gs.Log(frame().drop(columns="t").set_index(stamps)).time == "time_s"


def test_missing_values_of_pandas_are_nan() -> None:
    data = frame().astype({"u": "Float64"}).assign(on=pd.array([True] * ROWS, dtype="boolean"))
    data.loc[3, "u"] = pd.NA
    data.loc[4, "on"] = pd.NA
    log = gs.Log(data)
    assert np.isnan(log["u"]).sum() == 1 and np.isnan(log["on"][4]) and log["on"][0] == 1


def test_saved_and_loaded_to_the_last_bit(tmp_path: Path) -> None:
    log = gs.Log({"time_s": frame().t, "q": np.random.default_rng(1).normal(size=(ROWS, 2))}, header={"kp": 100})
    again = gs.Log(log.save(tmp_path / "log.npz"))
    assert again.columns == log.columns == ("time_s", "q[0]", "q[1]")
    for name in log.columns:
        np.testing.assert_array_equal(again[name], log[name])
    assert list(log.to_pandas().columns) == list(log.columns)
    records = np.rec.fromarrays([frame().t, frame().u], names=["t", "u"])
    np.testing.assert_array_equal(gs.Log(records)["u"], frame().u)


def test_the_program_reads_a_frame_as_it_reads_the_csv(experiment: str, demo: str) -> None:
    data = pd.read_csv(demo)
    from_frame = gs.replay(experiment, gs.Log(data, name="run"))
    from_csv = gs.replay(experiment, demo)
    assert from_frame.logs[0].log == "run"
    assert from_frame.error == from_csv.error
    for signal in ("arm_rad", "pendulum_rad"):
        ours, theirs = from_frame.traces[0][signal], from_csv.traces[0][signal]
        np.testing.assert_array_equal(ours.predicted, theirs.predicted)
        np.testing.assert_array_equal(ours.measured, theirs.measured)
        assert ours.time_s.shape == ours.measured.shape == (len(data),)


def test_the_program_reads_a_users_own_npz(experiment: str, demo: str, tmp_path: Path) -> None:
    data = pd.read_csv(demo)
    arrays = {str(name): data[name].to_numpy() for name in data}
    np.savez_compressed(tmp_path / "own.npz", **arrays)
    assert gs.replay(experiment, tmp_path / "own.npz").error == gs.replay(experiment, demo).error
    np.savez(tmp_path / "bad.npz", time_s=data["time_s"], voltage_v=np.array([None, {}], dtype=object))
    with pytest.raises(gs.InputError, match="nothing is unpickled") as raised:
        gs.replay(experiment, tmp_path / "bad.npz")
    assert "voltage_v" in raised.value.where and "astype(float)" in raised.value.cure


def test_two_rates_in_one_table(experiment: str, demo: str, tmp_path: Path) -> None:
    """A sensor at a third of the commands' rate: its missing rows are not compared."""
    data = pd.read_csv(demo)
    third = data.copy()
    third.loc[np.arange(len(third)) % 3 != 0, ["arm_rad", "pendulum_rad"]] = np.nan
    text = Path(experiment).read_text()
    model = Path(experiment).with_name("qube.xml")
    text = text.replace("model: qube.xml", f"model: {model}")
    text = text.replace("log:\n", "log:\n  repair: {missing: keep}\n")
    assert str(model) in text and "keep" in text
    (tmp_path / "keep.yaml").write_text(text)
    kept = gs.replay(tmp_path / "keep.yaml", gs.Log(third))
    whole = gs.replay(experiment, demo)
    assert kept.error == pytest.approx(whole.error, rel=2e-3)
    assert np.isnan(kept.traces[0]["arm_rad"].measured).sum() > len(data) / 2


def test_units_are_kept_and_held_against_the_experiment(experiment: str, demo: str, tmp_path: Path) -> None:
    data = pd.read_csv(demo)
    degrees = data.assign(arm_rad=np.degrees(data.arm_rad))
    log = gs.Log(degrees, units={"arm_rad": "deg", "time_s": "s"}, name="run")
    assert log.units == {"arm_rad": "deg", "time_s": "s"} == gs.Log(log.save(tmp_path / "run.npz")).units
    (found,) = gs.inspect(log)
    assert found.log == "run" and {c.name: c.unit for c in found.channels}["arm_rad"] == "deg"
    keys = {
        "model": str(Path(experiment).with_name("qube.xml")),
        "commands": [{"actuator": "motor", "column": "voltage_v", "unit": "V"}],
        "measured": [{"signal": "arm", "column": "arm_rad", "joint": "arm", "unit": "deg"}],
    }
    assert gs.replay(keys, log).error > 1
    for taken in (experiment, {**keys, "measured": [{"signal": "arm", "column": "arm_rad", "joint": "arm"}]}):
        with pytest.raises(gs.InputError, match="another unit") as raised:
            gs.replay(taken, log)
        assert raised.value.actual == "'deg'" and "unit: deg" in raised.value.cure
    scaled = [{"signal": "arm", "column": "arm_rad", "joint": "arm", "scale": 0.01745}]
    assert gs.replay({**keys, "measured": scaled}, log).error > 1
    array = gs.Log({"t": [0, 1], "q": np.zeros((2, 2))}, units={"q": "rad/s", "t": "ms"})
    assert array.units == {"q[0]": "rad/s", "q[1]": "rad/s", "t": "ms"}


def test_units_of_nothing_are_refused(demo: str) -> None:
    with pytest.raises(gs.InputError, match="'speed'"):
        gs.Log(frame(), units={"speed": "rpm"})
    with pytest.raises(gs.InputError, match="unit of time"):
        gs.Log(frame(), units={"t": "min"})
    with pytest.raises(gs.InputError, match="two units of time"):
        gs.Log(frame(), units={"t": "ms"}, time_unit="s")
    with pytest.raises(gs.InputError, match="a file says itself"):
        gs.Log(demo, units={"arm_rad": "deg"})
