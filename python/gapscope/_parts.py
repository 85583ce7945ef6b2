"""Parts of results, as the program writes them (``--json``): frozen dataclasses with the same names.

Numbers that the program does not know (null) are NaN. What a newer program adds is in ``extra``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gapscope._json import Open


@dataclass(frozen=True)
class Interval(Open):
    """A value and its 95 % interval, in the parameter's own unit."""

    value: float = math.nan
    low: float = math.nan
    high: float = math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """(low, high), in the parameter's own unit."""
        return self.low, self.high


@dataclass(frozen=True)
class SignalScore(Open):
    """Measured against predicted, of one signal of one log.

    ``rmse``, ``mae`` and ``max`` in the signal's SI unit; ``nrmse``: rmse over the signal's standard deviation;
    ``lag_s`` > 0, s: measured is later than predicted; ``correlation``: -1 .. 1.
    """

    rmse: float = math.nan
    mae: float = math.nan
    nrmse: float = math.nan
    max: float = math.nan
    lag_s: float = math.nan
    correlation: float = math.nan


@dataclass(frozen=True)
class Where(Open):
    """A condition and its share of a signal's squared error; ``low`` and ``high``: 90 % interval of the share.

    Shares are 0 .. 1.
    """

    signal: str = ""
    condition: str = ""
    share_of_error: float = math.nan
    share_of_time: float = math.nan
    low: float = math.nan
    high: float = math.nan


@dataclass(frozen=True)
class LogResult(Open):
    """One log of a replay or a tune.

    ``error``: root mean square over its signals of the nrmse; ``samples``: rows that were compared; ``signals`` and
    ``where`` by signal.
    """

    log: str
    outcome: str = ""
    error: float = math.nan
    samples: int = 0
    signals: Mapping[str, SignalScore] = field(default_factory=dict)
    where: tuple[Where, ...] = ()


@dataclass(frozen=True)
class ExportedEffect(Open):
    """What became of an effect: ``form`` is "exact", "approximated", "host" or "dropped"."""

    name: str
    on: str
    form: str
    how: str = ""


@dataclass(frozen=True)
class ExportError(Open):
    """Normalised errors on the logs that the result was judged by; ``lost``: share of what closed that opened again."""

    nominal: float = math.nan
    model: float = math.nan
    exported: float = math.nan
    lost: float = math.nan


@dataclass(frozen=True)
class Exported(Open):
    """A model for another engine: ``model`` is the MJCF's path, ``files`` those that the engine has beside it.

    ``time_step_s``, s: of the MJCF. ``delay_steps``: by drive, delays of the engine's configuration, in its own steps.
    ``unmeasured``: why there are no errors.
    """

    target: str
    model: str
    time_step_s: float
    effects: tuple[ExportedEffect, ...]
    held_out_error: ExportError
    files: tuple[str, ...] = ()
    delay_steps: Mapping[str, float] = field(default_factory=dict)
    unmeasured: str = ""


@dataclass(frozen=True)
class Parameter(Open):
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
        """(low, high), in the parameter's own unit."""
        return self.low, self.high


@dataclass(frozen=True)
class LogFit(Open):
    """The parameters that all logs together know, fitted to one log alone; each in its own unit."""

    log: str
    termination: str
    parameters: tuple[Parameter, ...]

    def __getitem__(self, parameter: str) -> Parameter:
        return by_name(self.parameters, parameter)


@dataclass(frozen=True)
class TuneError(Open):
    """Normalised errors: before, on what was fitted, on what was not."""

    nominal: float
    train: float
    held_out: float


@dataclass(frozen=True)
class Flat(Open):
    """A direction of parameters that the logs leave open."""

    direction: Mapping[str, float]
    text: str


@dataclass(frozen=True)
class FoundEffect(Open):
    """An effect that the diagnosis accepted, with the sizes of its parameters and its share of the gap that closes.

    ``parameters`` by name, in their own units; ``error_before`` and ``error_after`` normalised; ``share_of_gap`` and
    ``probability``: 0 .. 1.
    """

    name: str
    on: str
    probability: float
    parameters: Mapping[str, Interval]
    error_before: float = math.nan
    error_after: float = math.nan
    share_of_gap: float = math.nan


