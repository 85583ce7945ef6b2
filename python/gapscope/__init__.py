"""Finds why a MuJoCo model does not move like its hardware log.

>>> import gapscope as gs
>>> result = gs.replay("models/qube/experiment.yaml", gs.read("demo/qube.csv"), with_="cable_spring@arm")
>>> result.model.effects
('cable_spring@arm',)

The program does the work, as a child process: no call of this package can take the interpreter down with it, and
Ctrl-C gives what a search has found so far. docs/reference/python.md tells more.
"""

from gapscope._bar import bar
from gapscope._commands import design, diagnose, identify, inspect, render, replay, tune
from gapscope._errors import Bug, InputError, Interrupted, MissingLibrary
from gapscope._experiment import Experiment
from gapscope._keyed import Applied, Explanation, FeedbackDesign, Identification, InputDesign, OptimalDesign
from gapscope._log import Log, read, read_all
from gapscope._many import diagnose_many
from gapscope._parts import (
    Channel,
    Estimate,
    Exported,
    ExportedEffect,
    ExportError,
    FoundEffect,
    Interval,
    LogFit,
    LogResult,
    Parameter,
    SignalScore,
    Statement,
    Where,
)
from gapscope._plugins import load_plugins, plugin_library
from gapscope._program import Progress
from gapscope._results import Diagnosis, Inspection, Model, Replay, Report, Tune, Video
from gapscope._traces import Trace, Traces

__all__ = [
    "Applied",
    "Bug",
    "Channel",
    "Diagnosis",
    "Estimate",
    "Experiment",
    "Explanation",
    "ExportError",
    "Exported",
    "ExportedEffect",
    "FeedbackDesign",
    "FoundEffect",
    "Identification",
    "InputDesign",
    "InputError",
    "Inspection",
    "Interrupted",
    "Interval",
    "Log",
    "LogFit",
    "LogResult",
    "MissingLibrary",
    "Model",
    "OptimalDesign",
    "Parameter",
    "Progress",
    "Replay",
    "Report",
    "SignalScore",
    "Statement",
    "Trace",
    "Traces",
    "Tune",
    "Video",
    "Where",
    "bar",
    "design",
    "diagnose",
    "diagnose_many",
    "identify",
    "inspect",
    "load_plugins",
    "plugin_library",
    "read",
    "read_all",
    "render",
    "replay",
    "tune",
]
