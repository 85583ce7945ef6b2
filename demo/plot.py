#!/usr/bin/env python3
"""Draws traces that `gapscope replay --out` wrote as an SVG: one measured signal and its predictions.

Usage: demo/plot.py SIGNAL OUT.svg LABEL=TRACE.csv [LABEL=TRACE.csv ...]
"""
import csv
import math
import sys

WIDTH, HEIGHT, LEFT, BOTTOM, TOP = 720, 280, 46, 30, 34
COLOURS = ["#c44", "#27c"]


def read(path, signal):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    column = lambda name: [float(row[name]) if row[name] else math.nan for row in rows]
    return column("__time"), column("measured/" + signal), column("predicted/" + signal)


def main(signal, out, *traces):
    named = [(label, read(path, signal)) for label, path in (trace.split("=", 1) for trace in traces)]
    time, measured, _ = named[0][1]
    lines = [("measured", "#222", measured)] + [(label, COLOURS[i % 2], t[2]) for i, (label, t) in enumerate(named)]
    values = [v for _, _, y in lines for v in y if v == v]
    low, high = min(values), max(values)
    x = lambda t: LEFT + (WIDTH - LEFT - 10) * t / time[-1]
    y = lambda v: TOP + (HEIGHT - TOP - BOTTOM) * (high - v) / (high - low)
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" '
           f'font-size="12">',
           f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>']
    for tick in range(0, int(time[-1]) + 1, 2):
        svg.append(f'<text x="{x(tick):.0f}" y="{HEIGHT - 10}" '
                   f'text-anchor="{"end" if tick == int(time[-1]) else "middle"}">{tick} s</text>')
    step = 0.5 if high - low > 1 else 0.1
    for k in range(math.ceil(low / step), math.floor(high / step) + 1):
        svg.append(f'<path d="M{LEFT} {y(k * step):.1f}H{WIDTH - 10}" stroke="#ddd"/><text x="{LEFT - 6}" '
                   f'y="{y(k * step) + 4:.1f}" text-anchor="end">{k * step:.1f}</text>')
    svg.append(f'<text x="12" y="{HEIGHT / 2:.0f}" transform="rotate(-90 12 {HEIGHT / 2:.0f})" '
               f'text-anchor="middle">{signal}</text>')
    for place, (label, colour, data) in enumerate(lines):
        points = " ".join(f"{x(t):.1f},{y(v):.1f}" for t, v in list(zip(time, data))[::6] if v == v)
        style = ' stroke-width="3.4" stroke-opacity="0.45"' if label == "measured" else ' stroke-width="1.3"'
        svg.append(f'<polyline points="{points}" fill="none" stroke="{colour}"{style}/>')
        svg.append(f'<path d="M{LEFT + 10 + 215 * place} 17h18" stroke="{colour}" stroke-width="3"/><text '
                   f'x="{LEFT + 34 + 215 * place}" y="21">{label}</text>')
    with open(out, "w") as file:
        file.write("\n".join(svg) + "\n</svg>\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
