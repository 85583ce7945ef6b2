"""What a notebook shows of a result: small tables and sparklines, without scripts or anything from the network."""

from __future__ import annotations

import base64
import html
import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gapscope._traces import judging

if TYPE_CHECKING:
    from gapscope._log import Floats
    from gapscope._parts import Statement
    from gapscope._results import Diagnosis, Inspection, Replay, Tune
    from gapscope._traces import Traces

_WIDTH, _HEIGHT = 240, 36
_MEASURED, _PREDICTED = "#444", "#d62"


# Control characters, and those that turn the direction of writing (Unicode Standard Annex 9).
_HIDDEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069]")


def _text(value: object) -> str:
    """As HTML, with what could hide something made visible."""
    return html.escape(_HIDDEN.sub(lambda found: f"\\u{ord(found[0]):04x}", str(value)))


def _number(value: float, digits: int = 4) -> str:
    return "" if math.isnan(value) else f"{value:.{digits}g}"


def _table(head: list[str], rows: list[list[str]]) -> str:
    """``rows`` are HTML."""
    if not rows:
        return ""
    line = "".join(f'<th style="text-align:left">{_text(name)}</th>' for name in head)
    cells = ["".join(f'<td style="text-align:left">{cell}</td>' for cell in row) for row in rows]
    body = "".join(f"<tr>{row}</tr>" for row in cells)
    return f"<table><thead><tr>{line}</tr></thead><tbody>{body}</tbody></table>"


def _path(values: "Floats", low: float, high: float) -> str:
    columns = np.array_split(values, min(len(values), _WIDTH))
    points = [(x, float(np.nanmean(part))) for x, part in enumerate(columns) if not np.isnan(part).all()]
    scale = (_HEIGHT - 4) / (high - low) if high > low else 0.0
    step = _WIDTH / max(1, len(columns) - 1)
    return " ".join(f"{x * step:.1f},{_HEIGHT - 2 - (y - low) * scale:.1f}" for x, y in points)


def sparkline(measured: "Floats", predicted: "Floats") -> str:
    """Measured (grey) and predicted (orange) over time."""
    seen = np.concatenate([measured[np.isfinite(measured)], predicted[np.isfinite(predicted)]])
    if len(seen) == 0:
        return ""
    low, high = float(seen.min()), float(seen.max())
    lines = "".join(
        f'<polyline fill="none" stroke="{colour}" stroke-width="1" points="{_path(values, low, high)}"/>'
        for colour, values in ((_MEASURED, measured), (_PREDICTED, predicted))
        if len(values) > 1
    )
    return f'<svg width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}">{lines}</svg>'


def _scores(traces: "tuple[Traces, ...]", logs: "tuple[object, ...]") -> str:
    rows = []
    for trace, log in zip(traces, logs):
        for name, score in log.signals.items():  # type: ignore[attr-defined]
            signal = trace[name]
            rows.append(
                [
                    _text(log.log),  # type: ignore[attr-defined]
                    _text(name),
                    _number(score.rmse),
                    _number(score.nrmse),
                    sparkline(signal.measured, signal.predicted),
                ]
            )
    return _table(["log", "signal", "RMSE", "nRMSE", "measured (grey), predicted (orange)"], rows)


def replay(result: "Replay") -> str:
    return f"<b>error {_number(result.error)}</b> ({_text(result.mode)})" + _scores(result.traces, result.logs)


def tune(result: "Tune") -> str:
    error = result.error
    rows = [
        [
            _text(p.name),
            _number(p.nominal),
            f"<b>{_number(p.value)}</b>" if p.identifiable else _number(p.value),
            f"{_number(p.low)} .. {_number(p.high)}" if p.identifiable else "not known",
            _text(p.unit),
        ]
        for p in result.parameters
    ]
    return (
        f"<b>held-out error {_number(error.nominal)} &rarr; {_number(error.held_out)}</b> "
        f"(on what was fitted {_number(error.train)}; {_text(result.termination)})"
        + _table(["parameter", "nominal", "value", "95 % interval", "unit"], rows)
        + _scores(result.traces, result.held_out)
    )


