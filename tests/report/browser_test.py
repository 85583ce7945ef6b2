#!/usr/bin/env python3
"""report.html in headless Chromium, from disk, with the network off. usage: browser_test.py PROGRAM
(gapscope_report_pages)

Exit status 77: no browser here (scripts/setup --tests installs it).
"""
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

try:
    from selenium import webdriver
    from selenium.webdriver.chrome.options import Options
    from selenium.webdriver.chrome.service import Service
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys
except ImportError:
    print("skipped: python3-selenium is not installed")
    sys.exit(77)
if not shutil.which("chromium") or not shutil.which("chromedriver"):
    print("skipped: chromium or chromedriver is not installed")
    sys.exit(77)

failures = []


def check(good, what):
    if not good:
        failures.append(what)
        print("FAILED:", what)


def browser(profile):
    options = Options()
    options.binary_location = shutil.which("chromium")
    for flag in ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
                 "--disable-background-networking", "--disable-component-update", "--disable-sync",
                 "--disable-dev-shm-usage", "--force-prefers-reduced-motion", f"--user-data-dir={profile}"]:
        options.add_argument(flag)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    driver = webdriver.Chrome(service=Service(shutil.which("chromedriver")), options=options)
    driver.execute_cdp_cmd("Network.enable", {})
    driver.execute_cdp_cmd("Network.emulateNetworkConditions",
                           {"offline": True, "latency": 0, "downloadThroughput": 0, "uploadThroughput": 0})
    return driver


# Contrast of text with what is behind it, by WCAG 2's formula; elements with less than 4.5 (3 for large text).
CONTRAST = """
const parse = (c) => c.match(/[\\d.]+/g).map(Number);
const linear = (v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4);
const luminance = ([r, g, b]) => [r, g, b].map((v) => linear(v / 255))
  .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
const behind = (e) => {
  for (; e; e = e.parentElement) {
    const c = parse(getComputedStyle(e).backgroundColor);
    if (c.length < 4 || c[3] > 0) return c;
  }
  return [255, 255, 255];
};
const poor = [];
for (const e of document.querySelectorAll("body *")) {
  const text = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
  if (!text || !e.checkVisibility() || e.closest("script,noscript")) continue;
  const style = getComputedStyle(e), a = luminance(parse(style.color)), b = luminance(behind(e));
  const ratio = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05), large = parseFloat(style.fontSize) >= 24;
  if (ratio < (large ? 3 : 4.5)) poor.push(`${e.tagName} "${e.textContent.trim().slice(0, 30)}" ${ratio.toFixed(2)}`);
}
return poor;
"""

# What a screen reader needs: names on controls and pictures, one h1, no level of heading left out.
NAMES = """
const bad = [];
if (!document.documentElement.lang) bad.push("no language");
if (!document.title) bad.push("no title");
if (document.querySelectorAll("h1").length !== 1) bad.push("not one h1");
const named = "button, select, [role=img], [role=group], [role=region], nav, video, table";
for (const e of document.querySelectorAll(named)) {
  if (e.closest("[hidden]")) continue;
  const label = e.getAttribute("aria-label")
    || (e.id && document.querySelector(`label[for="${e.id}"]`)?.textContent)
    || (e.tagName === "BUTTON" && e.textContent);
  if (!label || !label.trim()) bad.push("no name: " + e.outerHTML.slice(0, 80));
}
let before = 1;
for (const h of document.querySelectorAll("h1, h2, h3")) {
  if (!h.checkVisibility()) continue;
  const level = Number(h.tagName[1]);
  if (level > before + 1) bad.push("heading leaves a level out: " + h.textContent);
  before = level;
}
return bad;
"""

# Pixels that each chart has drawn in a colour of its own (not grey like the grid).
INK = """
return [...document.querySelectorAll(".plot")].filter((p) => p.checkVisibility()).map((plot) => {
  const canvas = plot.querySelector("canvas");
  if (!canvas || !canvas.width) return 0;
  const draw = canvas.getContext("2d"), d = draw.getImageData(0, 0, canvas.width, canvas.height).data;
  let count = 0;
  for (let i = 0; i < d.length; i += 4) if (d[i + 3] > 40) ++count;
  return count;
});
"""

RANGES = "return timeCharts.map((c) => c.xAxisRange());"


def open_page(driver, path, width, height):
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride",
                           {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False})
    driver.get(path.as_uri())