@dataclass(frozen=True)
class Statement(Open):
    """Of one effect at one place: ``answer`` is "present", "absent" (smaller than ``bound``) or "unseen".

    ``parameters`` and ``bound`` by name, in their own units; ``probability`` and ``share_of_gap``: 0 .. 1.
    ``caveat``: what the logs' clocks leave open of a delay or a lag.
    """

    name: str
    on: str
    answer: str
    probability: float
    parameters: Mapping[str, Interval] = field(default_factory=dict)
    bound: Mapping[str, float] = field(default_factory=dict)
    share_of_gap: Interval = Interval()
    rule: str = ""
    caveat: str = ""


@dataclass(frozen=True)
class LogGap(Open):
    """Normalised errors of one log, or of a part of one, by parameters fitted without it."""

    log: str
    refit: float
    final: float
    floor: float
    from_s: float = 0.0
    until_s: float = math.nan


@dataclass(frozen=True)
class FurtherLog(Open):
    """What to expect of a further log: the median, the least and the most share that closes on ``logs`` logs."""

    closed: float = math.nan
    low: float = math.nan
    high: float = math.nan
    logs: int = 0


@dataclass(frozen=True)
class Gap(Open):
    """Held-out normalised errors, which share of what can close did, and the same log by log."""

    nominal: float
    refit: float
    final: float
    floor: float
    closed: float
    by_log: tuple[LogGap, ...] = ()
    further_log: FurtherLog = field(default_factory=FurtherLog)


@dataclass(frozen=True)
class NextExperiment(Open):
    """The command that writes the input which would settle most."""

    command: str = ""


@dataclass(frozen=True)
class Channel(Open):
    """A command or measured signal as it stands in the log, in its own unit; shares are 0 .. 1."""

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
class Finding(Open):
    """Something noticed or repaired while reading."""

    kind: str = ""
    column: str = ""
    count: int = 0
    text: str = ""


@dataclass(frozen=True)
class Estimate(Interval):
    """A value that `identify` found in its ``unit``, and its 95 % interval."""

    unit: str = ""


@dataclass(frozen=True)
class Fit(Open):
    """How well a relation holds on the ``rows`` used: ``r2`` at most 1, ``rmse`` in ``unit``."""

    r2: float
    rmse: float
    unit: str
    rows: int


@dataclass(frozen=True)
class Table(Open):
    """Points behind estimates: ``numpy.array(table.rows)`` is of shape (rows, columns).

    A column is in the unit that its name ends in, else in that of the estimate of its name.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[float, ...], ...]


@dataclass(frozen=True)
class Effect(Open):
    """An effect where it acts: ``on`` is a joint, an actuator or a measured signal; empty: the model."""

    name: str
    on: str


@dataclass(frozen=True)
class Rival(Effect):
    """An effect that was tried in the place of another. ``behind``: log of the cost with it over that of the set."""

    behind: float


@dataclass(frozen=True)
class Term(Open):
    """What a probability is summed from: ``adds``, to the logarithm of the odds, is ``weight`` times ``counted``.

    ``counted`` is the ``value`` after its transformation.
    """

    name: str
    value: float
    counted: float
    weight: float
    adds: float


@dataclass(frozen=True)
class Block(Open):
    """A part of a held-out log, and the ``share`` of its squared error that the effect takes away; negative: adds."""

    log: str
    from_s: float
    to_s: float
    share: float


@dataclass(frozen=True)
class Change(Open):
    """An attribute of an MJCF's element, "" where there is none; without ``attribute`` a new element."""

    element: str
    attribute: str = ""
    before: str = ""
    after: str = ""


@dataclass(frozen=True)
class Limit(Open):
    """A limit of the rig, and what an input reaches on the nominal model; both in ``unit``."""

    name: str
    unit: str
    reached: float
    limit: float


@dataclass(frozen=True)
class Waveform(Open):
    """An input: ``amplitude`` in ``unit``, frequencies in Hz, and how near it comes to the rig's ``limits``.

    ``mirrored``: the second half is the first one with its sign changed.
    """

    shape: str
    amplitude: float
    unit: str
    duration_s: float
    low_hz: float
    high_hz: float
    seed: int
    mirrored: bool
    limits: tuple[Limit, ...]


@dataclass(frozen=True)
class RankedInput(Waveform):
    """An input of an `OptimalDesign`: its measure ``per_target``, and the ``score`` of them all, the larger the better.

    Not ``fitted_in_full``: both are rough.
    """

    per_target: tuple[float, ...]
    score: float
    fitted_in_full: bool


def by_name(items: tuple[Parameter, ...], name: str) -> Parameter:
    for item in items:
        if item.name == name:
            return item
    raise KeyError(f"{name}; there are {', '.join(item.name for item in items)}")
