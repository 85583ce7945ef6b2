"""The program's JSON as dataclasses, whatever they are of."""

from __future__ import annotations

import dataclasses
import math
import typing
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class Open:
    """What every result has: what it does not know by name."""

    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)


def from_json(kind: Callable[..., T], data: Mapping[str, Any], **given: Any) -> T:
    """A dataclass of the program's JSON; ``given`` are fields that it does not hold."""
    hints = typing.get_type_hints(kind)
    keys = {name: key for name, key in keys_of(kind).items() if name not in ("extra", *given)}
    known = {name: _convert(hints[name], data[key]) for name, key in keys.items() if key in data}
    extra = {key: value for key, value in data.items() if key not in keys.values()}
    return kind(**given, **known, extra=extra)


def keys_of(kind: Any) -> dict[str, str]:
    """The JSON's key of each field of a dataclass: the field's name where its metadata has no "key"."""
    return {f.name: f.metadata.get("key", f.name) for f in dataclasses.fields(kind)}


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
