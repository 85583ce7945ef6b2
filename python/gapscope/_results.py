"""Results as the program writes them (``--json``), as frozen dataclasses with the same names.

Numbers that the program does not know (null) are NaN. What a newer program adds is in ``extra``.
"""

from __future__ import annotations

import dataclasses
import json
import math
import os
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from gapscope import _html
from gapscope._log import Floats
from gapscope._plugins import load_plugins
from gapscope._program import run

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class _Open:
    """What every result has: what it does not know by name."""

    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


@dataclass(frozen=True)
class Interval(_Open):
    """A value and its 95 % interval, in the parameter's own unit."""

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan

    @property
    def interval(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True)
class SignalScore(_Open):
    """Measured against predicted, SI.

    ``nrmse``: over the signal's standard deviation; ``lag_s`` > 0: measured is later than predicted.
    """

    rmse: float = math.nan
    mae: float = math.nan
    nrmse: float = math.nan
    max: float = math.nan
    lag_s: float = math.nan
    correlation: float = math.nan


@dataclass(frozen=True)
class Where(_Open):
    """A condition and its share of a signal's squared error; ``low`` and ``high``: 90 % interval of the share."""

    signal: str = ""
    condition: str = ""
    share_of_error: float = math.nan
    share_of_time: float = math.nan
    low: float = math.nan
    high: float = math.nan


@dataclass(frozen=True)
class LogResult(_Open):
    """One log of a replay or a tune."""

    log: str
    outcome: str = ""
    error: float = math.nan
    samples: int = 0
    signals: Mapping[str, SignalScore] = field(default_factory=dict)
    where: tuple[Where, ...] = ()


@dataclass(frozen=True)
class Trace:
    """A signal of one log over time, SI, each of shape (rows,); NaN where the log has no value."""

    time_s: Floats
    measured: Floats
    predicted: Floats


class Traces(Mapping[str, Trace]):
    """The traces of one log by signal; read from disk when the first is asked for. ``commands``: those by actuator."""

    def __init__(self, path: Path, keep: Any = None) -> None:
        self.path = path
        self._keep = keep
        self._columns: dict[str, Floats] | None = None

    def _load(self) -> dict[str, Floats]:
        if self._columns is None:
            with self.path.open(encoding="utf-8") as file:
                names = file.readline().rstrip("\n").split(",")
                start = file.tell()
                try:
                    table = np.loadtxt(file, delimiter=",", ndmin=2)
                except ValueError:  # a value that is not there: an empty field
                    file.seek(start)
                    table = np.loadtxt(file, delimiter=",", ndmin=2, converters=_number)
            self._columns = {name: np.ascontiguousarray(table[:, k]) for k, name in enumerate(names)}
        return self._columns

    def __getitem__(self, signal: str) -> Trace:
        columns = self._load()
        return Trace(columns["__time"], columns[f"measured/{signal}"], columns[f"predicted/{signal}"])

    def __iter__(self) -> typing.Iterator[str]:
        return (name.removeprefix("measured/") for name in self._load() if name.startswith("measured/"))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def commands(self) -> Mapping[str, Floats]:
        return {
            name.removeprefix("command/"): values
            for name, values in self._load().items()
            if name.startswith("command/")
        }


def _number(text: str) -> float:
    return float(text) if text.strip() else math.nan


@dataclass(frozen=True)
class Model:
    """A model with what was found in it: an MJCF with the program's plugins, and its parameters."""

    path: Path
    effects: tuple[str, ...]
    values: Mapping[str, float]
    _keep: Any = field(default=None, repr=False, compare=False)

    def xml(self) -> str:
        """The MJCF."""
        return self.path.read_text(encoding="utf-8")

    def mujoco(self) -> tuple[Any, Any]:
        """(MjModel, MjData) of the mujoco that is installed, plugins loaded."""
        import mujoco

        load_plugins()
        model = mujoco.MjModel.from_xml_path(str(self.path))
        return model, mujoco.MjData(model)


