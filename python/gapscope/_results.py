"""Results as the program writes them (``--json``), and what can be done with them; their parts are in `_parts`."""

from __future__ import annotations

import json
import math
import os
import tempfile
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gapscope import _html
from gapscope._errors import InputError, Interrupted
from gapscope._json import Open, from_json
from gapscope._keyed import Applied, Explanation, keyed
from gapscope._log import Floats
from gapscope._parts import (
    Channel,
    Exported,
    Finding,
    Flat,
    FoundEffect,
    Gap,
    LogFit,
    LogResult,
    NextExperiment,
    Parameter,
    Statement,
    TuneError,
    Where,
    by_name,
)
from gapscope._plugins import load_plugins, users_mujoco
from gapscope._program import Finished, ProgressCallback, option_words, run
from gapscope._traces import Traces


_NATIVE_MAJOR = 4  # of the MuJoCo that `export` to "mujoco_native" writes for


@dataclass(frozen=True)
class Model:
    """A model with what was found in it: an MJCF with the program's plugins, and its parameters.

    ``effects`` are those that were added, "cable_spring@arm"; ``values`` of all parameters by name, in their own units.
    """

    path: Path
    effects: tuple[str, ...]
    values: Mapping[str, float]
    _keep: Any = field(default=None, repr=False, compare=False)

    def xml(self) -> str:
        """The MJCF."""
        return self.path.read_text(encoding="utf-8")

    def mujoco(self, *, native: bool = False) -> tuple[Any, Any]:
        """(MjModel, MjData) of the mujoco that is installed, plugins loaded.

        ``native``: of MuJoCo 4's own elements instead, as `export` to "mujoco_native" writes them; that says also what
        is lost. Raises MissingLibrary: there is no mujoco. InputError: there are no plugins for its version, or it is
        older than 4 and lacks one of these elements.
        """
        mujoco = users_mujoco()
        if not native:
            load_plugins()
            model = mujoco.MjModel.from_xml_path(str(self.path))
            return model, mujoco.MjData(model)
        with tempfile.TemporaryDirectory(prefix="gapscope_") as folder:
            _answer(run(["export", str(self.path.parent), "--to", "mujoco_native", "--out", folder, "--json"]))
            model = _loaded_native(mujoco, Path(folder) / "model.xml")
        return model, mujoco.MjData(model)


def _loaded_native(mujoco: Any, path: Path) -> Any:
    """Tried, whatever the version: an older MuJoCo has the elements of many effects too."""
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except ValueError as error:
        version = str(mujoco.mj_versionString())
        if int(version.partition(".")[0]) >= _NATIVE_MAJOR:
            raise
        raise InputError(
            "this MuJoCo lacks an element of the model without plugins",
            "Model.mujoco(native=True)",
            f"mujoco {version}, {' '.join(str(error).split())}",
            f"MuJoCo {_NATIVE_MAJOR}.0.0 or newer",
            "install such a mujoco; Model.mujoco() without native=True takes older ones too",
        ) from None


@dataclass(frozen=True)
class Report:
    """report.html; shown where a notebook shows it."""

    path: Path
    _keep: Any = field(default=None, repr=False, compare=False)

    def _repr_html_(self) -> str:
        return _html.frame(self.path.read_text(encoding="utf-8"))


# Of result.json: the logs that judged a result, then those that were fitted.
_JUDGING = ("logs", "held_out", "train")


def _answer(finished: Finished) -> dict[str, Any]:
    """What a command printed with --json. Raises Interrupted: Ctrl-C came first."""
    if finished.interrupted:
        raise Interrupted
    return typing.cast(dict[str, Any], json.loads(finished.stdout))


@dataclass(frozen=True)
class Video:
    """What `render` drew: a video, a GIF or a still of ``width`` x ``height`` pixels. A notebook shows it."""

    path: Path
    frames: int
    width: int
    height: int
    _keep: Any = field(default=None, repr=False, compare=False)

    @classmethod
    def of(cls, said: Mapping[str, Any], keep: Any = None) -> Video:
        """From what `gapscope render --json` prints."""
        return cls(Path(said["out"]), said["frames"], said["width"], said["height"], keep)

    def _repr_html_(self) -> str:
        return _html.video(self.path)


def folders(models: Sequence[Run | str | os.PathLike[str]]) -> list[str]:
    """Results, their folders, or "nominal", as ``render --compare`` takes them."""
    return [str(one.out) if isinstance(one, Run) else os.fspath(one) for one in models]


