"""Results that are read by key too, and were plain dicts once; their parts are in `_parts`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

from gapscope._json import Open, from_json
from gapscope._parts import Block, Change, Effect, Estimate, Fit, RankedInput, Rival, Table, Term, Waveform

K = TypeVar("K", bound="Keyed")


# eq=False, here and below: they are compared as dicts are.
@dataclass(frozen=True, eq=False)
class Keyed(dict[str, Any], Open):
    """Each is a ``Keyed``, a dict too: ``result["key"]`` and ``json.dumps(result)`` give what the program wrote.

    There an unknown number is None. ``json`` is the same as a plain dict.
    """

    json: dict[str, Any] = field(repr=False)

    def __post_init__(self) -> None:
        self.update(self.json)


def keyed(kind: type[K], data: dict[str, Any]) -> K:
    """A result of the program's JSON."""
    return from_json(kind, data, json=data)


@dataclass(frozen=True, eq=False)
class Identification(Keyed):
    """Parameters straight from ``logs``. ``relation``: the equation that they are of; ``fit``: how well it holds.

    ``parameters`` by name, in their own units: the JSON's "values", a name that every dict has for something else.
    ``remarks`` say what to beware of. ``tables`` by name: points behind the parameters.
    """

    schema: str
    relation: str
    parameters: Mapping[str, Estimate] = field(metadata={"key": "values"})
    fit: Fit
    remarks: tuple[str, ...]
    tables: Mapping[str, Table]
    logs: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class InputDesign(Keyed, Waveform):
    """An input for the next experiment: ``amplitude`` and ``offset`` (a constant beside the wave) in ``unit``."""

    schema: str
    offset: float


@dataclass(frozen=True, eq=False)
class OptimalDesign(Keyed):
    """``inputs`` by how much their logs would say of ``targets`` (parameters, or pairs of effects), the best first.

    ``measure`` is "standard_deviation_over_value" or "floors_left_after_imitation", in floors of the sensors.
    ``assumed`` are values of the model. ``command`` writes the first.
    """

    schema: str
    measure: str
    targets: tuple[str, ...]
    inputs: tuple[RankedInput, ...]
    assumed: tuple[str, ...]
    command: str


@dataclass(frozen=True, eq=False)
class FeedbackDesign(Keyed):
    """A state feedback for the nominal model: command = -(sum of ``gain`` x state), states from the equilibrium, SI.

    ``gain`` is in the order of ``states``. Each pole is its real and its imaginary part, 1/s.
    """

    schema: str
    states: tuple[str, ...]
    gain: tuple[float, ...]
    open_loop_poles: tuple[tuple[float, float], ...]
    closed_loop_poles: tuple[tuple[float, float], ...]


@dataclass(frozen=True, eq=False)
class Explanation(Keyed):
    """The evidence of one statement of a diagnosis: the sum behind its ``probability``, 0 .. 1, in ``terms``.

    ``evidence``: the probability at even ``prior`` odds; from ``present_from`` on an effect is told as present.
    ``rule``: what decided. ``terms``, ``blocks`` and ``rivals`` are empty where nothing was refitted.
    """

    schema: str
    number: int
    name: str
    on: str
    answer: str
    probability: float
    prior: float
    evidence: float
    rule: str
    present_from: float
    terms: tuple[Term, ...]
    blocks: tuple[Block, ...]
    rivals: tuple[Rival, ...]


@dataclass(frozen=True, eq=False)
class Applied(Keyed):
    """A result written into the text of an MJCF: ``changes`` from ``model`` to ``out``, paths both.

    ``needs_plugins``: of gapscope. ``time_step_s``, s: of the result's errors; ``model_time_step_s``: the MJCF's own.
    ``not_in_model``: effects of the log, not of the mechanism. ``of_each_log``: parameters that each log sets anew.
    """

    schema: str
    model: str
    out: str
    changes: tuple[Change, ...]
    needs_plugins: bool
    time_step_s: float
    model_time_step_s: float
    not_in_model: tuple[Effect, ...]
    of_each_log: tuple[str, ...]
