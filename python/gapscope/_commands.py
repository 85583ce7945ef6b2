"""The commands of the program as functions."""

from __future__ import annotations

import json
import os
import tempfile
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, TypeAlias, TypeVar, overload

from gapscope._errors import InputError, Interrupted
from gapscope._experiment import Experiment
from gapscope._json import from_json
from gapscope._keyed import FeedbackDesign, Identification, InputDesign, Keyed, OptimalDesign, keyed
from gapscope._log import Log, read_all
from gapscope._program import Finished, ProgressCallback, option_words, run
from gapscope.formats import format_of
from gapscope._results import Diagnosis, Inspection, Replay, Run, Tune, Video, folders

Source: TypeAlias = Experiment | str | os.PathLike[str] | Mapping[str, Any]
OneLog: TypeAlias = Log | str | os.PathLike[str]
Logs: TypeAlias = OneLog | Sequence[OneLog]
Texts: TypeAlias = str | Sequence[str]
Values: TypeAlias = Mapping[str, float] | None
Folder: TypeAlias = str | os.PathLike[str] | None
# Any other option of the program's command (docs/reference/options.md), without its dashes:
# {"huber": 2, "no-next-experiment": True}.
Options: TypeAlias = Mapping[str, object] | None
Shape: TypeAlias = Literal["multisine", "square", "steps", "sweep", "triangle"]
Feedback: TypeAlias = Literal["lqr", "poles"]
R = TypeVar("R", bound=Run)
_DESIGNS: dict[str, type[Keyed]] = {
    "gapscope.design.input/1": InputDesign,
    "gapscope.design.optimal/1": OptimalDesign,
    "gapscope.design.feedback/1": FeedbackDesign,
}


@dataclass
class _Job:
    """A command's folder, its arguments, and what its logs are called."""

    out: Path
    keep: tempfile.TemporaryDirectory[str] | None
    arguments: list[str]
    names: dict[str, str]  # of logs from memory, by the files that the program is given
    experiment: Experiment | None

    def json(self, text: str) -> dict[str, Any]:
        for path, name in self.names.items():
            text = text.replace(json.dumps(path)[1:-1], json.dumps(name)[1:-1])
        data: dict[str, Any] = json.loads(text)
        return data

    def messages(self, finished: Finished) -> tuple[str, ...]:
        def named(line: str) -> str:
            for path, name in self.names.items():
                line = line.replace(path, name)
            return line

        return tuple(named(line) for line in finished.messages)


def _job(command: str, exp: Source | None, out: Folder) -> _Job:
    keep = None if out is not None else tempfile.TemporaryDirectory(prefix="gapscope_")
    folder = Path(out) if out is not None else Path(keep.name)  # type: ignore[union-attr]
    folder.mkdir(parents=True, exist_ok=True)
    if exp is None:
        return _Job(folder, keep, [command], {}, None)
    experiment = exp if isinstance(exp, Experiment) else Experiment(exp)
    return _Job(folder, keep, [command, str(experiment.file(folder))], {}, experiment)


def as_list(logs: Logs) -> list[OneLog]:
    return [logs] if isinstance(logs, (Log, str, os.PathLike)) else list(logs)


def _files(job: _Job, logs: Logs, what: str = "logs") -> list[str]:
    """The logs' files; those in memory are written beside the result. A dataset is as many logs as it has episodes."""
    files = []
    for given in as_list(logs):
        if isinstance(given, (str, os.PathLike)) and format_of(given) is None:
            files.append(os.fspath(given))
            continue
        for log in [given] if isinstance(given, Log) else read_all(given, job.experiment):
            files.append(_written(job, log) if log.path is None else str(log.path))
    if not files:
        raise InputError("no log", what, "an empty list", "at least one")
    return files


def _written(job: _Job, log: Log) -> str:
    """The file of a log from memory, beside the result."""
    if job.experiment is not None:
        log.check_units(job.experiment)
    name = log.name or f"log_{len(job.names)}"
    path = job.out / "logs" / f"{name}.npz"
    if Path(name).name != name or str(path) in job.names:
        raise InputError("not a log's name", "Log.name", repr(name), "names that differ, without /")
    path.parent.mkdir(exist_ok=True)
    log.save(path)
    job.names[str(path)] = name
    return str(path)


def _search(command: str, exp: Source, out: Folder, logs: Logs, hold_out: Logs) -> _Job:
    """A job with logs, some of them held out by name."""
    job = _job(command, exp, out)
    job.arguments += _files(job, logs)
    _add(job, "--hold-out", _files(job, hold_out) if as_list(hold_out) else None)
    return job


def _add(job: _Job, flag: str, values: Texts | Values | float | None) -> None:
    """A flag for each of the values; none where there is no value."""
    if values is None:
        return
    if isinstance(values, Mapping):
        values = [f"{name}={float(value)!r}" for name, value in values.items()]
    elif isinstance(values, (str, int, float)):
        values = [str(values)]
    for value in values:
        job.arguments += [flag, value]