def look(driver, path, width, verdict, charts=True):
    name = f"{path.name} at {width} px"
    driver.get_log("browser"), driver.get_log("performance")
    open_page(driver, path, width, 900)
    check(verdict in driver.find_element(By.TAG_NAME, "h1").text,
          f"{name}: verdict, got '{driver.find_element(By.TAG_NAME, 'h1').text}'")
    messages = driver.get_log("browser")
    check(not messages, f"{name}: console says {messages}")
    asked = [e["params"]["request"]["url"]
             for e in (json.loads(r["message"])["message"] for r in driver.get_log("performance"))
             if e["method"] == "Network.requestWillBeSent"]
    check(all(url == path.as_uri() or url.startswith("data:") for url in asked), f"{name}: asked for {asked}")
    overflow = driver.execute_script("return document.documentElement.scrollWidth - window.innerWidth;")
    check(overflow <= 0, f"{name}: wider than the window by {overflow} px")
    ink = driver.execute_script(INK)
    check(not charts or (len(ink) >= 3 and min(ink) > 150), f"{name}: charts are empty: {ink}")
    check(not driver.execute_script(NAMES), f"{name}: {driver.execute_script(NAMES)}")
    for theme in ("light", "dark"):
        driver.execute_script(f"setTheme(arguments[0]); {'drawLog' if charts else 'drawMap'}();", theme)
        poor = driver.execute_script(CONTRAST)
        check(not poor, f"{name}, {theme}: too little contrast: {poor[:5]}")


def linked_zoom(driver, path):
    open_page(driver, path, 1440, 900)
    all_of_it = driver.execute_script(RANGES)
    same = lambda ranges: all(abs(r[0] - ranges[0][0]) < 1e-9 and abs(r[1] - ranges[0][1]) < 1e-9 for r in ranges)
    narrower = lambda ranges, than: ranges[0][1] - ranges[0][0] < 0.8 * (than[0][1] - than[0][0])
    check(len(all_of_it) >= 4, f"only {len(all_of_it)} charts")
    closer = driver.find_element(By.CSS_SELECTOR, "[data-zoom=in]")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'});", closer)
    closer.click()
    ranges = driver.execute_script(RANGES)
    check(same(ranges) and narrower(ranges, all_of_it), f"button: {ranges}")
    driver.find_element(By.CSS_SELECTOR, "[data-zoom=all]").click()
    check(same(driver.execute_script(RANGES)) and not narrower(driver.execute_script(RANGES), all_of_it),
          "button 'All'")
    plot = driver.find_elements(By.CSS_SELECTOR, "#charts .plot")[1]
    driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'});", plot)
    drag = ActionChains(driver).move_to_element_with_offset(plot, -100, 0).click_and_hold()
    drag.move_by_offset(200, 0).release().perform()
    ranges = driver.execute_script(RANGES)
    check(same(ranges) and narrower(ranges, all_of_it), f"drag: {ranges}")
    charts = driver.find_element(By.ID, "charts")
    charts.send_keys("0")
    check(not narrower(driver.execute_script(RANGES), all_of_it), "key 0")
    charts.send_keys("+")
    before = driver.execute_script(RANGES)
    charts.send_keys(Keys.ARROW_RIGHT)
    after = driver.execute_script(RANGES)
    check(narrower(before, all_of_it) and same(after) and after[0][0] > before[0][0], f"keys: {before} {after}")
    # Every control can be reached by the keyboard alone, and shows that it has the focus.
    reached = set()
    for _ in range(120):
        ActionChains(driver).send_keys(Keys.TAB).perform()
        reached.add(driver.execute_script("const e = document.activeElement; "
                                          "return e.id || e.dataset?.zoom || e.textContent.trim();"))
    missing = {"theme", "log", "in", "out", "left", "right", "all", "charts"} - reached
    check(not missing, f"the keyboard does not reach {missing}")


def many_signals(driver, path):
    for width in (390, 1440):
        look(driver, path, width, "off")
        script = lambda text: driver.execute_script("return " + text)
        title = "document.querySelector('#charts h3').textContent"
        charts = script("timeCharts.length")
        check(charts == 3, f"{width}: one signal in full, got {charts} charts")
        check(script(title) == "joint_28", f"{width}: the worst first, got {script(title)}")
        check(script("document.querySelectorAll('.tile').length") == 12, f"{width}: twelve small pictures")
        more = driver.find_element(By.ID, "more-tiles")
        driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'});", more)
        more.click()
        check(script("document.querySelectorAll('.tile').length") == 29, f"{width}: all small pictures")
        tile = driver.find_elements(By.CSS_SELECTOR, ".tile")[20]
        driver.execute_script("arguments[0].scrollIntoView({block: 'center', behavior: 'instant'});", tile)
        driver.execute_async_script("requestAnimationFrame(() => setTimeout(arguments[0], 50));")
        drawn = ("const c = arguments[0].querySelector('canvas'); if (!c.width) return 0; "
                 "return c.getContext('2d').getImageData(0, 0, c.width, c.height).data.filter((v) => v > 40).length;")
        check(driver.execute_script(drawn, tile) > 150, f"{width}: a small picture in view is empty")
        tile.click()
        check(script(title) == "joint_08", f"{width}: a press picks, got {script(title)}")
        check("command joint_08" in driver.find_element(By.ID, "charts").text, f"{width}: its own command")
        driver.find_element(By.CSS_SELECTOR, "#signal option[value='1']").click()
        check(script(title) == "joint_27", f"{width}: the list picks, got {script(title)}")
    opened = driver.execute_script("return performance.getEntriesByType('navigation')[0].loadEventEnd;")
    print(f"29 signals of 12,000 rows are open after {opened:.0f} ms, {path.stat().st_size / 1e6:.1f} MB")


