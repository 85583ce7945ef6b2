"""The documents as a site that opens from disk, its search too: scripts/site runs this. Exit status 2: something that
is needed is not there."""
import argparse
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

import yaml
from fetched import npm_file

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGES = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "docs", "course", "models"]


def fail(what):
    print(f"site: {what}", file=sys.stderr)
    sys.exit(2)


def files_of_tree():
    """Those that git tracks or would."""
    listed = subprocess.run(["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                            capture_output=True, text=True, check=True).stdout
    return {name for name in listed.split("\0") if name and (ROOT / name).exists()}


def with_links(text, page, files, wanted):
    """The page's text, links to what the site has not taken off; `wanted` gets the other files that it leads to."""
    def target(link):
        if re.match(r"[a-z]+:|#", link):
            return link
        path, mark, anchor = urllib.parse.unquote(link).partition("#")
        there = os.path.normpath(os.path.join(os.path.dirname(page), path))
        if f"{there}/README.md" in files and is_page(f"{there}/README.md"):
            return f"{path.rstrip('/')}/README.md{mark}{anchor}"
        if there not in files or (there.endswith(".md") and not is_page(there)):
            return None
        if not there.endswith(".md"):
            wanted.add(there)
        return link

    def replace(match):
        to = target(match[2])
        return match[1].lstrip("!") if to is None else f"{match[0][:match[0].rindex('(')]}({to})"
    text = re.sub(r"(?<!!)\[((?:[^\[\]]|!\[[^\]]*\]\([^)]*\))*)\]\(([^)\s]+)\)", replace, text)
    # Pictures stay where they were seen from their pages.
    for match in re.finditer(r"!\[[^\]]*\]\(([^)\s]+)\)|<img[^>]*\ssrc=\"([^\"]+)\"", text):
        target(match[1] or match[2])
    return text


def is_page(name):
    return name.endswith(".md") and any(name == part or name.startswith(part + "/") for part in PAGES)


def stage(pages):
    files, wanted = files_of_tree(), set()
    for name in sorted(filter(is_page, files)):
        (pages / name).parent.mkdir(parents=True, exist_ok=True)
        (pages / name).write_text(with_links((ROOT / name).read_text(), name, files, wanted))
    for name in sorted(wanted):
        (pages / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, pages / name)


def nav(entries, pages):
    """mkdocs' nav, folders written out."""
    def below(folder):
        names = sorted(str(p.relative_to(pages)) for p in (pages / folder).rglob("*.md"))
        return sorted(names, key=lambda name: not name.endswith(f"{folder}/README.md"))
    written = []
    for entry in entries:
        title, at = next(iter(entry.items())) if isinstance(entry, dict) else ("", entry)
        written.append({title: below(at)} if (pages / at).is_dir() else entry)
    return written


def truth_of(label):
    """In words, the effects of a twin's label."""
    def words(effect):
        sizes = ", ".join(f"{key} {value:.3g}" for key, value in effect["parameters"].items())
        return f"`{effect['name']}@{effect['on']}` ({sizes})"
    return "; ".join(words(effect) for effect in label["effects"]) or "nothing"


def logs_of(entry):
    """Of the repository or of hardware; none, where the data are not there, or a twin makes them."""
    data = ROOT.parent / "shared/data"
    return entry.get("logs") or sorted(log for pattern in entry.get("data", []) for log in data.glob(pattern))


def make_entry(name, entry, folder):
    """Report, video and verdict of one rig, whole or not at all."""
    program = ROOT / "build/bin"
    if not (program / "gapscope").exists():
        fail(f"{program / 'gapscope'} is not there; --gallery runs it; build it with scripts/demo")
    with tempfile.TemporaryDirectory(dir=folder.parent) as temporary:
        made, logs = pathlib.Path(temporary) / name, logs_of(entry)
        made.mkdir()
        truth = entry.get("truth") or entry.get("source")
        if "twin" in entry:
            label = made / "label.json"
            subprocess.run([program / "gapscope_twin", *entry["twin"], "--out", made / "logs", "--label", label],
                           check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
            logs, truth = sorted((made / "logs").glob("log_*.csv")), truth_of(json.loads(label.read_text()))
        options = entry.get("options", [])
        subprocess.run([program / "gapscope", "diagnose", entry["model"], *logs, *options, "--out", made / "found",
                        "--quiet"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
        subprocess.run([program / "gapscope", "render", entry["model"], logs[0], *options, "--compare", "nominal",
                        "--compare", f"diagnosed={made / 'found'}", "--size", "960x540", "--from", "0", "--to", "8",
                        "--quiet", "--out", made / "video.mp4"], check=True, cwd=ROOT, stdout=subprocess.DEVNULL)
        (made / "truth").write_text(truth)
        shutil.rmtree(made / "logs", ignore_errors=True)
        made.rename(folder)


def gallery(pages, make):
    """The page of the gallery, of what there is. `make`: names to make, empty: all, none: nothing."""
    rows = ["# Gallery", "", "What the program made of logs of twins, whose cause is known and whose equations are not "
            "the program's, and of logs of real hardware.", ""]
    kept = ROOT / "out/gallery"
    kept.mkdir(parents=True, exist_ok=True)
    entries = yaml.safe_load((ROOT / "site/gallery.yaml").read_text())
    for name in make or []:
        if name not in entries:
            fail(f"--gallery {name}: no such entry of site/gallery.yaml, which has {', '.join(entries)}")
    for name, entry in entries.items():
        if make is not None and (name in make or not make) and not (kept / name).exists():
            if "twin" in entry or logs_of(entry):
                print(f"site: diagnosing {name}", file=sys.stderr)
                make_entry(name, entry, kept / name)
            else:
                print(f"site: {name} is left out, its logs are not there: {', '.join(entry['data'])}", file=sys.stderr)
        if not (kept / name).exists():
            continue
        found = json.loads((kept / name / "found/result.json").read_text())
        (pages / "gallery").mkdir(exist_ok=True)
        shutil.copyfile(kept / name / "found/report.html", pages / "gallery" / f"{name}.html")
        shutil.copyfile(kept / name / "video.mp4", pages / "gallery" / f"{name}.mp4")
        told = [f"`{s['name']}@{s['on']}`, P {s['probability']:.2f}" for s in found["statements"]
                if s["answer"] == "present"]
        rows += [f"## {entry['title']}", "", f'<video controls muted loop preload="metadata" width="640" '
                 f'src="gallery/{name}.mp4" aria-label="{entry["title"]}: nominal and diagnosed model"></video>', "",
                 f"| {'logs of' if 'data' in entry else 'made with'} | {(kept / name / 'truth').read_text()} |",
                 "|---|---|",
                 f"| found | {'; '.join(told) or 'nothing'}; verdict `{found['verdict']}` |",
                 f"| gap closed on held-out data | {100 * found['gap']['closed']:.0f} % |", "",
                 f"[The report](gallery/{name}.html), as the program writes it.", ""]
    if len(rows) == 4:
        rows.append("`scripts/site --gallery` makes it.")
    (pages / "gallery.md").write_text("\n".join(rows) + "\n")


def take_shim_in(site):
    """The search of a page from disk needs a script that the theme's pages fetch: they take it from beside them."""
    (site / "iframe-worker.js").write_text(npm_file("iframe-worker-1.0.4", "shim/index.js"))
    for page in site.rglob("*.html"):
        text = page.read_text()
        here = "../" * (len(page.relative_to(site).parts) - 1) + "iframe-worker.js"
        page.write_text(text.replace("https://unpkg.com/iframe-worker/shim", here))


def build(options):
    with tempfile.TemporaryDirectory() as temporary:
        work = pathlib.Path(temporary)
        pages = work / "pages"
        stage(pages)
        gallery(pages, options.gallery)
        for name in ("site.css", "site.js"):
            shutil.copyfile(ROOT / "site" / name, pages / name)
        head, order = (ROOT / "site/mkdocs.yml").read_text().split("\nnav:", 1)
        entries = yaml.safe_load("nav:" + order)["nav"]
        (work / "mkdocs.yml").write_text(head + "\n" + yaml.safe_dump({"nav": nav(entries, pages)}))
        subprocess.run([sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet"], check=True, cwd=work,
                       env={**os.environ, "NO_MKDOCS_2_WARNING": "1", "DISABLE_MKDOCS_2_WARNING": "true"})
        take_shim_in(work / "site")
        options.out.parent.mkdir(parents=True, exist_ok=True)
        part = options.out.with_name(options.out.name + ".partial")
        shutil.rmtree(part, ignore_errors=True)
        shutil.copytree(work / "site", part)
        shutil.rmtree(options.out, ignore_errors=True)
        part.rename(options.out)
    print(options.out / "index.html")


def main():
    parser = argparse.ArgumentParser(prog="scripts/site", description="The documents as a site that opens from disk.")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/site", help="default: out/site")
    parser.add_argument("--gallery", nargs="*", metavar="NAME", help="diagnoses and renders the logs of "
                        "site/gallery.yaml, or those of some names there, with the program in build/ (some minutes "
                        "each; what is in out/gallery is not made again)")
    parser.add_argument("--look", action="store_true", help="opens pages in Chromium at 1440 and 390 pixels, light and "
                        "dark, keeps pictures in OUT.look and fails where axe finds a serious fault, a page is wider "
                        "than the window, or the keyboard cannot reach a link")
    options = parser.parse_args()
    if options.out.exists() and not (options.out / "search").exists():
        fail(f"{options.out} is there and is no site; it would be replaced; give another folder")
    build(options)
    if options.look:
        sys.exit(subprocess.run(["/usr/bin/python3", ROOT / "site/look.py", options.out]).returncode)


if __name__ == "__main__":
    main()
