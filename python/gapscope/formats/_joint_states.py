"""A table as an MCAP file of sensor_msgs/JointState, for viewers: what the reader of bags reads as the same table."""

from __future__ import annotations

import os
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gapscope._errors import InputError
from gapscope.formats._table import Floats, Table, library

_KINDS = ("position", "velocity", "effort")
_COLUMN = re.compile(r"(/.*?joint_states)/(.+)/(position|velocity|effort)")  # a joint's name may hold slashes
_STATE = "sensor_msgs/msg/JointState"
_RATHER = "/WHOSE/joint_states/JOINT/position, velocity or effort"


def write(table: Table, path: Path) -> None:
    """Writes columns /WHOSE/joint_states/JOINT/position, velocity and effort, whole or not at all.

    Rows without a value of a topic are no message of it. Raises InputError: `rosbags` is not installed, no such column,
    a row without a time or before zero.
    """
    rosbag2 = library("rosbags.rosbag2", "and writes ROS bags", "ros")
    typesys = library("rosbags.typesys", "and writes ROS bags", "ros")
    store = typesys.get_typestore(typesys.Stores.ROS2_HUMBLE)
    topics = _topics(table, path)
    stamps = np.round(table.columns[table.time] * 1e9)
    if not (np.isfinite(stamps).all() and (stamps >= 0).all()):
        raise InputError("a row without a time, or before zero", f"{path}, {table.time}", cure="stamps from 0 s on")
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".gapscope_") as folder:
        bag = Path(folder) / "bag"
        with rosbag2.Writer(bag, version=9, storage_plugin=rosbag2.StoragePlugin.MCAP) as writer:
            sent = [
                (writer.add_connection(topic, _STATE, typestore=store), _messages(joints, stamps, store))
                for topic, joints in topics.items()
            ]
            for stamp in stamps.astype(np.int64).tolist():
                for connection, messages in sent:
                    if message := next(messages):
                        writer.write(connection, stamp, store.serialize_cdr(message, _STATE))
        os.replace(bag / "bag.mcap", path)


def _topics(table: Table, path: Path) -> dict[str, dict[str, dict[str, Floats]]]:
    """The columns of each topic, joint and kind."""
    topics: dict[str, dict[str, dict[str, Floats]]] = {}
    for name, values in table.columns.items():
        if found := _COLUMN.fullmatch(name):
            topics.setdefault(found[1], {}).setdefault(found[2], {})[found[3]] = values
    if not topics:
        raise InputError("no column is a joint's state", str(path), ", ".join(table.columns), _RATHER)
    return topics


def _messages(joints: dict[str, dict[str, Floats]], stamps: Floats, store: Any) -> Iterator[Any]:
    """A message for each row; None of a row without a value. A kind that no joint has is an empty list."""
    make = {name.rsplit("/", 1)[-1]: kind for name, kind in store.types.items()}
    missing = np.full(len(stamps), np.nan)
    lists = {
        kind: np.stack([one.get(kind, missing) for one in joints.values()], axis=1)
        if any(kind in one for one in joints.values())
        else np.empty((len(stamps), 0))
        for kind in _KINDS
    }
    there = np.any([np.isfinite(values).any(axis=1) for values in lists.values()], axis=0)
    for row, stamp in enumerate(stamps.astype(np.int64).tolist()):
        if not there[row]:
            yield None
            continue
        header = make["Header"](stamp=make["Time"](sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="")
        yield make["JointState"](header=header, name=list(joints), **{kind: v[row] for kind, v in lists.items()})
