"""ROS bags: rosbag2 (a folder, .mcap or .db3) and ROS 1 (.bag), by `rosbags`, which needs no ROS.

Names are PlotJuggler's: /joint_states/arm/position, /imu/angular_velocity/x. Stamps are the message's own where every
message of the topic has any, else when it was received.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from gapscope._errors import InputError
from gapscope.formats._messages import Topics, check_topics
from gapscope.formats._table import MOST_VALUES, Format, Source, Table, library

_EXTRA = "ros"


def _knows(path: Path) -> bool:
    return path.suffix.lower() in (".bag", ".mcap", ".db3") or (path.is_dir() and (path / "metadata.yaml").is_file())


def _definitions(folder: Path) -> dict[str, Any]:
    """Of FOLDER/PACKAGE/msg/NAME.msg, at any depth, and FOLDER/PACKAGE/NAME.msg."""
    typesys = library("rosbags.typesys", "ROS bags", _EXTRA)
    found: dict[str, Any] = {}
    for file in sorted(folder.rglob("*.msg")):
        package = file.parent.parent if file.parent.name == "msg" else file.parent
        found.update(typesys.get_types_from_msg(file.read_text(encoding="utf-8"), f"{package.name}/msg/{file.stem}"))
    if not found:
        raise InputError("a folder without .msg files", str(folder), allowed="PACKAGE/msg/NAME.msg", cure="source.msgs")
    return found


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    highlevel = library("rosbags.highlevel", "ROS bags", _EXTRA)
    typesys = library("rosbags.typesys", "ROS bags", _EXTRA)
    known = typesys.get_typestore(typesys.Stores.LATEST)
    if source.msgs:
        known.register(_definitions(Path(source.msgs)))
    topics = Topics(path)
    with highlevel.AnyReader([path], default_typestore=known) as reader:
        check_topics(path, (connection.topic for connection in reader.connections), source.topics)
        if reader.message_count > MOST_VALUES // 8:
            raise InputError("a bag too large", str(path), f"{reader.message_count} messages")
        wanted = [c for c in reader.connections if not source.topics or c.topic in source.topics]
        unknown = sorted({c.msgtype for c in wanted if c.msgtype not in reader.typestore.fielddefs})
        if unknown:
            raise InputError(
                "messages whose definition is not in the bag",
                str(path),
                ", ".join(unknown),
                cure="log: {source: {msgs: FOLDER}} with their .msg files, or topics: [...] without them",
            )
        for connection, received, raw in reader.messages(connections=wanted):
            topics.add(connection.topic, received, reader.deserialize(raw, connection.msgtype))
    return (topics.table(source.topics),)


FORMAT = Format("ROS bag", _EXTRA, _knows, _read, slow=("rosbags",))
