#!/usr/bin/env python3
"""screenshot.py PAGE.html OUT.png [FIRST LAST]: of a page from disk, 1280 wide, in headless Chromium: its first
screens, or what stands from one element to another (CSS selectors)."""
import base64
import pathlib
import shutil
import sys
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

WIDTH, HEIGHT, MARGIN = 1280, 1500, 6
# Where the first element begins and the last one ends on the page; nothing that stays in view may cover them, and what
# stands above the first one is not in its margin.
BOX = """
document.querySelectorAll("header, nav").forEach((bar) => { bar.style.position = "static"; });
document.querySelector(arguments[0])?.style.setProperty("margin-top", "24px");
const [first, last] = [...arguments].map((selector) => {
  const part = document.querySelector(selector);
  if (!part || !part.checkVisibility()) throw new Error(`nothing to see of ${selector}`);
  return part.getBoundingClientRect();
});
return [first.top + scrollY, last.bottom + scrollY];
"""


def save(driver, out, parts):
    if not parts:
        driver.save_screenshot(out)
        return
    top, bottom = driver.execute_script(BOX, *parts)
    clip = {"x": 0, "y": top - MARGIN, "width": WIDTH, "height": bottom - top + 2 * MARGIN, "scale": 1}
    shot = driver.execute_cdp_cmd("Page.captureScreenshot", {"clip": clip, "captureBeyondViewport": True})
    pathlib.Path(out).write_bytes(base64.b64decode(shot["data"]))


def browser(profile):
    options = Options()
    options.binary_location = shutil.which("chromium")
    for flag in ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    return webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)


def set_size(driver, width, height, mobile=False):
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile})


def main():
    page, out, *parts = sys.argv[1:]
    with tempfile.TemporaryDirectory() as profile:
        driver = browser(profile)
        set_size(driver, WIDTH, HEIGHT)
        driver.get(pathlib.Path(page).resolve().as_uri())
        time.sleep(0.5)  # fonts and charts
        save(driver, out, parts)
        driver.quit()


if __name__ == "__main__":
    main()
