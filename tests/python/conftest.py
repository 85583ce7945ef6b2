"""Paths of the checkout; its own program and package."""

import sys
from pathlib import Path

import pytest

collect_ignore = ["try_wheel.py", "bench.py"]  # scripts/wheel and scripts/bench_python run them
ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "python"))


@pytest.fixture
def experiment() -> str:
    return str(ROOT / "models" / "qube" / "experiment.yaml")


@pytest.fixture
def demo() -> str:
    return str(ROOT / "demo" / "qube.csv")