# 3000 units of 300 robots, one of which changed.
def fleet(driver, path):
    for width in (390, 1440):
        look(driver, path, width, "1 of 300 robots changed", charts=False)
    opened = driver.execute_script("return performance.getEntriesByType('navigation')[0].loadEventEnd;")
    print(f"a fleet of 3000 units is open after {opened:.0f} ms, {path.stat().st_size / 1e6:.1f} MB")
    check(opened < 2000, f"a fleet of 3000 units takes {opened:.0f} ms to open")
    rows = driver.find_elements(By.CSS_SELECTOR, "#map-area tbody tr")
    check(len(rows) == 100 and "</script><b>robot" in rows[0].text, f"the robot that changed is first: {rows[0].text}")
    check(len(driver.find_elements(By.CSS_SELECTOR, "#robot .step")) == 1, "its change is marked over time")
    driver.execute_script("arguments[0].click()", rows[1].find_element(By.TAG_NAME, "button"))
    text = driver.find_element(By.ID, "robot").text
    check("No change." in text and "failed: no such column" in text, f"a pressed robot is shown in full, got {text}")
    links = driver.find_elements(By.CSS_SELECTOR, "#robot-units a")
    check(len(links) == 9 and links[0].get_attribute("href").endswith("reports/0/report.html"), "links to its pages")


def meaning_shown(driver, word):
    """What stands beside a word of the glossary that has the keyboard's focus, and nothing before; it fits in the
    page."""
    shown = "return getComputedStyle(arguments[0], '::after').content"
    check(driver.execute_script(shown, word) == "none", f"nothing beside '{word.text}' without focus")
    driver.execute_script("arguments[0].focus()", word)
    width = driver.execute_script("return [document.documentElement.scrollWidth, innerWidth]")
    check(width[0] <= width[1], f"the meaning of '{word.text}' makes the page {width[0]} wide, of {width[1]}")
    meaning = driver.execute_script(shown, word)
    driver.execute_script("arguments[0].blur()", word)
    return meaning


def main():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.argv[1], folder], check=True)
        driver = browser(str(Path(folder) / "profile"))
        try:
            verdicts = {"replay": "hardly follows", "long": "hardly follows", "none": "Nothing is missing",
                        "parameters": "other parameter values close the gap",
                        "effects": "The model lacks cable spring on arm and Coulomb friction on arm.",
                        "ambiguous": "lacks cable spring or gravity offset on arm and Coulomb friction on arm. "
                                     "These logs cannot tell which",
                        "explained": "Cable spring on arm is present.",
                        "unknown": "Something is missing that no known effect explains."}
            for name, verdict in verdicts.items():
                for width in (390, 1440):
                    look(driver, Path(folder) / f"{name}.html", width, verdict)
            fleet(driver, Path(folder) / "fleet.html")
            many_signals(driver, Path(folder) / "many.html")
            linked_zoom(driver, Path(folder) / "effects.html")
            where = driver.find_element(By.ID, "where").text
            check("Of what cable spring on arm and Coulomb friction on arm leave" in where, "what the effects leave")
            text = driver.find_element(By.ID, "main").text
            for part in ["91 %", "gains too little", "0.0002 N m", "</script><b>bold</b>",
                         "gapscope design triangle models/qube/experiment.yaml --duration 20",
                         "cable_spring@arm.stiffness_n_m_per_rad", "sha256"]:
                check(part in text, f"the diagnosis does not say '{part}'")
            check(driver.execute_script("return document.querySelectorAll('.map canvas').length") == 2,
                  "two maps of the missing torque")
            rows = driver.find_element(By.ID, "tables").text.splitlines()
            check(rows[-3:-1] == ["two.csv 0 20 – 0.3 0.05 –", "one.csv 0 20 1.2 0.1 0.05 96 %"],
                  f"what is left on each log, the most first, got {rows}")
            curves = driver.find_elements(By.CSS_SELECTOR, "#curves .plot")
            check(len(curves) == 1 and "torque over arm angle" in text, "the curve of the effect that has one")
            marked = driver.find_elements(By.CSS_SELECTOR, "#statements abbr")
            words = {e.text: meaning_shown(driver, e) for e in marked}
            check("before the logs were seen" in words.get("prior", ""), f"the glossary by keyboard, got {words}")
            open_page(driver, Path(folder) / "explained.html", 1440, 900)
            cells = driver.find_element(By.ID, "tables").text
            for part in ["largest gain", "says nothing", "80.0 %", "gravity offset on arm", "it explains less"]:
                check(part in cells, f"the evidence does not say '{part}'")
            open_page(driver, Path(folder) / "long.html", 1440, 900)
            opened = driver.execute_script("const t = performance.getEntriesByType('navigation')[0]; "
                                           "return t.loadEventEnd;")
            print(f"a log of 1,000,000 rows is open after {opened:.0f} ms")
            check(driver.execute_script("return Math.max(...data.logs[0].traces.signals[0].measured)") == 9.75,
                  "the spike of the long log")
        finally:
            driver.quit()
    print("failed" if failures else "passed")
    return 1 if failures else 0


sys.exit(main())
