"""Messages of a bag as columns: their numbers by PlotJuggler's names, and the topics' rates as one table.

A message is a mapping (JSON), a dataclass (ROS) or a protobuf message. Joints are named by the list of names beside
their values, which may change its order from message to message.
"""

from __future__ import annotations

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import MOST_COLUMNS, MOST_VALUES, Series, Table, join

_ARRAYS = 64  # elements of one list that become columns: beyond it is an image or a cloud
_POINTS = ("positions", "velocities", "accelerations", "effort")
_STATES = ("reference", "desired", "feedback", "actual", "output", "error")


def check_topics(path: Path, there: Iterable[str], asked: Sequence[str]) -> None:
    """Raises InputError: a topic that is asked for is not there."""
    known = sorted(set(there))
    if lost := [topic for topic in asked if topic not in known]:
        raise InputError("no such topic", str(path), ", ".join(lost), ", ".join(known))


class Topics:
    """The messages of a bag, as they come."""

    def __init__(self, path: Path) -> None:
        self._path, self._values = path, 0
        self._topics: dict[str, _Topic] = {}

    def add(self, name: str, received_ns: int, message: Any) -> None:
        """One message. Raises InputError where the bag holds too much."""
        topic = self._topics.setdefault(name, _Topic())
        fields = _entries(message) or {}
        leaves = _of_joints(name, fields, topic) or _leaves(name, fields)
        self._values += topic.add(_stamp_ns(fields), received_ns, leaves)
        if len(topic.values) > MOST_COLUMNS or self._values > MOST_VALUES:
            held = f"{len(topic.values)} columns of {name}, {self._values} numbers so far"
            raise InputError("a bag too large", str(self._path), held, f"{MOST_COLUMNS} columns, {MOST_VALUES} numbers")

    def table(self, asked: Sequence[str]) -> Table:
        """All of it, joined. Raises InputError: no numbers, a topic of goals that is asked for."""
        goals = [name for name, topic in self._topics.items() if topic.goals]
        cure = "record the controller's state: a controller moves between the points of a goal by itself"
        if lost := [name for name in goals if name in asked]:
            raise InputError("no command, but goals of several points", str(self._path), ", ".join(lost), cure=cure)
        series = {name: topic.series() for name, topic in self._topics.items() if topic.values and not topic.goals}
        if not series:
            raise InputError(
                "a bag without numbers", str(self._path), ", ".join(self._topics) or "no messages", "topics of numbers"
            )
        time_s, columns = join(self._path, list(series.values()))
        clock = {column: one.clock for one in series.values() for column in one.columns}
        findings = [f"left out, being goals of several points: {', '.join(goals)}; {cure}"] if goals else []
        for name, one in series.items():
            if hidden := len(one.stamps) - max(int(np.isfinite(columns[c]).sum()) for c in one.columns):
                findings.append(f"{hidden} messages of {name} share their stamp with another, or hold no number")
        if len(set(clock.values())) > 1:
            late = ", ".join(name for name, one in series.items() if one.clock == "receive")
            findings.append(f"mixed clocks: {late} by when it was received, so that delays hold transport too")
        return Table(
            {"time_s": time_s, **columns},
            "time_s",
            name=self._path.stem,
            units={"time_s": "s"},
            findings=tuple(findings),
            clock=clock,
            joined=len(series) > 1,
        )


class _Topic:
    def __init__(self) -> None:
        self.sent, self.received = array("q"), array("q")  # ns
        self.values: dict[str, array[float]] = {}
        self.goals = False

    def add(self, sent_ns: int | None, received_ns: int, leaves: Iterable[tuple[str, float]]) -> int:
        """How many numbers that was."""
        if sent_ns is not None:
            self.sent.append(sent_ns)
        self.received.append(received_ns)
        rows, added = len(self.received), 0
        for name, value in leaves:
            column = self.values.setdefault(name, array("d"))
            added += rows - len(column)
            _pad(column, rows)
            column[-1] = value
        return added

    def series(self) -> Series:
        rows, whole = len(self.received), len(self.sent) == len(self.received)
        for column in self.values.values():
            _pad(column, rows)
        columns = {name: np.array(values, dtype=np.float64) for name, values in self.values.items()}
        stamps = np.array(self.sent if whole else self.received, dtype=np.int64)
        return Series(stamps, columns, "header" if whole else "receive")


