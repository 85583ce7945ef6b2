"""Run by the interpreter of scripts/engine_env torch: save_pace.py IN.npz FOLDER.

Of the arrays in IN.npz, saved as PACE does: FOLDER/whole, the same log in several forms; FOLDER/hostile, files that are
damaged, lie, or name a function that would write a file `executed`.
"""

import io
import struct
import sys
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import torch

given, folder = np.load(sys.argv[1]), Path(sys.argv[2])
whole, hostile = folder / "whole", folder / "hostile"
for made in (whole, hostile):
    made.mkdir()
log: dict[str, Any] = {name: torch.from_numpy(given[name]) for name in ("time", "dof_pos", "des_dof_pos")}
log["joint_order"] = ["hip", "knee"]


class Evil:
    def __reduce__(self) -> Any:
        return (exec, ("open('executed', 'w')",))


def save(content: Any, path: Path, zipped: bool = True) -> None:
    torch.save(content, path, _use_new_zipfile_serialization=zipped)


save(log, whole / "run.pt")
save(log, whole / "before_1_6.pt", zipped=False)
# A view of every second row of a larger tensor that wants a gradient, and what is no column of numbers beside it.
doubled = {name: log[name].repeat_interleave(2, 0).requires_grad_()[::2] for name in ("time", "dof_pos", "des_dof_pos")}
more = {"robot": "anymal", "complex": torch.zeros(3, dtype=torch.complex64), "sparse": torch.eye(3).to_sparse()}
save({**log, **doubled, **more}, whole / "views.pth")

raw = (whole / "run.pt").read_bytes()
old = (whole / "before_1_6.pt").read_bytes()
for share in (0.0, 0.02, 0.2, 0.5, 0.8, 0.97):
    (hostile / f"cut_{share}.pt").write_bytes(raw[: int(share * len(raw))])
    (hostile / f"cut_old_{share}.pt").write_bytes(old[: int(share * len(old))])
save({**log, "extra": Evil()}, hostile / "evil.pt")
save({**log, "extra": Evil()}, hostile / "evil_old.pt", zipped=False)
save({**log, "extra": given["time"]}, hostile / "numpy.pt")
save([log["time"]], hostile / "list.pt")
save({"robot": "anymal"}, hostile / "nothing.pt")
save({**log, "wide": torch.zeros(1).expand(10**9)}, hostile / "wide.pt")
save({**log, **{f"x{k}": torch.zeros(1).expand(10**8) for k in range(5)}}, hostile / "sum.pt")


def rewritten(name: str, part: str, change: Any, how: int = zipfile.ZIP_STORED) -> None:
    """A copy of the log's archive in which one part's bytes are others."""
    with zipfile.ZipFile(io.BytesIO(raw)) as source, zipfile.ZipFile(hostile / name, "w", how) as target:
        parts = [one for one in source.infolist() if one.filename.endswith(part)]
        assert len(parts) == 1
        for one in source.infolist():
            data = source.read(one)
            target.writestr(one.filename, change(data) if one in parts else data)


rows = struct.pack("<BH", 0x4D, len(given["time"]))  # as data.pkl has it: of the storage and of the tensor
assert raw.count(rows) >= 2
rewritten("rows.pt", "data.pkl", lambda data: data.replace(rows, struct.pack("<Bi", 0x4A, 20_000_000)))
rewritten("short.pt", "data/0", lambda data: data[:80])
rewritten("unpacks.pt", "data/0", lambda _: bytes(1 << 28), zipfile.ZIP_DEFLATED)
unpacks = bytearray((hostile / "unpacks.pt").read_bytes())
at = unpacks.index(b"data/0", unpacks.index(b"PK\1\2"))  # in the list of parts, behind its entry's 46 bytes
struct.pack_into("<I", unpacks, unpacks.rindex(b"PK\1\2", 0, at) + 24, 0xFFFFFFF0)
(hostile / "unpacks.pt").write_bytes(unpacks)
at = old.rindex(struct.pack("<q", len(given["time"])))  # before the numbers of `time`, the last but two storages
(hostile / "rows_old.pt").write_bytes(old[:at] + struct.pack("<q", 10**12) + old[at + 8 :])
