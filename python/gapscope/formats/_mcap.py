"""MCAP whose messages are JSON or protobuf, as Foxglove's tools write it; those of ROS go to the reader of bags."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

from gapscope._errors import InputError
from gapscope.formats import _ros
from gapscope.formats._messages import Topics, check_topics
from gapscope.formats._table import Format, Source, Table, library

_EXTRA = "mcap"
_MAGIC = b"\x89MCAP0\r\n"


def _profile(path: Path) -> str | None:
    """What the header says the file is written for: "ros2", "ros1" or anything; None: it is no MCAP."""
    with path.open("rb") as file:
        head = file.read(len(_MAGIC) + 13 + 16)
    if not head.startswith(_MAGIC) or len(head) < len(_MAGIC) + 13 or head[len(_MAGIC)] != 1:
        return None
    (length,) = struct.unpack_from("<I", head, len(_MAGIC) + 9)
    return head[len(_MAGIC) + 13 :][:length].decode("utf-8", "replace")


def _knows(path: Path) -> bool:
    return path.suffix.lower() == ".mcap" and path.is_file() and _profile(path) not in ("ros1", "ros2")


class _Decoders:
    """How messages are decoded, by their schema."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._protobuf: Any = None
        self._known: dict[int, Callable[[bytes], Any]] = {}

    def decode(self, schema: Any, channel: Any, data: bytes) -> Any:
        if channel.message_encoding == "json":
            return json.loads(data)
        if channel.message_encoding != "protobuf":
            raise InputError(
                "messages of an encoding that is not read",
                f"{self._path}, {channel.topic}",
                repr(channel.message_encoding),
                "json, protobuf, cdr and ros1 alone",
                "log: {source: {topics: [...]}} without them",
            )
        if schema.id not in self._known:
            if self._protobuf is None:
                module = library("mcap_protobuf.decoder", "MCAP files with protobuf", _EXTRA)
                self._protobuf = module.DecoderFactory()
            self._known[schema.id] = self._protobuf.decoder_for("protobuf", schema)
        return self._known[schema.id](data)


def _read(path: Path, source: Source) -> tuple[Table, ...]:
    mcap = library("mcap.reader", "MCAP files", _EXTRA)
    topics, decoders = Topics(path), _Decoders(path)
    with path.open("rb") as file:
        reader = mcap.make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        channels = list(summary.channels.values()) if summary else []
        if channels and {channel.message_encoding for channel in channels} <= {"cdr", "ros1"}:
            return _ros.FORMAT.read(path, source)
        check_topics(path, (channel.topic for channel in channels), source.topics)
        for schema, channel, message in reader.iter_messages(topics=list(source.topics) or None):
            topics.add(channel.topic, message.log_time, decoders.decode(schema, channel, message.data))
    return (topics.table(source.topics),)


FORMAT = Format(
    "MCAP file",
    _EXTRA,
    _knows,
    _read,
    cure="mcap recover FILE, if it was cut",
    slow=("mcap", "mcap-protobuf-support", "rosbags"),
)