def _others(statements: "tuple[Statement, ...]") -> str:
    """A line that counts the statements that no table shows."""
    absent = [s for s in statements if s.answer == "absent"]
    bounded = sum(1 for s in absent if s.bound)
    counts = {
        "absent beyond a bound": bounded,
        "absent without one": len(absent) - bounded,
        "unseen in these logs": sum(1 for s in statements if s.answer == "unseen"),
    }
    said = ", ".join(f"{count} {what}" for what, count in counts.items() if count)
    return f"<p>{said}: <code>.statements</code></p>" if said else ""


def _drawn(result: "Diagnosis") -> str:
    memory = result.out / "logs"
    rows = [
        [
            _text(
                (Path(one.log).stem if Path(one.log).parent == memory else one.log)
                + (f", from {one.from_s:g} s" if one.from_s > 0 else "")
            ),
            _text(one.signal),
            _number(one.error),
            sparkline(one.measured, one.predicted),
        ]
        for one in judging(result.out / "report.html")
    ]
    return _table(["log", "signal", "nRMSE", "measured (grey), predicted (orange)"], rows)


def diagnosis(result: "Diagnosis") -> str:
    rows = [
        [
            _text(f"{s.name}@{s.on}"),
            _text(s.answer),
            f"{s.probability:.2f}",
            "<br>".join(
                _text(f"{name} {_number(p.value)} ({_number(p.low)} .. {_number(p.high)})")
                for name, p in s.parameters.items()
            ),
            "" if math.isnan(s.share_of_gap.value) else f"{100 * s.share_of_gap.value:.0f} %",
        ]
        for s in result.statements
        if s.answer == "present"
    ]
    gap = result.gap
    closed = "" if math.isnan(gap.closed) else f", {100 * gap.closed:.0f} % closed"
    further = gap.further_log
    if result.effects and further.logs:
        closed += (
            f"; each of {further.logs} logs or parts of a log, left out of the fit: "
            f"{100 * further.low:.0f} .. {100 * further.high:.0f} %"
        )
    return (
        f"<b>{_text(result.verdict)}</b>, probability {result.probability:.2f}; held-out error "
        f"{_number(gap.nominal, 3)} &rarr; retuned {_number(gap.refit, 3)} &rarr; {_number(gap.final, 3)}{closed}"
        + (f" ({_text(result.termination)})" if result.termination == "interrupted" else "")
        + _table(["effect", "answer", "probability", "size (95 %)", "of the gap that closes"], rows)
        + _others(result.statements)
        + _drawn(result)
        + f"<p>{_text(result.explanation)}</p>"
    )


def inspection(result: "Inspection") -> str:
    rows = [
        [_text(c.name), _text(c.role), _number(c.minimum), _number(c.maximum), _number(c.noise, 2), _text(c.unit)]
        for c in result.channels
    ]
    said = "".join(f"<li>{_text(line)}</li>" for line in (*result.unfit_because, *result.verdict))
    return (
        f"<b>{_text(result.log)}: {'fit for use' if result.fit else 'not fit for use'}</b>"
        + _table(["channel", "role", "min", "max", "noise", "unit"], rows)
        + (f"<ul>{said}</ul>" if said else "")
    )


def frame(page: str) -> str:
    """A whole page within the notebook's."""
    return f'<iframe srcdoc="{html.escape(page)}" width="100%" height="700" style="border:0"></iframe>'


def video(path: Path) -> str:
    data = base64.b64encode(path.read_bytes()).decode()
    if path.suffix == ".mp4":
        return f'<video controls width="640" src="data:video/mp4;base64,{data}"></video>'
    return f'<img width="640" src="data:image/{path.suffix[1:]};base64,{data}">'
