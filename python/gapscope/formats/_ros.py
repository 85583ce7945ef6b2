"""ROS bags: rosbag2 (a folder, .mcap or .db3) and ROS 1 (.bag), by `rosbags`, which needs no ROS.

Names are PlotJuggler's: /joint_states/arm/position, /imu/angular_velocity/x. Stamps are the message's own where it has
any, else when it was received.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import MOST_VALUES, Format, Series, Source, Table, join, library, unreadable

_WHAT, _EXTRA = "ROS bag", "ros"
_ARRAYS = 64  # elements of one array that become columns: beyond it is an image or a cloud


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".bag", ".mcap", ".db3") or (path.is_dir() and (path / "metadata.yaml").is_file())


class _Topic:
    def __init__(self) -> None:
        self.stamps: list[float] = []
        self.values: dict[str, list[float]] = {}
        self.header = True

    def add(self, stamp: float | None, received: float, leaves: Iterable[tuple[str, float]]) -> None:
        self.header = self.header and stamp is not None
        self.stamps.append(received if stamp is None else stamp)
        for name, value in leaves:
            column = self.values.setdefault(name, [])
            column.extend([np.nan] * (len(self.stamps) - 1 - len(column)))
            column.append(value)

    def series(self) -> Series:
        rows = len(self.stamps)
        columns = {name: np.array(v + [np.nan] * (rows - len(v)), dtype=np.float64) for name, v in self.values.items()}
        return Series(np.array(self.stamps), columns, "header" if self.header else "receive")


def _stamp(message: Any) -> float | None:
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None or (stamp.sec == 0 and stamp.nanosec == 0):
        return None
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _named(prefix: str, message: Any) -> Iterable[tuple[str, float]] | None:
    """Messages whose lists go by the names beside them."""
    names = getattr(message, "name", None) or getattr(message, "joint_names", None)
    if not isinstance(names, list) or not names:
        return None
    found = []
    for key in ("position", "velocity", "effort"):
        values = getattr(message, key, None)
        if values is not None and len(values) == len(names):
            found += [(f"{prefix}/{name}/{key}", float(value)) for name, value in zip(names, values)]
    for part in ("reference", "desired", "feedback", "actual", "output", "error"):
        point = getattr(message, part, None)
        for key in ("positions", "velocities", "effort"):
            values = getattr(point, key, None)
            if values is not None and len(values) == len(names):
                found += [(f"{prefix}/{name}/{part}/{key}", float(value)) for name, value in zip(names, values)]
    interfaces = getattr(message, "interface_values", None)
    if isinstance(interfaces, list) and len(interfaces) == len(names):
        for name, one in zip(names, interfaces):
            found += [(f"{prefix}/{name}/{key}", float(v)) for key, v in zip(one.interface_names, one.values)]
    return found or None


def _leaves(prefix: str, value: Any) -> Iterable[tuple[str, float]]:
    if isinstance(value, (bool, int, float, np.integer, np.floating)):
        yield prefix, float(value)
    elif isinstance(value, np.ndarray) or (isinstance(value, list) and value and not isinstance(value[0], str)):
        if len(value) <= _ARRAYS:
            for k, one in enumerate(value):
                yield from _leaves(f"{prefix}[{k}]", one)
    elif hasattr(value, "__dataclass_fields__"):
        for key in value.__dataclass_fields__:
            if key not in ("header", "layout") and not key.startswith("__"):
                yield from _leaves(f"{prefix}/{key}", getattr(value, key))


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    rosbags = library("rosbags.highlevel", "ROS bags", _EXTRA)
    stores = library("rosbags.typesys", "ROS bags", _EXTRA)
    topics: dict[str, _Topic] = {}
    known = stores.get_typestore(stores.Stores.LATEST)
    try:
        with rosbags.AnyReader([path], default_typestore=known) as reader:
            there = sorted({connection.topic for connection in reader.connections})
            lost = [topic for topic in source.topics if topic not in there]
            if lost:
                raise InputError("no such topic", str(path), ", ".join(lost), ", ".join(there))
            if reader.message_count > MOST_VALUES // 8:
                raise InputError("a bag too large", str(path), f"{reader.message_count} messages")
            wanted = [c for c in reader.connections if not source.topics or c.topic in source.topics]
            for connection, received, raw in reader.messages(connections=wanted):
                message = reader.deserialize(raw, connection.msgtype)
                leaves = _named(connection.topic, message) or _leaves(connection.topic, message)
                topics.setdefault(connection.topic, _Topic()).add(_stamp(message), 1e-9 * received, leaves)
    except InputError:
        raise
    except Exception as error:
        raise unreadable(path, _WHAT, error) from None
    return (_joined(path, topics),)


def _joined(path: Path, topics: dict[str, _Topic]) -> Table:
    series = {name: topic.series() for name, topic in topics.items() if topic.values}
    if not series:
        raise InputError("a bag without numbers", str(path), ", ".join(topics) or "no messages", "topics with numbers")
    time_s, columns = join(list(series.values()))
    clock = {column: one.clock for one in series.values() for column in one.columns}
    findings = []
    if len(set(clock.values())) > 1:
        late = [name for name, one in series.items() if one.clock == "receive"]
        findings.append(f"mixed clocks: {', '.join(late)} by when it was received, so that delays hold transport too")
    return Table({"time_s": time_s, **columns}, "time_s", name=path.stem, findings=tuple(findings), clock=clock)


FORMAT = Format("ROS bag", _EXTRA, _knows, _read)
