"""The experiment: a file, or the same keys as a mapping."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gapscope import _spec
from gapscope._errors import InputError, import_needed


_SI = {"1", "rad", "m", "s", "N", "V", "A", "kg", "W", "Hz", "degC"}


def _same_unit(stated: str, taken: Any) -> bool:
    """Whether a unit is the one that the experiment takes; of none any of SI's."""
    if taken is None:
        return set(re.findall("[A-Za-z]+", stated)) <= _SI
    return "".join(stated.split()) == "".join(str(taken).split())


class Experiment:
    """What binds a log to a model: the experiment file (docs/reference/experiment.md), or a mapping with the same keys.

    ``base`` is the folder that the mapping's ``model`` is relative to; without it the working folder. ``model`` may be
    an MjSpec of the mujoco that is installed, as it is now: its assets in memory go along, its files stay where they
    are.
    """

    def __init__(
        self, source: str | os.PathLike[str] | Mapping[str, Any], *, base: str | os.PathLike[str] | None = None
    ) -> None:
        self.path: Path | None = None
        self._keys: dict[str, Any] = {}
        self._mjcf: _spec.Written | None = None  # of an MjSpec
        if isinstance(source, Mapping):
            self._keys = dict(source)
            model = self._keys.get("model")
            if model is None:
                raise InputError("an experiment without a model", "Experiment", cure="model: a path or an MjSpec")
            if isinstance(model, (str, os.PathLike)):
                self._keys["model"] = str((Path(base or ".") / model).resolve())
            elif hasattr(model, "to_xml"):
                self._mjcf, self._keys["model"] = _spec.written(model), "experiment_model.xml"
            return
        if base is not None:
            raise InputError("a file says itself where its model is", "base", str(base), "base for a mapping")
        self.path = Path(source)
        if not self.path.is_file():
            raise InputError("no such experiment file", str(self.path), cure="gapscope init MODEL.xml LOG drafts one")

    def file(self, folder: Path) -> Path:
        """Its file; of a mapping one that is written into ``folder``, as JSON, which YAML contains."""
        if self.path is not None:
            return self.path
        if self._mjcf is not None:
            self._mjcf.write(folder / self._keys["model"])
        target = folder / "experiment.yaml"
        try:
            target.write_text(json.dumps(self._keys, indent=1, allow_nan=False) + "\n", encoding="utf-8")
        except (TypeError, ValueError) as failure:
            raise InputError(
                "an experiment that cannot be written",
                "Experiment",
                str(failure),
                "mappings, lists, texts, finite numbers",
                "numpy numbers: float(x), x.tolist()",
            ) from failure
        return target

    def anywhere(self) -> Experiment:
        """The same in any working folder."""
        return self if self.path is None else Experiment(self.path.absolute())

    def log_source(self) -> dict[str, Any]:
        """What ``log: {source: {...}}`` says, as it stands; empty where it says nothing.

        Of a file: needs a YAML library where the file has a ``source`` (ruamel.yaml, which rosbags brings).
        """
        if self.path is not None and "source:" not in self.path.read_text(encoding="utf-8"):
            return {}
        log = self._read("'source'").get("log")
        source = log.get("source") if isinstance(log, Mapping) else None
        if source is not None and not isinstance(source, Mapping):
            raise InputError("'source' is no mapping", repr(self), repr(source)[:80], "log: {source: {topics: [...]}}")
        return dict(source or {})

    def check_units(self, log: str, stated: Mapping[str, str]) -> None:
        """Raises InputError where a log's columns are not in the units that the experiment takes them in.

        A column with a ``scale`` is the experiment's own affair. Of a file: needs a YAML library (ruamel.yaml).
        """
        keys = self._read("units") if stated else {}
        items = [item for part in ("commands", "measured") for item in keys.get(part) or ()]
        for item in filter(lambda one: isinstance(one, Mapping), items):
            named = item.get("column", item.get("columns_of_elements"))
            for column in named if isinstance(named, (list, tuple)) else [named]:
                unit = stated.get(str(column), "")
                if unit and "scale" not in item and not _same_unit(unit, item.get("unit")):
                    raise InputError(
                        "a column in another unit than the experiment takes it in",
                        f"{log}, column {column!r}",
                        repr(unit),
                        str(item.get("unit", "SI, as the experiment states no unit")),
                        f"unit: {unit} for this column in the experiment, or convert the values",
                    )

    def _read(self, what: str) -> Mapping[str, Any]:
        """All keys; of a file ``what`` they are read for is named where no library reads it."""
        if self.path is None:
            return self._keys
        install = "ruamel.yaml"
        yaml = import_needed("ruamel.yaml", f"no library that reads the {what} of the experiment {self.path}", install)
        try:
            keys = yaml.YAML(typ="safe", pure=True).load(self.path.read_text(encoding="utf-8"))
        except Exception as error:
            raise InputError("not a readable experiment file", str(self.path), str(error)[:200]) from None
        return keys if isinstance(keys, Mapping) else {}

    def __repr__(self) -> str:
        return f"Experiment({str(self.path) if self.path else self._keys['model']!r})"
