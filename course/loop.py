#!/usr/bin/env python3
"""Runs a control law round the simulated rig and says how it went.

python3 loop.py EXPERIMENT LAW [--reference R] [--start A,B] [--seconds S] [OPTION OF gapscope replay]...

EXPERIMENT is the rig's experiment file; LAW is a file with a `controller:` section (docs/reference/experiment.md tells
its keys) that may use the column `wanted` as a reference. R is a number (what is wanted all the time) or
`sine:AMPLITUDE,HZ`. A,B are the two angles at the start, in rad. --tip prints the sum of both angles too. All other
options go to `gapscope replay --mode closed_loop`: --params, --set, --with.

The rig is the program's model. Its parameters are the experiment file's, unless --params or --set gives others.
"""
import csv
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile

RATE_HZ = 500
BAND_RAD = math.radians(2)
RUNS_AWAY_RAD = 10


def run_loop(experiment, law, reference, seconds, start, options=(), gapscope="gapscope"):
    """The loop in simulation: `law` is the text of a controller section, `reference` a function of time. Returns the
    times, and the predicted values of each measured signal by its name."""
    experiment = pathlib.Path(experiment).resolve()
    text = experiment.read_text()
    text = re.sub(r"^model: *(\S+)", lambda m: f"model: {experiment.parent / m[1]}", text, flags=re.M)
    command = re.search(r"^commands:\n *- .*?column: *(\w+)", text, re.M)[1]
    signals = re.findall(r"^ *- \{signal: *(\w+)", text, re.M)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "experiment.yaml").write_text(text + law)
        with open(folder / "log.csv", "w") as file:
            file.write(",".join(["time_s", command, *signals, "wanted"]) + "\n")
            for k in range(int(seconds * RATE_HZ) + 1):
                angles = ",".join(map(str, start))
                file.write(f"{k / RATE_HZ:.4f},0,{angles},{reference(k / RATE_HZ):.9g}\n")
        done = subprocess.run([gapscope, "replay", folder / "experiment.yaml", folder / "log.csv", "--mode",
                               "closed_loop", "--out", folder / "out", "--quiet", "--json", *options],
                              capture_output=True, text=True)
        if done.returncode != 0:
            print(f"loop.py: gapscope replay, exit status {done.returncode}: {done.stderr.strip()}", file=sys.stderr)
            sys.exit(done.returncode)
        with open(folder / "out/traces/log.csv", newline="") as file:
            rows = list(csv.DictReader(file))
    return [float(r["__time"]) for r in rows], {s: [float(r["predicted/" + s]) for r in rows] for s in signals}


def amplitude(time, values, hz, since):
    """Of the sine of that frequency in the values, by correlation over whole periods."""
    rows = [(t, v) for t, v in zip(time, values) if t >= since]
    periods = math.floor((rows[-1][0] - rows[0][0]) * hz)
    rows = [(t, v) for t, v in rows if t < rows[0][0] + periods / hz]
    c = sum(v * math.cos(2 * math.pi * hz * t) for t, v in rows) * 2 / len(rows)
    s = sum(v * math.sin(2 * math.pi * hz * t) for t, v in rows) * 2 / len(rows)
    return math.hypot(c, s)


def settled_after(time, values, target, band):
    """When the values last were outside the band about the target."""
    late = [t for t, v in zip(time, values) if abs(v - target) > band]
    return late[-1] if late else 0.0


def fail(what, allowed, cure):
    print(f"loop.py: {what}; allowed: {allowed}; {cure}", file=sys.stderr)
    sys.exit(2)


def number_list(flag, text, count):
    try:
        values = [float(v) for v in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count or not all(map(math.isfinite, values)):
        fail(f"{flag} {text}", f"{count} number{'s' * (count > 1)}, separated by commas", "give it so")
    return values


def options_of(words):
    """Our own options, taken out of the words, with their values; what is left goes to the program."""
    own, rest, words = {"--reference": "0", "--start": "0,0", "--seconds": "6"}, [], list(words)
    while words:
        word = words.pop(0)
        flag, equals, value = word.partition("=")
        if flag == "--tip":
            own[flag] = ""
        elif flag in own:
            if not equals and not words:
                fail(f"{flag} without a value", "a value behind it", "python3 loop.py --help tells them")
            own[flag] = value if equals else words.pop(0)
        else:
            rest.append(word)
    return own, rest


def print_table(time, signals, hz):
    away = next((name for name, values in signals.items() if max(map(abs, values)) > RUNS_AWAY_RAD), None)
    if away:
        print(f"the loop does not hold: {away} passes {RUNS_AWAY_RAD} rad")
        return
    print("signal             at the end   farthest   within 2 deg of its end after"
          + ("   amplitude of the sine" if hz else ""))
    for name, values in signals.items():
        end = sum(values[-RATE_HZ // 2:]) / len(values[-RATE_HZ // 2:])
        settled = settled_after(time, values, end, BAND_RAD)
        line = f"{name:<15} {end:9.3f} rad {max(values, key=abs):6.3f} rad {settled:25.2f} s  "
        if hz:
            line = f"{name:<15} {'':>13} {max(values, key=abs):6.3f} rad {'':>28}"
            line += f"{math.degrees(amplitude(time, values, hz, time[-1] / 2)):19.1f} deg"
        print(line.rstrip())


def main(words):
    if "--help" in words or "-h" in words:
        print(__doc__)
        return
    own, rest = options_of(words)
    files = [word for word in rest[:2] if not word.startswith("-")]
    if len(files) != 2:
        fail(f"got {len(files)} files", "EXPERIMENT LAW, before the options", "python3 loop.py --help shows a call")
    for file in files:
        if not os.path.isfile(file):
            fail(f"no such file: {file}", "an experiment file and a law", "call it in the folder of the handout")
    kind, _, wave = own["--reference"].partition(":")
    hz = 0
    if kind == "sine":
        size, hz = number_list("--reference", wave, 2)
        reference = lambda t: size * math.sin(2 * math.pi * hz * t)
    else:
        wanted, = number_list("--reference", own["--reference"], 1)
        reference = lambda t: wanted
    seconds, = number_list("--seconds", own["--seconds"], 1)
    law = pathlib.Path(files[1]).read_text()
    time, signals = run_loop(files[0], law, reference, max(seconds, 4 / hz if hz else 0),
                             number_list("--start", own["--start"], 2), rest[2:])
    if "--tip" in own:
        signals["tip: their sum"] = [sum(both) for both in zip(*signals.values())]
    print_table(time, signals, hz)


if __name__ == "__main__":
    main(sys.argv[1:])