@dataclass(frozen=True)
class Run(Open):
    """What results have in common: the folder that the program wrote, and what it said on the way."""

    out: Path
    messages: tuple[str, ...]
    _keep: Any = field(repr=False, compare=False)  # a temporary folder lives as long as its result

    def __getstate__(self) -> dict[str, Any]:
        # In another process the folder is the first one's still: give it with `out`.
        return {**self.__dict__, "_keep": None}

    def report(self) -> Report:
        """The page report.html; the last expression of a notebook's cell shows it."""
        return Report(self.out / "report.html", self._keep)

    def video(
        self,
        out: str | os.PathLike[str] | None = None,
        *,
        log: str | os.PathLike[str] | None = None,
        compare: Sequence[Run | str | os.PathLike[str]] = (),
        experiment: str | None = None,
        progress: ProgressCallback | None = None,
        options: Mapping[str, object] | None = None,
    ) -> Video:
        """The mechanism that was measured against this result's model, as `render` draws it.

        ``out`` is VIDEO.mp4, MOVING.gif or STILL.png; without it a video in the result's folder. ``log`` is a log's
        name in the result, or a file; without it the first log that judged the result. ``compare`` are models to show
        beside, three at most. ``experiment``: where its file has moved since.
        """
        target = os.fspath(out) if out is not None else str(self.out / "video.mp4")
        models = [f"{type(self).__name__.lower()}={self.out.absolute()}", *folders(compare)]
        words = [experiment or str(self.json["experiment"]), self._log_file(log), "--out", target, "--json"]
        words += option_words({"compare": models, **(options or {})})
        return Video.of(_answer(run(["render", *words], progress)), self._keep if out is None else None)

    def _log_file(self, log: str | os.PathLike[str] | None) -> str:
        """The file of a log by its name in the result; of none the first that judged it."""
        stated = self.json
        lists = stated["logs"] if isinstance(stated.get("logs"), dict) else stated
        files = [one if isinstance(one, str) else one["log"] for key in _JUDGING for one in lists.get(key, ())]
        if log is None:
            return str(files[0])
        return next((file for file in files if Path(file) == self.out / "logs" / f"{log}.npz"), os.fspath(log))

    def _go_on(self, command: str, *words: str, **options: object) -> dict[str, Any]:
        """What a command on this result's folder prints with --json; options that are None are not given."""
        return _answer(run([command, str(self.out), *words, *option_words(options), "--json"]))

    @property
    def json(self) -> dict[str, Any]:
        """The result as the program wrote it."""
        return typing.cast(dict[str, Any], json.loads((self.out / "result.json").read_text(encoding="utf-8")))


@dataclass(frozen=True)
class _WithModel(Run):
    def export(
        self,
        target: str,
        out: str | os.PathLike[str],
        *,
        timestep: float | None = None,
        draws: int | None = None,
        draws_from: str | None = None,
        seed: int | None = None,
        experiment: str | None = None,
    ) -> Exported:
        """Writes OUT/model.xml, what ``target`` has beside it (docs/reference/export.md) and OUT/fidelity.json.

        ``timestep``, s: of the written MJCF. ``draws``, of a tune: also OUT/randomization.json and
        OUT/randomization.npz, whose arrays of (draws, ...) are named as MuJoCo's (docs/how-to/randomize.md).
        ``draws_from``: "covariance", "interval", "logs" or "fits", what they are of, where the result has it.
        ``experiment``: where its file has moved since.
        """
        options = {"timestep": timestep, "draws": draws, "draws-from": draws_from, "seed": seed}
        options["experiment"] = experiment
        return from_json(Exported, self._go_on("export", to=target, out=out, **options))

    def apply(self, out: str | os.PathLike[str], *, experiment: str | None = None) -> Applied:
        """Writes the result into the text of the experiment's own MJCF (docs/how-to/apply.md); what changed there."""
        return keyed(Applied, self._go_on("apply", out=out, experiment=experiment))

    def mcap(self, out: str | os.PathLike[str]) -> tuple[Path, ...]:
        """Measured and predicted joint states for PlotJuggler, Foxglove and Rerun: OUT/LOG.mcap of each log.

        They are sensor_msgs/JointState on /real/joint_states and /sim/joint_states. Raises InputError: `rosbags` is not
        installed, no signal is a joint's.
        """
        return tuple(Path(log["table"]) for log in self._go_on("convert", to="mcap", out=out)["logs"])

    @property
    def model(self) -> Model:
        """The model of the result; its files live as long as it does."""
        stated = self.json["model"]
        effects = tuple(f"{e['name']}@{e['on']}" if e.get("on") else str(e["name"]) for e in stated["effects"])
        return Model(self.out / "model.xml", effects, stated["values"], self._keep)


