"""What scripts/packaging/sbom.py reads off a copyright file, and that a document's parts refer to each other."""

import json
import pathlib
import re
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent.parent / "scripts/packaging"))
sys.dont_write_bytecode = True
import sbom  # noqa: E402

COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Source: https://example.com

Files: *
Copyright: 2001 Somebody
License: Expat
 Its text.

Files: slow/*
License: LGPL-2.1+ or MPL-2

Files: odd.c
License: Beerware
 A beer is due.
 .
 /usr/share/common-licenses/GPL-2 says more.

Files: debian/*
License: GPL-3+
"""


def part(name, licence, references):
    return {"entry": {"name": name, "SPDXID": f"SPDXRef-{name}", "versionInfo": "1", "licenseDeclared": licence},
            "references": references, "texts": {f"{name}/copyright": COPYRIGHT}}


class Licences(unittest.TestCase):
    def test_of_a_copyright_file(self):
        licence, references = sbom.licence_of(COPYRIGHT, "libodd1")
        self.assertEqual(licence, "MIT AND (LGPL-2.1-or-later OR MPL-2.0) AND LicenseRef-libodd1-Beerware")
        self.assertEqual(list(references), ["LicenseRef-libodd1-Beerware"])
        self.assertIn("A beer is due.", references["LicenseRef-libodd1-Beerware"])

    def test_nothing_is_guessed(self):
        self.assertEqual(sbom.licence_of("dygraphs is MIT-licenced:\n", "libjs-dygraphs"), ("NOASSERTION", {}))

    def test_texts_that_are_referred_to_are_there(self):
        texts = sbom.licence_texts([part("odd", "MIT", {})])
        self.assertEqual(sorted(texts), ["common/GPL-2", "odd/copyright"])


class Document(unittest.TestCase):
    def test_its_parts_refer_to_each_other(self):
        licence, references = sbom.licence_of(COPYRIGHT, "odd")
        odd, libc = part("odd", licence, references), part("libc6", "NOASSERTION", {})
        read = json.loads(sbom.document("gapscope", "1.2.3", "abc", "2026-01-01T00:00:00Z", "deb", [odd], [libc]))
        known = {"SPDXRef-DOCUMENT"} | {package["SPDXID"] for package in read["packages"]}
        for relation in read["relationships"]:
            self.assertLessEqual({relation["spdxElementId"], relation["relatedSpdxElement"]}, known)
        kinds = {one["relatedSpdxElement"]: one["relationshipType"] for one in read["relationships"]}
        self.assertEqual(kinds, {"SPDXRef-gapscope": "DESCRIBES", "SPDXRef-odd": "CONTAINS",
                                 "SPDXRef-libc6": "DEPENDS_ON"})
        self.assertEqual(set(re.findall(r"LicenseRef-[\w.-]+", licence)),
                         {info["licenseId"] for info in read["hasExtractedLicensingInfos"]})
        own = next(package for package in read["packages"] if package["name"] == "gapscope")
        self.assertEqual((own["licenseDeclared"], own["versionInfo"]), ("NOASSERTION", "1.2.3"))


if __name__ == "__main__":
    unittest.main()
