"""Many groups of logs through threads, processes and a dask cluster: results, errors, interruption, files."""

from __future__ import annotations

import math
import multiprocessing
import os
import pickle
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import gapscope as gs
import numpy as np
import pytest

from conftest import interrupt_when, shell_program

QUICK: dict[str, Any] = {"effort": "quick", "options": {"no-next-experiment": True}}
STILL = [0, 0, 0]
BAD = gs.Log({"time_s": [0, 0.1, 0.2], "voltage": [0, 1, 2], "arm_rad": STILL, "pendulum_rad": STILL})


def part(demo: str, begin: int, rows: int = 300) -> gs.Log:
    """Rows of the demo log; 300 are diagnosed in seconds, without a budget that would end by the clock."""
    return gs.Log(np.genfromtxt(demo, delimiter=",", names=True)[begin : begin + rows])


def _threads(workers: int) -> Executor:
    return ThreadPoolExecutor(workers)


def _processes(workers: int) -> Executor:
    return ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=os.chdir, initargs=("/",))


def _dask(workers: int) -> Executor:
    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None)
    client = distributed.Client(cluster)
    executor: Executor = client.get_executor()
    executor.cluster, executor.client = cluster, client  # type: ignore[attr-defined]
    return executor


@pytest.fixture(params=[_threads, _processes, _dask])
def workers(request: pytest.FixtureRequest) -> Iterator[Callable[[int], Executor]]:
    """Makes an executor of so many workers."""
    made: list[Any] = []

    def make(count: int) -> Executor:
        made.append(request.param(count))
        return made[-1]  # type: ignore[no-any-return]

    yield make
    for executor in made:
        executor.shutdown()
        if hasattr(executor, "cluster"):
            executor.client.close()
            executor.cluster.close()


def test_each_group_is_as_alone_wherever_it_runs(
    workers: Callable[[int], Executor], experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(experiment).parent)
    part(demo, 1000).save(tmp_path / "b.npz")
    groups = {"z": part(demo, 0), "bad": [BAD], "b": os.path.relpath(tmp_path / "b.npz")}
    seen: list[gs.Progress] = []
    found = gs.diagnose_many("experiment.yaml", groups, workers(2), progress=seen.append, **QUICK)
    assert list(found) == ["z", "bad", "b"]
    alone = gs.diagnose(experiment, part(demo, 0), jobs=1, **QUICK)
    first, error, last = found.values()
    assert isinstance(first, gs.Diagnosis) and isinstance(last, gs.Diagnosis)
    assert (first.verdict, first.probability, first.gap) == (alone.verdict, alone.probability, alone.gap)
    assert last.gap.refit != first.gap.refit
    assert isinstance(error, gs.InputError) and error.cure == "did you mean 'voltage'?"
    assert {(p.stage, p.total) for p in seen} == {("z", 3), ("bad", 3), ("b", 3)} and seen[-1].done == 3
    assert "<mujoco" in first.model.xml() and first.report().path.is_file()
    folder = first.out.parent
    del found, first
    assert (folder / "z" / "report.html").is_file()  # with one of them all live
    assert last.json["schema"] == last.schema
    del last
    assert not folder.exists()


def test_ctrl_c_keeps_what_is_done_and_what_was_found(
    workers: Callable[[int], Executor], experiment: str, demo: str, tmp_path: Path
) -> None:
    """One worker: the first group is done, the second under way, the third never begun."""
    groups = {"first": part(demo, 0), "second": part(demo, 0, 2000), "third": part(demo, 0)}

    def soon(progress: gs.Progress) -> None:
        if progress.done == 1:
            interrupt_when(lambda: any(tmp_path.glob("second/diagnosis.journal/*")))

    with pytest.raises(gs.Interrupted) as raised:
        gs.diagnose_many(experiment, groups, workers(1), out=tmp_path, progress=soon, **QUICK)
    partial = raised.value.partial
    assert list(partial) == ["first", "second"]
    assert partial["first"].termination == "finished" and (tmp_path / "first" / "report.html").is_file()
    assert partial["second"].termination == "interrupted" and math.isfinite(partial["second"].gap.refit)
    assert not list(tmp_path.glob(".wanted_*"))
    again = pickle.loads(pickle.dumps(raised.value))
    assert list(again.partial) == list(partial) and str(again) == str(raised.value)


