"""What a package holds, with version and licence: an SPDX 2.3 document, and the texts of those licences beside it. All
of it is read off this machine: the copyright files of Debian's packages, and the metadata of MuJoCo's wheel. Nothing
is guessed: what neither says is NOASSERTION, and so is the licence of gapscope itself, which none has been stated for.

Debian's copyright file is of a source package; what it says of `debian/*` (the packaging) is left out."""

import hashlib
import json
import pathlib
import re
import subprocess
import textwrap
import uuid
import zipfile

NO = "NOASSERTION"
COMMON = pathlib.Path("/usr/share/common-licenses")
# What is compiled in from headers, or embedded (the charts of report.html).
COMPILED_IN = ["libcli11-dev", "libeigen3-dev", "libjs-dygraphs", "nlohmann-json3-dev"]
# Debian's short names that mean a licence of SPDX's list word by word. Any other becomes a LicenseRef with its text.
SPDX_NAMES = {
    "apache-2.0": "Apache-2.0", "bsd-2-clause": "BSD-2-Clause", "bsd-3-clause": "BSD-3-Clause",
    "cc0-1.0": "CC0-1.0", "expat": "MIT", "gpl-2+": "GPL-2.0-or-later", "gpl-3+": "GPL-3.0-or-later", "isc": "ISC",
    "lgpl-2.1+": "LGPL-2.1-or-later", "mit": "MIT", "mpl-2": "MPL-2.0", "mpl-2.0": "MPL-2.0", "zlib": "Zlib",
}


def identifier(text):
    return re.sub(r"[^A-Za-z0-9.-]+", "-", text).strip("-")


def stanzas(text):
    """Those of a machine-readable copyright file, each a dict of fields; none of any other file."""
    if not text.startswith("Format:"):
        return []
    found = []
    for block in re.split(r"\n\s*\n", text):
        fields, name = {}, None
        for line in block.splitlines():
            field = re.match(r"([A-Za-z][A-Za-z-]*):\s*(.*)", line)
            if field:
                name = field[1]
                fields[name] = field[2]
            elif name:
                fields[name] += "\n" + line.strip()
        found.append(fields)
    return found


def licence_of(copyright_text, package):
    """(SPDX expression, {LicenseRef: text}) of a copyright file."""
    texts, named = {}, []
    for fields in stanzas(copyright_text):
        name, _, text = fields.get("License", "").partition("\n")
        if text:
            texts.setdefault(name, text)
        if name and "Files" in fields and not fields["Files"].strip().startswith("debian/"):
            named.append(name)
    references = {}

    def one(name):
        known = SPDX_NAMES.get(name.lower())
        if known:
            return known
        reference = f"LicenseRef-{identifier(package)}-{identifier(name)}"
        references[reference] = texts.get(name) or f"'{name}', as {package}'s copyright file names it"
        return reference

    def expression(name):
        either = [one(part.strip()) for part in re.split(r"\s+or\s+", name)]
        return either[0] if len(either) == 1 else f"({' OR '.join(either)})"

    both = list(dict.fromkeys(expression(part.strip()) for name in named for part in re.split(r",?\s+and\s+", name)))
    return " AND ".join(both) or NO, references


def debian(package):
    """What dpkg knows of an installed package."""
    fields = subprocess.run(
        ["dpkg-query", "-W", "-f", "${Version}\n${source:Package}\n${source:Version}\n${Homepage}\n", package],
        check=True, capture_output=True, text=True).stdout.split("\n")
    file = pathlib.Path("/usr/share/doc") / package / "copyright"
    text = file.read_text(encoding="utf-8")
    licence, references = licence_of(text, package)
    homepage = fields[3] or NO
    return {
        "entry": {
            "name": package, "SPDXID": f"SPDXRef-{identifier(package)}", "versionInfo": fields[0],
            "supplier": "Organization: Debian", "downloadLocation": NO, "filesAnalyzed": False,
            **({"homepage": homepage} if homepage != NO else {}),
            "sourceInfo": f"Debian source package {fields[1]} {fields[2]}",
            "licenseConcluded": NO, "licenseDeclared": licence, "copyrightText": NO,
            "licenseComments": f"texts: licenses/{package}; read from {file}",
            "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                              "referenceLocator": f"pkg:deb/debian/{package}@{fields[0]}"}]},
        "references": references, "texts": {f"{package}/copyright": text}}


def mujoco(wheel):
    """What a wheel says of itself, and the parts that it names, which have no version there."""
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
        metadata = archive.read(next(n for n in names if n.endswith(".dist-info/METADATA"))).decode()
        texts = {"mujoco/" + n.rsplit("/", 1)[1]: archive.read(n).decode()
                 for n in names if "/licenses/" in n and not n.endswith("/")}
    field = lambda key: next(iter(re.findall(rf"^{key}: (.*)$", metadata, re.M)), NO)
    entry = {
        "name": "mujoco", "SPDXID": "SPDXRef-mujoco", "versionInfo": field("Version"),
        "supplier": NO, "downloadLocation": NO, "filesAnalyzed": False,
        "packageFileName": wheel.name,
        "checksums": [{"algorithm": "SHA256", "checksumValue": hashlib.sha256(wheel.read_bytes()).hexdigest()}],
        "licenseConcluded": NO, "licenseDeclared": field("License-Expression"), "copyrightText": NO,
        "licenseComments": "texts: licenses/mujoco; libmujoco.so and headers of the wheel",
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
                          "referenceLocator": f"pkg:pypi/{field('Name')}@{field('Version')}"}]}
    parts, fenced = [], False
    for line in texts.get("mujoco/LICENSES_THIRD_PARTY.md", "").splitlines():
        fenced ^= line.startswith("```")
        if line.startswith("### ") and not fenced:
            name = line[4:].strip()
            parts.append({"name": name, "SPDXID": f"SPDXRef-mujoco-{identifier(name)}", "downloadLocation": NO,
                          "filesAnalyzed": False, "licenseConcluded": NO, "licenseDeclared": NO, "copyrightText": NO,
                          "licenseComments": "text: licenses/mujoco/LICENSES_THIRD_PARTY.md"})
    return {"entry": entry, "references": {}, "texts": texts, "parts": parts}


