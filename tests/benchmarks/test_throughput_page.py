"""The page of two workers against one says what was measured, and a study is copied whole for each round."""

import importlib.util
from pathlib import Path

import pytest

PATH = Path(__file__).parents[2] / "benchmarks" / "scale" / "throughput.py"


@pytest.fixture(scope="module")
def program():
    spec = importlib.util.spec_from_file_location("throughput", PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_throughput_is_of_medians_and_the_load_is_told(program):
    text = program.page({1: [40.0, 100.0, 42.0], 2: [24.0, 25.0, 300.0]}, policies=4, steps=2000, load=(0.21, 1.9))
    assert "| 1 | 40.0, 100.0, 42.0 | 42.0 | 5.7 | 1.00 |" in text
    assert "| 2 | 24.0, 25.0, 300.0 | 25.0 | 9.6 | 1.68 |" in text
    assert "**Two workers do 1.68 times what one does**" in text
    assert "in the minute before: 0.21" in text
    assert "--policies 4 --steps 2000 --rounds 3" in text