def test_a_worker_that_dies_is_an_error_of_its_group(
    experiment: str, demo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GAPSCOPE_PROGRAM", shell_program(tmp_path / "killer", "kill -9 $PPID"))
    with _processes(1) as pool:
        (error,) = gs.diagnose_many(experiment, {"a": demo}, pool).values()
    assert "process" in str(error) and not isinstance(error, gs.Diagnosis)


class Elsewhere(Executor):
    """A machine that has another disk."""

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
        experiment, out, *others = args
        done: Future[Any] = Future()
        try:
            done.set_result(fn(experiment, Path("/no/such/disk") / out.name, *others, **kwargs))
        except Exception as error:
            done.set_exception(error)
        return done


def test_a_worker_without_the_folder_says_so_at_once(experiment: str, demo: str) -> None:
    (error,) = gs.diagnose_many(experiment, {"a": demo}, Elsewhere()).values()
    assert isinstance(error, gs.InputError) and "all workers share" in error.cure


def test_a_worker_that_is_interrupted_ends_all(experiment: str, demo: str, tmp_path: Path) -> None:
    """An executor that works in this very thread: Ctrl-C reaches the group, not the wait for it."""

    class Here(Executor):
        def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> Future[Any]:
            done: Future[Any] = Future()
            done.set_result(fn(*args, **kwargs))
            return done

    interrupt_when(lambda: any(tmp_path.glob("a/diagnosis.journal/*")))
    log = part(demo, 0, 2000)
    with pytest.raises(gs.Interrupted) as raised:
        gs.diagnose_many(experiment, {"a": log, "b": log}, Here(), out=tmp_path, **QUICK)
    assert [(name, one.termination) for name, one in raised.value.partial.items()] == [("a", "interrupted")]


def test_logs_held_out_by_group(experiment: str, demo: str) -> None:
    held = part(demo, 2000)
    held.name = "held"
    (found,) = gs.diagnose_many(experiment, {"a": part(demo, 0)}, hold_out={"a": held}, **QUICK).values()
    assert isinstance(found, gs.Diagnosis) and [Path(log).stem for log in found.json["logs"]["held_out"]] == ["held"]


@pytest.mark.parametrize(
    "groups, options, message",
    [
        ({}, {}, "no groups"),
        (["a.csv"], {}, "list, allowed: a mapping"),
        ({"a/b": "a.csv"}, {}, "not a group's name"),
        ({"..": "a.csv"}, {}, "not a group's name"),
        ({3: "a.csv"}, {}, "got 3"),
        ({"a": "a.csv"}, {"executor": object()}, "get_executor"),
        ({"a": "a.csv"}, {"hold_out": {"b": "b.csv"}}, "got 'b', allowed: 'a'"),
    ],
)
def test_refusals(experiment: str, groups: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(gs.InputError, match=message):
        gs.diagnose_many(experiment, groups, **options)


def test_an_option_that_is_not_known_is_told_before_any_work(experiment: str) -> None:
    with pytest.raises(TypeError, match="efort"):
        gs.diagnose_many(experiment, {"a": "a.csv"}, efort="quick")
    (error,) = gs.diagnose_many(experiment, {"a": []}).values()
    assert isinstance(error, gs.InputError) and error.what == "no log"


def test_an_experiment_with_a_spec_goes_to_other_processes(experiment: str, demo: str) -> None:
    mujoco = pytest.importorskip("mujoco")
    names = ("arm", "pendulum")
    keys = {
        "model": mujoco.MjSpec.from_file(str(Path(experiment).with_name("qube.xml"))),
        "commands": [{"actuator": "motor", "column": "voltage_v", "unit": "V"}],
        "measured": [{"signal": name, "column": f"{name}_rad", "joint": name} for name in names],
    }
    sent = pickle.loads(pickle.dumps(gs.Experiment(keys)))
    assert gs.replay(sent, demo).error == pytest.approx(gs.replay(experiment, demo).error, rel=0.01)