def _finish(kind: type[R], job: _Job, progress: ProgressCallback | None) -> R:
    """Runs the job and reads its result; Interrupted where Ctrl-C cut it short, or came while it was read."""
    job.arguments += ["--json", "--out", str(job.out)]
    finished = _run(job, progress)
    if not finished.stdout:
        raise Interrupted

    def read() -> R:
        data, said = job.json(finished.stdout), job.messages(finished)
        return from_json(kind, data, out=job.out, messages=said, _keep=job.keep)

    try:
        result, interrupted = read(), finished.interrupted
    except KeyboardInterrupt:
        result, interrupted = read(), True
    if interrupted:
        raise Interrupted(result if isinstance(result, (Tune, Diagnosis)) else None)
    return result


def _run(job: _Job, progress: ProgressCallback | None) -> Finished:
    try:
        return run(job.arguments, progress)
    except InputError as error:
        for path, name in job.names.items():
            error = InputError(*(str(part).replace(path, name) for part in error.args))
        raise error from None


@overload
def inspect(exp: Source, logs: Logs, *, options: Options = None) -> tuple[Inspection, ...]: ...
@overload
def inspect(exp: Logs, logs: None = None, *, options: Options = None) -> tuple[Inspection, ...]: ...
def inspect(exp: Source | Logs, logs: Logs | None = None, *, options: Options = None) -> tuple[Inspection, ...]:
    """Is each log fit for use: timing, gaps, repairs, saturation, excitation. One Inspection a log, in their order.

    ``inspect(logs)``, without an experiment, looks at every column in the log's own units.
    """
    if logs is None:
        if isinstance(exp, (Experiment, Mapping)):
            raise InputError("no log", "inspect", cure="inspect(experiment, logs), or inspect(logs)")
        job, found = _job("inspect", None, None), exp
    else:
        job, found = _job("inspect", typing.cast(Source, exp), None), logs
    job.arguments += [*_files(job, found), "--json"]
    job.arguments += option_words(options)
    finished = _run(job, None)
    if finished.interrupted:
        raise Interrupted
    return tuple(from_json(Inspection, log) for log in job.json(finished.stdout)["logs"])


def replay(
    exp: Source,
    logs: Logs,
    *,
    with_: Texts = (),
    set: Values = None,
    mode: str | None = None,
    window_s: float | None = None,
    jobs: int | None = None,
    out: Folder = None,
    options: Options = None,
) -> Replay:
    """The logged commands through the model: predicted against measured.

    ``with_`` adds effects ("cable_spring@arm"), ``set`` sets parameters in their own units. ``mode`` is "free_run",
    "windows" or "closed_loop"; ``window_s``: the length of a window, s. ``jobs`` are workers. Without ``out`` the files
    live as long as the result. Its traces are arrays of shape (rows,), SI.

    >>> result = replay("models/qube/experiment.yaml", "demo/qube.csv")
    >>> print(f"{result.error:.2f}, of the arm {result.logs[0].signals['arm_rad'].nrmse:.2f}")
    1.77, of the arm 2.49
    >>> result.traces[0]["arm_rad"].predicted.shape
    (5001,)
    """
    job = _job("replay", exp, out)
    job.arguments += _files(job, logs)
    for flag, value in (("--with", with_), ("--set", set), ("--mode", mode), ("--window", window_s), ("--jobs", jobs)):
        _add(job, flag, value)
    job.arguments += option_words(options)
    return _finish(Replay, job, None)


def tune(
    exp: Source,
    logs: Logs,
    *,
    hold_out: Logs = (),
    with_: Texts = (),
    free: Texts = (),
    freeze: Texts = (),
    set: Values = None,
    starts: int | None = None,
    budget_s: float | None = None,
    jobs: int | None = None,
    seed: int = 0,
    resume: bool = False,
    out: Folder = None,
    progress: ProgressCallback | None = None,
    options: Options = None,
) -> Tune:
    """Parameters fitted until replayed trajectories match the logs, scored on logs not seen.

    ``hold_out``: logs that are not fitted; ``with_`` adds effects; ``free`` and ``freeze`` name parameters, "arm.*";
    ``set`` sets them, in their own units. ``starts``: fits from other values; ``budget_s``, s: the longest it may take;
    ``jobs``: workers. ``resume``: goes on from what an earlier call left in ``out``.

    Ctrl-C raises Interrupted, whose ``partial`` is the best so far. ``progress`` is called in this thread.
    """
    job = _search("tune", exp, out, logs, hold_out)
    for flag, value in (("--with", with_), ("--free", free), ("--freeze", freeze), ("--set", set)):
        _add(job, flag, value)
    for name, number in (("--starts", starts), ("--budget", budget_s), ("--jobs", jobs), ("--seed", seed)):
        _add(job, name, number)
    job.arguments += option_words({"resume": resume, **(options or {})})
    return _finish(Tune, job, progress)