def built_from(build, source):
    """What every package of that build of that source holds: the wheel of MuJoCo, and what is compiled in."""
    cache = re.search(r"^GAPSCOPE_CACHE_DIR:PATH=(.*)$", (build / "CMakeCache.txt").read_text(), re.M)[1]
    version = re.search(r"set\(GAPSCOPE_MUJOCO_VERSION (\S+)\)", (source / "cmake/mujoco.cmake").read_text())[1]
    wheel = next(pathlib.Path(cache).glob(f"mujoco_core-{version}-cp311-*.whl"))
    return [mujoco(wheel)] + [debian(package) for package in COMPILED_IN]


def document(name, version, commit, made_at, kind, contained, needed, made_by="package"):
    """The SPDX document of a package: what it contains, and what it needs of the system."""
    own = {"name": name, "SPDXID": "SPDXRef-gapscope", "versionInfo": version, "supplier": NO,
           "downloadLocation": NO, "filesAnalyzed": False, "sourceInfo": f"commit {commit}",
           "licenseConcluded": NO, "licenseDeclared": NO, "copyrightText": NO,
           "licenseComments": "no licence has been stated yet"}
    packages, relations, references = [own], [], {}
    relate = lambda a, kind_of, b, **more: relations.append(
        {"spdxElementId": a, "relationshipType": kind_of, "relatedSpdxElement": b, **more})
    relate("SPDXRef-DOCUMENT", "DESCRIBES", own["SPDXID"])
    for relation, group in (("CONTAINS", contained), ("DEPENDS_ON", needed)):
        for one in group:
            packages.append(one["entry"])
            relate(own["SPDXID"], relation, one["entry"]["SPDXID"])
            references |= one["references"]
            for part in one.get("parts", []):
                packages.append(part)
                relate(one["entry"]["SPDXID"], "OTHER", part["SPDXID"],
                       comment="its wheel names this; in which of its binaries it is, it does not say")
    return json.dumps({
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"{name}-{kind}",
        "documentNamespace": uuid.uuid5(uuid.NAMESPACE_OID, f"{name} {version} {commit} {kind}").urn,
        "creationInfo": {"created": made_at, "creators": [f"Tool: scripts/{made_by}"]},
        "packages": packages, "relationships": relations,
        **({"hasExtractedLicensingInfos": [{"licenseId": key, "extractedText": references[key]}
                                           for key in sorted(references)]} if references else {}),
    }, indent=1, ensure_ascii=False) + "\n"


def licence_texts(contained):
    """{path below licenses/: text} of all that is contained, and the common texts that those refer to."""
    texts = {path: text for one in contained for path, text in one["texts"].items()}
    wanted = {name for text in texts.values() for name in re.findall(rf"{COMMON}/([A-Za-z]+(?:-\d+(?:\.\d+)?)?)", text)}
    for name in sorted(wanted):
        if (COMMON / name).is_file():
            texts[f"common/{name}"] = (COMMON / name).read_text(encoding="utf-8")
    return texts


def copyright_file(version, contained):
    """share/doc/gapscope/copyright: what Debian wants a package to say of its licences."""
    lines = [f"gapscope {version}: no licence has been stated yet. Ask the maintainers before you pass it on.", "",
             "It holds, each under its own licence (sbom.spdx.json; the texts are in licenses/):", ""]
    for one in contained:
        entry = one["entry"]
        lines.append(f"- {entry['name']} {entry['versionInfo']}: {entry['licenseDeclared']}")
        named = ", ".join(part["name"] for part in one.get("parts", []))
        lines += textwrap.wrap(f"its wheel names as parts: {named}", 100, initial_indent="  ",
                               subsequent_indent="  ") if named else []
    return "\n".join(lines) + "\n"
