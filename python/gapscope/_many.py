"""Many groups of logs diagnosed, by any executor: threads, processes, the workers of a cluster."""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import os
import tempfile
import time
from collections.abc import Mapping
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor, as_completed
from pathlib import Path
from typing import Any, TypeAlias

from gapscope._commands import Folder, Logs, OneLog, Source, as_list, diagnose
from gapscope._errors import InputError, Interrupted
from gapscope._experiment import Experiment
from gapscope._log import Log
from gapscope._program import ProgressCallback, Reports, while_there
from gapscope._results import Diagnosis

Outcome: TypeAlias = Diagnosis | Exception


def diagnose_many(
    exp: Source,
    groups: Mapping[str, Logs],
    executor: Executor | None = None,
    *,
    out: Folder = None,
    progress: ProgressCallback | None = None,
    **options: Any,
) -> dict[str, Outcome]:
    """Each group of logs diagnosed by itself: by name, in the order of ``groups``, a Diagnosis or the error it met.

    ``executor`` is any of ``concurrent.futures``' kind; without it threads, one a core. The group NAME has its files in
    OUT/NAME, a folder that its worker must see too; without ``out`` they live as long as one of the results.
    ``options`` are those of `diagnose`, with one job a group where they do not say; ``hold_out`` may be a mapping by
    group. ``progress`` is called in this thread whenever a group is done.

    Ctrl-C ends the searches under way and raises Interrupted, whose ``partial`` is such a mapping too. It
    has what was done, and the best so far of what was under way. A second Ctrl-C waits for none of these.

    Raises InputError: no group, a name that is no folder's, not an executor, groups to hold out that there are not.
    """
    if executor is not None and not isinstance(executor, Executor):
        kind = type(executor).__name__
        raise InputError("not an executor", "executor", kind, "a concurrent.futures.Executor", "dask: .get_executor()")
    work = _work(groups, options)
    experiment = exp if isinstance(exp, Experiment) else Experiment(exp)
    keep = tempfile.TemporaryDirectory(prefix="gapscope_") if out is None else None
    root = Path(keep.name if keep is not None else out or "").absolute()
    root.mkdir(parents=True, exist_ok=True)
    batch = _Batch(tuple(groups), keep, progress)
    with contextlib.ExitStack() as stack:
        pool = executor
        if pool is None:
            pool = stack.enter_context(ThreadPoolExecutor(len(os.sched_getaffinity(0))))
        wanted = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix=".wanted_", dir=root)))
        try:
            for name, given in work.items():
                batch.tasks[pool.submit(_one, experiment.anywhere(), root / name, wanted, given)] = name
            batch.collect()
        except KeyboardInterrupt:
            _stop(wanted)
            with contextlib.suppress(KeyboardInterrupt):
                batch.collect()
        if not wanted.exists():
            raise Interrupted(batch.found())
    return batch.found()


def _work(groups: Mapping[str, Logs], options: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The arguments of `diagnose` of each group, checked, and of use in any working folder."""
    if not isinstance(groups, Mapping) or not groups:
        actual = "none" if isinstance(groups, Mapping) else type(groups).__name__
        raise InputError("no groups of logs", "groups", actual, "a mapping of names to logs")
    inspect.signature(diagnose).bind("", (), **options)  # an option that is not known is told before any work
    held = options.get("hold_out", ())
    by_group = held if isinstance(held, Mapping) else dict.fromkeys(groups, held)
    for name in by_group:
        if name not in groups:
            raise InputError("logs to hold out of no group", "hold_out", repr(name), ", ".join(map(repr, groups)))
    work = {}
    for name, logs in groups.items():
        if not isinstance(name, str) or Path(name).name != name or name in ("", ".."):
            raise InputError("not a group's name", "groups", repr(name), "a folder's name: text without /")
        given = {"logs": _anywhere(logs), "hold_out": _anywhere(by_group.get(name, ()))}
        work[name] = {"jobs": 1, **options, **given}
    return work


def _anywhere(logs: Logs) -> list[OneLog]:
    """With absolute paths."""
    paths = ((log, log.path if isinstance(log, Log) else log) for log in as_list(logs))
    return [log if path is None else os.path.abspath(path) for log, path in paths]


def _one(experiment: Experiment, out: Path, wanted: Path, given: dict[str, Any]) -> Diagnosis | None:
    """In the worker; None: interrupted before there was anything to tell."""
    if not out.parent.is_dir():
        raise InputError(
            "the folder of results is not on this worker's machine",
            str(out.parent),
            cure="out= a folder on a disk that all workers share",
        )
    if not wanted.exists():
        return None
    try:
        with while_there(wanted):
            return diagnose(experiment, out=out, **given)
    except Interrupted as interrupted:  # given back: no executor takes it for a task's end
        _stop(wanted)  # where it was this worker that was interrupted
        partial: Diagnosis | None = interrupted.partial
        return partial


def _stop(wanted: Path) -> None:
    """All workers."""
    with contextlib.suppress(FileNotFoundError):
        wanted.rmdir()


class _Batch:
    """The groups under way, and what became of them."""

    def __init__(self, names: tuple[str, ...], keep: Any, progress: ProgressCallback | None) -> None:
        self.tasks: dict[Future[Diagnosis | None], str] = {}
        self._names = names
        self._keep = keep
        self._reports = Reports(progress)
        self._begin = time.monotonic()
        self._done: dict[str, Outcome | None] = {}

    def collect(self) -> None:
        """Waits for all."""
        for task in as_completed([task for task, name in self.tasks.items() if name not in self._done]):
            name = self.tasks[task]
            self._done[name] = self._outcome(task)
            self._reports.tell(name, len(self._done), len(self._names), None, time.monotonic() - self._begin)

    def _outcome(self, task: Future[Diagnosis | None]) -> Outcome | None:
        try:
            # Not raised: a traceback through here would hold all results, and their files with them.
            error = task.exception()
        except CancelledError as cancelled:
            error = cancelled.with_traceback(None)
        if isinstance(error, Exception):
            return error
        found = task.result()
        return found and dataclasses.replace(found, _keep=self._keep)

    def found(self) -> dict[str, Outcome]:
        """In the order of the groups; without those that have nothing to tell."""
        done = ((name, self._done.get(name)) for name in self._names)
        return {name: outcome for name, outcome in done if outcome is not None}