def diagnose(
    exp: Source,
    logs: Logs,
    *,
    hold_out: Logs = (),
    with_: Texts = (),
    freeze: Texts = (),
    set: Values = None,
    prior: Values = None,
    effort: str | None = None,
    budget_s: float | None = None,
    jobs: int | None = None,
    seed: int = 0,
    resume: bool = False,
    out: Folder = None,
    progress: ProgressCallback | None = None,
    options: Options = None,
) -> Diagnosis:
    """Where the gap lies, which unmodelled effects cause it, how far it shrinks. ``effort``: "quick" ... "thorough".

    ``prior``: probabilities by effect, 0 .. 1. The other arguments are those of `tune`.

    Ctrl-C raises Interrupted, whose ``partial`` is the best verdict so far. ``progress`` is called in this thread.
    """
    job = _search("diagnose", exp, out, logs, hold_out)
    for flag, value in (("--with", with_), ("--freeze", freeze), ("--set", set), ("--prior", prior)):
        _add(job, flag, value)
    for name, number in (("--effort", effort), ("--budget", budget_s), ("--jobs", jobs), ("--seed", seed)):
        _add(job, name, number)
    job.arguments += option_words({"resume": resume, **(options or {})})
    return _finish(Diagnosis, job, progress)


def render(
    exp: Source,
    log: OneLog,
    out: str | os.PathLike[str],
    *,
    compare: Sequence[Run | str | os.PathLike[str]] = (),
    with_: Texts = (),
    set: Values = None,
    progress: ProgressCallback | None = None,
    options: Options = None,
) -> Video:
    """The measured mechanism against the simulated one: VIDEO.mp4, MOVING.gif or STILL.png.

    ``compare`` holds results, folders of results, or "nominal"; of four at most. Needs OSMesa or EGL, a video ffmpeg.
    """
    job = _job("render", exp, None)
    job.arguments += [*_files(job, log, "log"), "--json", "--out", os.fspath(out)]
    _add(job, "--compare", folders(compare))
    _add(job, "--with", with_)
    _add(job, "--set", set)
    job.arguments += option_words(options)
    finished = _run(job, progress)
    if finished.interrupted:
        raise Interrupted
    return Video.of(job.json(finished.stdout))


def identify(method: str, exp: Source, logs: Logs, *, out: Folder = None, options: Options = None) -> Identification:
    """Parameters straight from logs: ``method`` is "pd", "friction", "inertia" ... (docs/reference/identify.md).

    ``out`` is a folder for the points behind them.

    >>> found = identify("cable", "models/qube/experiment.yaml", "demo/qube.csv")
    >>> rest = found.parameters["rest"]
    >>> print(f"{rest.value:.2f} {rest.unit}, 95 % from {rest.low:.2f} to {rest.high:.2f}")
    -0.40 rad, 95 % from -0.44 to -0.37
    """
    job = _job("identify", exp, out)
    job.arguments.insert(1, method)
    job.arguments += _files(job, logs)
    return keyed(Identification, _plain(job, out, options))


@overload
def design(what: Shape, exp: Source, *, out: Folder = None, options: Options = None) -> InputDesign: ...
@overload
def design(what: Literal["optimal"], exp: Source, *, out: Folder = None, options: Options = None) -> OptimalDesign: ...
@overload
def design(what: Feedback, exp: Source, *, out: Folder = None, options: Options = None) -> FeedbackDesign: ...
@overload
def design(what: str, exp: Source, *, out: Folder = None, options: Options = None) -> Keyed: ...
def design(what: str, exp: Source, *, out: Folder = None, options: Options = None) -> Keyed:
    """An input for the next experiment ("sweep", "steps", "optimal" ...), or a controller ("lqr", "poles").

    ``out`` is the input's CSV file; a controller has none.

    >>> upright = {"at": "pendulum=3.14159", "q": "10,10,1,10"}
    >>> design("lqr", "models/qube/experiment.yaml", options=upright).states
    ('arm', 'pendulum', 'arm speed', 'pendulum speed')
    """
    job = _job("design", exp, None)
    job.arguments.insert(1, what)
    data = _plain(job, out, options)
    return keyed(_DESIGNS.get(data["schema"], Keyed), data)


def _plain(job: _Job, out: Folder, options: Options) -> dict[str, Any]:
    job.arguments += ["--json", *([] if out is None else ["--out", os.fspath(out)])]
    job.arguments += option_words(options)
    finished = _run(job, None)
    if finished.interrupted:
        raise Interrupted
    return job.json(finished.stdout)
