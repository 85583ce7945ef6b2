"""Files of npm packages that the site is made or looked at with: pinned, and kept in the project's cache."""
import hashlib
import io
import os
import pathlib
import sys
import tarfile
import urllib.request

PACKAGES = {
    "axe-core-4.10.2": "9ea2d2d6917da998122bdacfd3b473e31ead53f4b87146c716a12edf89158100",
    "iframe-worker-1.0.4": "e8c5d12d87829c503afba01d67772ea9f4aba5b7ae57a0c98e1917711030efbb",
}


def npm_file(package, member):
    """The text of a member of a package of PACKAGES."""
    cache = pathlib.Path(os.environ.get("GAPSCOPE_CACHE_DIR", pathlib.Path.home() / ".cache/gapscope"))
    kept = cache / f"{package}.tgz"
    if not kept.exists():
        address = f"https://registry.npmjs.org/{package.rpartition('-')[0]}/-/{package}.tgz"
        data = urllib.request.urlopen(address, timeout=60).read()
        cache.mkdir(parents=True, exist_ok=True)
        part = kept.with_name(f"{package}.partial")
        part.write_bytes(data)
        part.rename(kept)
    data = kept.read_bytes()
    if hashlib.sha256(data).hexdigest() != PACKAGES[package]:
        print(f"site: {kept} is not the pinned {package}; delete it", file=sys.stderr)
        sys.exit(2)
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        return archive.extractfile(f"package/{member}").read().decode()