def _pad(column: array[float], rows: int) -> None:
    column.extend(array("d", [np.nan]) * (rows - len(column)))


def _entries(value: Any) -> Mapping[str, Any] | None:
    """The fields of a message; None of what is none."""
    if isinstance(value, Mapping):
        return value
    if hasattr(value, "__dataclass_fields__"):
        return {key: getattr(value, key) for key in value.__dataclass_fields__ if not key.startswith("__")}
    if not hasattr(value, "DESCRIPTOR"):
        return None
    found = {one.name: getattr(value, one.name) for one in value.DESCRIPTOR.fields}
    # A message inside that was never set is not there.
    return {key: one for key, one in found.items() if not hasattr(one, "DESCRIPTOR") or value.HasField(key)}


def _is_list(value: Any) -> bool:
    return isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes))


def _stamp_ns(fields: Mapping[str, Any]) -> int | None:
    """Of header.stamp (ROS) or timestamp (Foxglove); None where there is none, or zero."""
    header = _entries(fields.get("header")) or {}
    for found in (header.get("stamp"), fields.get("timestamp")):
        stamp = _entries(found) or {}
        whole = stamp.get("sec", stamp.get("seconds"))
        part = stamp.get("nanosec", stamp.get("nsec", stamp.get("nanos", 0)))
        if whole is not None and (whole or part):
            return int(whole) * 10**9 + int(part)
    return None


def _of_joints(prefix: str, fields: Mapping[str, Any], topic: _Topic) -> list[tuple[str, float]]:
    """Messages whose lists go by the names beside them; empty: it is none of these."""
    names = fields.get("name") or fields.get("joint_names")
    if not _is_list(names) or not all(isinstance(name, str) for name in names):  # type: ignore[union-attr]
        return []
    joints: list[str] = list(names)  # type: ignore[arg-type]
    found: list[tuple[str, float]] = []

    def take(part: str, values: Any) -> None:
        if _is_list(values) and len(values) == len(joints):
            found.extend((f"{prefix}/{name}/{part}", float(value)) for name, value in zip(joints, values))

    for key in ("position", "velocity", "effort"):
        take(key, fields.get(key))
    for part in _STATES:
        point = _entries(fields.get(part)) or {}
        for key in _POINTS:
            take(f"{part}/{key}", point.get(key))
    points = fields.get("points")
    if _is_list(points):
        topic.goals = topic.goals or len(points) > 1  # type: ignore[arg-type]
        for point in list(points)[:1]:  # type: ignore[arg-type]
            for key in _POINTS:
                take(key, (_entries(point) or {}).get(key))
    interfaces = fields.get("interface_values")
    if _is_list(interfaces) and len(interfaces) == len(joints):  # type: ignore[arg-type]
        for name, one in zip(joints, interfaces):  # type: ignore[arg-type]
            inner = _entries(one) or {}
            keys, values = inner.get("interface_names", ()), inner.get("values", ())
            found.extend((f"{prefix}/{name}/{key}", float(value)) for key, value in zip(keys, values))
    return found


def _leaves(prefix: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, (bool, int, float, np.integer, np.floating)):
        yield prefix, float(value)
    elif _is_list(value):
        if len(value) <= _ARRAYS:
            for k, one in enumerate(value):
                yield from _leaves(f"{prefix}[{k}]", one)
    else:
        for key, one in (_entries(value) or {}).items():
            if key not in ("header", "layout"):
                yield from _leaves(f"{prefix}/{key}", one)
