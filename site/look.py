#!/usr/bin/env python3
"""site/look.py SITE: scripts/site --look. Opens pages from disk in Chromium at two widths, light and dark; keeps
pictures in SITE.look; prints what is wrong, exit status 1 then."""
import base64
import hashlib
import io
import os
import pathlib
import shutil
import sys
import tarfile
import tempfile
import time
import urllib.request

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys

AXE = "https://registry.npmjs.org/axe-core/-/axe-core-4.10.2.tgz"
AXE_SHA256 = "9ea2d2d6917da998122bdacfd3b473e31ead53f4b87146c716a12edf89158100"
PAGES = ["index.html", "gallery.html", "docs/index.html", "docs/tutorials/first-diagnosis.html",
         "docs/reference/options.html", "docs/results/diagnosis.html", "models/index.html"]
WIDTHS, SCHEMES = (1440, 390), ("light", "dark")
RUN_AXE = """
const done = arguments[arguments.length - 1];
axe.run({resultTypes: ["violations"]}).then((result) => done(result.violations.map((v) => ({
  id: v.id, impact: v.impact, at: v.nodes.slice(0, 3).map((n) => n.target.join(" ") + ": " + n.failureSummary)}))));
"""


def axe():
    """The checker's source, from the cache."""
    cache = pathlib.Path(os.environ.get("GAPSCOPE_CACHE_DIR", pathlib.Path.home() / ".cache/gapscope"))
    kept = cache / AXE.rsplit("/", 1)[1]
    if not kept.exists():
        data = urllib.request.urlopen(AXE, timeout=60).read()
        cache.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(".partial")
        part.write_bytes(data)
        part.rename(kept)
    data = kept.read_bytes()
    if hashlib.sha256(data).hexdigest() != AXE_SHA256:
        print(f"look: {kept} is not {AXE}; delete it", file=sys.stderr)
        sys.exit(2)
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        return archive.extractfile("package/axe.min.js").read().decode()


def browser(profile):
    options = Options()
    for flag in ("--headless=new", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files",
                 f"--user-data-dir={profile}"):
        options.add_argument(flag)
    return webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))


def set_look(driver, width, scheme):
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600})
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia",
                           {"features": [{"name": "prefers-color-scheme", "value": scheme}]})


def faults(driver, checker, scheme):
    found = []
    shown = driver.execute_script("return document.body.getAttribute('data-md-color-scheme')")
    if shown != {"light": "default", "dark": "slate"}[scheme]:
        found.append(f"shown as {shown}")
    wide = driver.execute_script("return document.documentElement.scrollWidth - window.innerWidth")
    if wide > 0:
        found.append(f"{wide} pixels wider than the window")
    driver.execute_script(checker)
    for fault in driver.execute_async_script(RUN_AXE):
        if fault["impact"] in ("serious", "critical"):
            found.append(f"axe {fault['id']}: {' | '.join(fault['at'])}")
    return found


def keyboard(driver):
    """By Tab alone to a link of the page's text, and by Enter along it."""
    before = driver.current_url
    for _ in range(120):
        driver.switch_to.active_element.send_keys(Keys.TAB)
        at = driver.switch_to.active_element
        if driver.execute_script("return !!arguments[0].closest('article')", at) and at.tag_name == "a" and \
                not at.get_attribute("href").startswith(before.split("#")[0]):
            at.send_keys(Keys.ENTER)
            time.sleep(0.5)
            return [] if driver.current_url != before else ["Enter on a link leads nowhere"]
    return ["no link of the text in 120 steps of Tab"]


def search(driver):
    """What the search finds of a word, from disk."""
    driver.find_element(By.CSS_SELECTOR, "[data-md-component=search-query]").send_keys("backlash")
    for _ in range(50):
        time.sleep(0.1)
        if driver.find_elements(By.CSS_SELECTOR, ".md-search-result__item a"):
            return []
    return ["the search finds nothing for 'backlash'"]


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    kept = site.with_name(site.name + ".look")
    kept.mkdir(parents=True, exist_ok=True)
    checker, wrong = axe(), []
    with tempfile.TemporaryDirectory() as profile:
        driver = browser(profile)
        for page in PAGES:
            for width in WIDTHS:
                for scheme in SCHEMES:
                    set_look(driver, width, scheme)
                    driver.get((site / page).as_uri())
                    driver.execute_script("localStorage.clear()")  # the scheme that was shown before
                    driver.refresh()
                    time.sleep(0.3)
                    shot = driver.execute_cdp_cmd("Page.captureScreenshot", {})
                    name = f"{page.removesuffix('.html').replace('/', '_')}_{width}_{scheme}.png"
                    (kept / name).write_bytes(base64.b64decode(shot["data"]))
                    wrong += [f"{page} at {width} pixels, {scheme}: {what}" for what in faults(driver, checker, scheme)]
        set_look(driver, 1440, "light")
        for page, look in ((PAGES[0], keyboard), (PAGES[0], search)):
            driver.get((site / page).as_uri())
            wrong += [f"{page}: {what}" for what in look(driver)]
        driver.quit()
    print("\n".join(wrong) or f"{len(PAGES)} pages are well, at {WIDTHS} pixels, {SCHEMES}")
    print(f"pictures: {kept}", file=sys.stderr)
    sys.exit(1 if wrong else 0)


main()
