#!/usr/bin/env python3
"""screenshot.py PAGE.html OUT.png: the first screens of a page from disk, 1280 wide, in headless Chromium."""
import pathlib
import shutil
import sys
import tempfile
import time

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

WIDTH, HEIGHT = 1280, 1500

page, out = sys.argv[1:]
with tempfile.TemporaryDirectory() as profile:
    options = Options()
    options.binary_location = shutil.which("chromium")
    for flag in ["--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
                 "--disable-component-update", "--disable-sync", f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": WIDTH, "height": HEIGHT, "deviceScaleFactor": 1, "mobile": False})
    driver.get(pathlib.Path(page).resolve().as_uri())
    time.sleep(0.5)  # fonts and charts
    driver.save_screenshot(out)
    driver.quit()