@dataclass(frozen=True)
class Report:
    """report.html; shown where a notebook shows it."""

    path: Path
    _keep: Any = field(default=None, repr=False, compare=False)

    def _repr_html_(self) -> str:
        return _html.frame(self.path.read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Run(_Open):
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

    def _go_on(self, command: str, *words: str, **options: object) -> dict[str, Any]:
        """What a command on this result's folder prints with --json; options that are None are not given."""
        given = [word for name, value in options.items() if value is not None for word in (f"--{name}", str(value))]
        answer = run([command, str(self.out), *words, *given, "--json"])
        return typing.cast(dict[str, Any], json.loads(answer.stdout))

    @property
    def json(self) -> dict[str, Any]:
        """The result as the program wrote it."""
        return typing.cast(dict[str, Any], json.loads((self.out / "result.json").read_text(encoding="utf-8")))


@dataclass(frozen=True)
class ExportedEffect(_Open):
    """What became of an effect: ``form`` is "exact", "approximated", "host" or "dropped"."""

    name: str
    on: str
    form: str
    how: str = ""


@dataclass(frozen=True)
class ExportError(_Open):
    """Normalised errors on the logs that the result was judged by; ``lost``: share of what closed that opened again."""

    nominal: float = math.nan
    model: float = math.nan
    exported: float = math.nan
    lost: float = math.nan


@dataclass(frozen=True)
class Exported(_Open):
    """A model for another engine: ``model`` is the MJCF's path. ``unmeasured``: why there are no errors."""

    target: str
    model: str
    time_step_s: float
    effects: tuple[ExportedEffect, ...]
    held_out_error: ExportError
    unmeasured: str = ""


@dataclass(frozen=True)
class _WithModel(Run):
    def export(
        self,
        target: str,
        out: str | os.PathLike[str],
        *,
        timestep: float | None = None,
        draws: int | None = None,
        seed: int | None = None,
        experiment: str | None = None,
    ) -> Exported:
        """Writes OUT/model.xml and OUT/fidelity.json: "mujoco", "mujoco_native", "mujoco_warp" or "mjx".

        ``timestep``, s: of the written MJCF. ``draws``, of a tune: also OUT/randomization.json and
        OUT/randomization.npz, whose arrays of (draws, ...) are named as MuJoCo's (docs/export.md). ``experiment``:
        where its file has moved since.
        """
        options = {"timestep": timestep, "draws": draws, "seed": seed, "experiment": experiment}
        return from_json(Exported, self._go_on("export", to=target, out=out, **options))

    def apply(self, out: str | os.PathLike[str], *, experiment: str | None = None) -> dict[str, Any]:
        """Writes the result into the text of the experiment's own MJCF (docs/apply.md); what changed there."""
        return self._go_on("apply", out=out, experiment=experiment)

    @property
    def model(self) -> Model:
        stated = self.json["model"]
        effects = tuple(f"{e['name']}@{e['on']}" if e.get("on") else str(e["name"]) for e in stated["effects"])
        return Model(self.out / "model.xml", effects, stated["values"], self._keep)


@dataclass(frozen=True)
class _WithTraces(_WithModel):
    @property
    def traces(self) -> tuple[Traces, ...]:
        """Of each log, in the order of ``logs``."""
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
    """Predicted against measured. ``error``: root mean square over signals and logs of the nrmse."""

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
class Parameter(_Open):
    """A fitted parameter in its own unit, with its 95 % interval. Not ``identifiable``: the logs do not say."""

    name: str
    unit: str
    nominal: float
    value: float
    low: float
    high: float
    at_bound: bool
    identifiable: bool

    @property
    def interval(self) -> tuple[float, float]:
        return self.low, self.high


@dataclass(frozen=True)
class TuneError(_Open):
    """Normalised errors: before, on what was fitted, on what was not."""

    nominal: float
    train: float
    held_out: float


@dataclass(frozen=True)
class Flat(_Open):
    """A direction of parameters that the logs leave open."""

    direction: Mapping[str, float]
    text: str


@dataclass(frozen=True)
class Tune(_WithTraces):
    """Fitted parameters, scored on what was not fitted. ``termination``: "converged", "interrupted" ..."""

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

    def __getitem__(self, parameter: str) -> Parameter:
        return _by_name(self.parameters, parameter)

    @property
    def traces(self) -> tuple[Traces, ...]:
        """Of each held-out log, in the order of ``held_out``."""
        return self._read_traces("held_out")

    def _repr_html_(self) -> str:
        return _html.tune(self)


@dataclass(frozen=True)
class FoundEffect(_Open):
    """An effect that the diagnosis accepted, with the sizes of its parameters and its share of the gap that closes."""

    name: str
    on: str
    probability: float
    parameters: Mapping[str, Interval]
    error_before: float = math.nan
    error_after: float = math.nan
    share_of_gap: float = math.nan


@dataclass(frozen=True)
class Statement(_Open):
    """Of one effect at one place: ``answer`` is "present", "absent" (smaller than ``bound``) or "unseen"."""

    name: str
    on: str
    answer: str
    probability: float
    parameters: Mapping[str, Interval] = field(default_factory=dict)
    bound: Mapping[str, float] = field(default_factory=dict)
    share_of_gap: Interval = Interval()
    rule: str = ""


@dataclass(frozen=True)
class Gap(_Open):
    """Held-out normalised errors, and which share of what can close did."""

    nominal: float
    refit: float
    final: float
    floor: float
    closed: float


@dataclass(frozen=True)
class NextExperiment(_Open):
    """The command that writes the input which would settle most."""

    command: str = ""


@dataclass(frozen=True)
class Diagnosis(_WithModel):
    """Which unmodelled effects close the gap. ``verdict``: none, parameters, effects, ambiguous or unknown."""

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

    def explain(self, statement: str) -> dict[str, Any]:
        """The evidence of one statement ("coulomb_friction@arm") in full: terms, blocks of time, rivals."""
        return self._go_on("explain", statement)

    def _repr_html_(self) -> str:
        return _html.diagnosis(self)


@dataclass(frozen=True)
class Channel(_Open):
    """A command or measured signal as it stands in the log, in its own unit."""

    name: str
    unit: str
    role: str
    minimum: float = math.nan
    maximum: float = math.nan
    mean: float = math.nan
    deviation: float = math.nan
    quantisation_step: float = math.nan
    noise: float = math.nan
    saturation_share: float = math.nan
    missing_share: float = math.nan


@dataclass(frozen=True)
class Finding(_Open):
    """Something noticed or repaired while reading."""

    kind: str = ""
    column: str = ""
    count: int = 0
    text: str = ""


@dataclass(frozen=True)
class Inspection(_Open):
    """Whether a log is ``fit`` for use, and what it cannot show (``verdict``)."""

    log: str
    fit: bool
    unfit_because: tuple[str, ...]
    verdict: tuple[str, ...]
    channels: tuple[Channel, ...]
    findings: tuple[Finding, ...] = ()
    time: Mapping[str, Any] = field(default_factory=dict)

    def _repr_html_(self) -> str:
        return _html.inspection(self)


@dataclass(frozen=True)
class Video:
    """What ``render`` drew: a video, a GIF or a still. A notebook shows it."""

    path: Path
    frames: int
    width: int
    height: int

    def _repr_html_(self) -> str:
        return _html.video(self.path)


def _by_name(items: tuple[Parameter, ...], name: str) -> Parameter:
    for item in items:
        if item.name == name:
            return item
    raise KeyError(f"{name}; there are {', '.join(item.name for item in items)}")


def from_json(kind: Callable[..., T], data: Mapping[str, Any], **given: Any) -> T:
    """A dataclass of the program's JSON; ``given`` are fields that it does not hold."""
    hints = typing.get_type_hints(kind)
    names = {f.name for f in dataclasses.fields(kind)} - {"extra"} - set(given)  # type: ignore[arg-type]
    known = {name: _convert(hints[name], data[name]) for name in names if name in data}
    extra = {key: value for key, value in data.items() if key not in names}
    return kind(**given, **known, extra=extra)


def _convert(hint: Any, value: Any) -> Any:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if hint is float:
        return math.nan if value is None else float(value)
    if dataclasses.is_dataclass(hint) and isinstance(hint, type):
        return from_json(hint, value or {})
    if origin is tuple:
        return tuple(_convert(arguments[0], item) for item in value or ())
    if origin is not None and issubclass(origin, Mapping):
        return {key: _convert(arguments[1], item) for key, item in (value or {}).items()}
    return hint() if value is None and hint in (str, int, bool) else value
