#!/usr/bin/env python3
"""site/look.py SITE: scripts/site --look. Opens pages from disk in Chromium at two widths, light and dark; keeps
pictures in SITE.look; prints what is wrong, exit status 1 then."""
import pathlib
import sys
import tempfile
import time

from selenium.common.exceptions import TimeoutException
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.expected_conditions import element_to_be_clickable, presence_of_element_located
from selenium.webdriver.support.wait import WebDriverWait

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "scripts"))
sys.dont_write_bytecode = True
from fetched import npm_file  # noqa: E402
from screenshot import browser, set_size  # noqa: E402

PAGES = ["index.html", "gallery.html", "docs/index.html", "docs/tutorials/first-diagnosis.html",
         "docs/reference/options.html", "docs/results/diagnosis.html", "models/index.html"]
WIDTHS, SCHEMES = (1440, 390), ("light", "dark")
RUN_AXE = """
const done = arguments[arguments.length - 1];
axe.run({resultTypes: ["violations"]}).then((result) => done(result.violations.map((v) => ({
  id: v.id, impact: v.impact, at: v.nodes.slice(0, 3).map((n) => n.target.join(" ") + ": " + n.failureSummary)}))));
"""


def set_look(driver, width, scheme):
    set_size(driver, width, 900, mobile=width < 600)
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
    wait = WebDriverWait(driver, 10)
    try:
        wait.until(element_to_be_clickable((By.CSS_SELECTOR, "[data-md-component=search-query]"))).send_keys("backlash")
        wait.until(presence_of_element_located((By.CSS_SELECTOR, ".md-search-result__item a")))
    except TimeoutException:
        return ["the search finds nothing for 'backlash'"]
    return []


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    kept = site.with_name(site.name + ".look")
    kept.mkdir(parents=True, exist_ok=True)
    checker, wrong = npm_file("axe-core-4.10.2", "axe.min.js"), []
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
                    name = f"{page.removesuffix('.html').replace('/', '_')}_{width}_{scheme}.png"
                    driver.save_screenshot(str(kept / name))
                    wrong += [f"{page} at {width} pixels, {scheme}: {what}" for what in faults(driver, checker, scheme)]
        set_look(driver, 1440, "light")
        for look in (keyboard, search):
            driver.get((site / PAGES[0]).as_uri())
            wrong += [f"{PAGES[0]}: {what}" for what in look(driver)]
        driver.quit()
    print("\n".join(wrong) or f"{len(PAGES)} pages are well, at {WIDTHS} pixels, {SCHEMES}")
    print(f"pictures: {kept}", file=sys.stderr)
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
