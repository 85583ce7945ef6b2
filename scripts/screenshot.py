#!/usr/bin/env python3
"""screenshot.py [--phone] [--dark] [--print] PAGE.html OUT.png [FIRST LAST]: of a page from disk in headless Chromium,
1280 wide, on a phone (390) or on paper (A4): its first screens, or what stands from one element to another (CSS
selectors)."""
import argparse
import base64
import pathlib
import shutil
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

SCREEN, PHONE, PAPER, MARGIN = (1280, 1500), (390, 844), (718, 1047), 6
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
    width, height = driver.execute_script("return innerWidth"), bottom - top + 2 * MARGIN
    clip = {"x": 0, "y": top - MARGIN, "width": width, "height": height, "scale": 1}
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
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for flag in ("--phone", "--dark", "--print"):
        parser.add_argument(flag, action="store_true")
    parser.add_argument("page", type=pathlib.Path)
    parser.add_argument("out")
    parser.add_argument("parts", nargs="*")
    options = vars(parser.parse_args())
    with tempfile.TemporaryDirectory() as profile:
        driver = browser(profile)
        set_size(driver, *(PHONE if options["phone"] else PAPER if options["print"] else SCREEN), options["phone"])
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {
            "media": "print" if options["print"] else "screen",
            "features": [{"name": "prefers-color-scheme", "value": "dark" if options["dark"] else "light"}]})
        driver.get(options["page"].resolve().as_uri())
        time.sleep(0.5)  # fonts and charts
        save(driver, options["out"], options["parts"])
        driver.quit()


if __name__ == "__main__":
    main()