@dataclass(frozen=True)
class _WithTraces(_WithModel):
    @property
    def traces(self) -> tuple[Traces, ...]:
        """Of each log, in the order of ``logs``: by signal arrays of shape (rows,), SI."""
        return self._read_traces("logs")

    def _read_traces(self, logs: str) -> tuple[Traces, ...]:
        """The program names the files by their logs; of one name, from the second on with the position in front."""
        used: set[str] = set()
        traces = []
        for position, log in enumerate(self.json[logs]):
            stem = Path(log["log"]).stem
            name = f"{position}_{stem}.csv" if stem in used else f"{stem}.csv"
            traces.append(Traces(self.out / "traces" / name, self._keep))
            used.add(stem)
        return tuple(traces)


@dataclass(frozen=True)
class Replay(_WithTraces):
    """Predicted against measured. ``error``: root mean square over signals and logs of the nrmse.

    ``error_windows``: the same, each window started from the log. ``time_step_s``, s: of the simulation;
    ``time_step_error``: by how much halving it changes the error. ``parameters`` by name, in their own units.
    """

    schema: str
    mode: str
    error: float
    logs: tuple[LogResult, ...]
    error_windows: float = math.nan
    time_step_s: float = math.nan
    time_step_error: float = math.nan
    parameters: Mapping[str, float] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        return _html.replay(self)


@dataclass(frozen=True)
class Tune(_WithTraces):
    """Fitted parameters, scored on what was not fitted. ``termination``: "converged", "interrupted" ...

    ``parameters`` are in their own units, errors normalised as `Replay.error`, ``wall_s`` in s. ``per_log``: after
    ``options={"each-log": True}`` the fits to each log alone, from which `export` draws.
    """

    schema: str
    termination: str
    parameters: tuple[Parameter, ...]
    error: TuneError
    train: tuple[LogResult, ...]
    held_out: tuple[LogResult, ...]
    held_out_by: str = ""
    optimizer: str = ""
    evaluations: int = 0
    wall_s: float = math.nan
    flat: tuple[Flat, ...] = ()
    per_log: tuple[LogFit, ...] = ()

    def __getitem__(self, parameter: str) -> Parameter:
        return by_name(self.parameters, parameter)

    @property
    def traces(self) -> tuple[Traces, ...]:
        """Of each held-out log, in the order of ``held_out``: by signal arrays of shape (rows,), SI."""
        return self._read_traces("held_out")

    def samples(
        self, draws: int, *, target: str = "mujoco_native", seed: int = 0, draws_from: str | None = None
    ) -> dict[str, Floats]:
        """Joint draws of what the logs leave open: the arrays of randomization.npz (docs/how-to/randomize.md).

        "parameters" is of shape (draws, parameters), each in its own unit, in the order in which ``parameters`` has
        those that vary. The others are named and shaped as MuJoCo's, draws first: "dof_damping" of (draws, nv).
        ``draws_from``: as `export` has it.
        """
        with tempfile.TemporaryDirectory(prefix="gapscope_") as folder:
            self.export(target, folder, draws=draws, draws_from=draws_from, seed=seed)
            with np.load(Path(folder) / "randomization.npz", allow_pickle=False) as arrays:
                return {name: arrays[name] for name in arrays.files}

    def _repr_html_(self) -> str:
        return _html.tune(self)


@dataclass(frozen=True)
class Diagnosis(_WithModel):
    """Which unmodelled effects close the gap. ``verdict``: none, parameters, effects, ambiguous or unknown.

    ``probability``: of the verdict, 0 .. 1; ``gap``: held-out errors, normalised as `Replay.error`; ``where``: of the
    retuned model. ``effects`` were accepted, ``statements`` are of every effect at every place. ``wall_s``, s.
    """

    schema: str
    verdict: str
    probability: float
    effects: tuple[FoundEffect, ...]
    gap: Gap
    statements: tuple[Statement, ...] = ()
    where: tuple[Where, ...] = ()
    ambiguous: tuple[tuple[str, ...], ...] = ()
    explanation: str = ""
    next_experiment: NextExperiment = NextExperiment()
    termination: str = ""
    wall_s: float = math.nan

    def explain(self, statement: str) -> Explanation:
        """The evidence of one statement ("coulomb_friction@arm") in full: terms, blocks of time, rivals."""
        return keyed(Explanation, self._go_on("explain", statement))

    def _repr_html_(self) -> str:
        return _html.diagnosis(self)


@dataclass(frozen=True)
class Inspection(Open):
    """Whether a log is ``fit`` for use, and what it cannot show (``verdict``).

    ``time``: rows, steps and jitter in s, the rate in Hz, each key with its unit.
    """

    log: str
    fit: bool
    unfit_because: tuple[str, ...]
    verdict: tuple[str, ...]
    channels: tuple[Channel, ...]
    findings: tuple[Finding, ...] = ()
    time: Mapping[str, Any] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        return _html.inspection(self)
