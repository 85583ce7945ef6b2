"""Puts into a wheel what it holds (an SPDX document, PEP 770) and the licences' texts beside it.

    wheel_sbom.py WHEEL COMMIT COMMIT_TIME      of a wheel that auditwheel has repaired, made from build/

Which packages its libraries came from auditwheel has said already, in a document of its own."""

import base64
import csv
import hashlib
import io
import json
import os
import pathlib
import sys
import zipfile

sys.dont_write_bytecode = True
import sbom  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def grafted(document):
    """The Debian packages of the libraries that auditwheel has put in."""
    components = json.loads(document)["components"]
    return [sbom.debian(one["name"]) for one in components if one["purl"].startswith("pkg:deb/debian/")]


def record_of(path, data):
    """Its line in RECORD."""
    digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
    return [path, f"sha256={digest}", str(len(data))]


def main(wheel, commit, made_at):
    with zipfile.ZipFile(wheel) as old:
        record = next(name for name in old.namelist() if name.endswith(".dist-info/RECORD"))
        info = record.removesuffix("/RECORD")
        version = info.removeprefix("gapscope-").removesuffix(".dist-info")
        contained = sbom.built_from(ROOT / "build", ROOT) + grafted(old.read(f"{info}/sboms/auditwheel.cdx.json"))
        added = {f"{info}/licenses/{path}": text for path, text in sbom.licence_texts(contained).items()}
        added[f"{info}/sboms/gapscope.spdx.json"] = sbom.document("gapscope", version, commit, made_at, "wheel",
                                                                  contained, [])
        added = {path: text.encode() for path, text in added.items()}
        lines = list(csv.reader(io.StringIO(old.read(record).decode())))
        lines[-1:-1] = [record_of(path, data) for path, data in added.items()]
        listing = io.StringIO()
        csv.writer(listing, lineterminator="\n").writerows(lines)
        part = wheel.with_suffix(".part")
        with zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as new:
            for entry in old.infolist():
                if entry.filename != record:
                    new.writestr(entry, old.read(entry), compress_type=zipfile.ZIP_DEFLATED)
            for path, data in [*added.items(), (record, listing.getvalue().encode())]:
                entry = zipfile.ZipInfo(path, old.getinfo(record).date_time)
                entry.external_attr = 0o644 << 16
                new.writestr(entry, data, compress_type=zipfile.ZIP_DEFLATED)
    os.replace(part, wheel)


main(pathlib.Path(sys.argv[1]), *sys.argv[2:])
