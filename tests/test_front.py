"""The front door: its version, `python -m jfsm`, and calls the wrong way round."""

import subprocess
import sys
from importlib.metadata import version
from typing import Any

import numpy as np
import pytest

import jfsm

MODEL = jfsm.Structure.sdof(1.0, 9.0, 0.1)
RECORD = jfsm.Record(time=np.arange(40) * 0.1, displacement=np.sin(np.arange(40.0)))


def test_the_version_is_that_of_the_package():
    assert jfsm.__version__ == version("jfsm")


def test_python_m_jfsm_is_the_command_line():
    done = subprocess.run([sys.executable, "-m", "jfsm", "--version"], capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (0, f"jfsm {version('jfsm')}\n")


@pytest.mark.parametrize(
    ("call", "given", "words"),
    [
        (jfsm.fit, (RECORD, MODEL), r"write jfsm\.fit\(model, record\); got \(a Record, a Structure\)"),
        (jfsm.fit, ([RECORD], MODEL), r"write jfsm\.fit\(model, record\); got \(a list, a Structure\)"),
        (jfsm.simulate, (RECORD, MODEL), r"write jfsm\.simulate\(model, record\); got \(a Record, a Structure\)"),
        (jfsm.simulate_many, (RECORD, MODEL), r"write jfsm\.simulate_many\(models, record\)"),
        (jfsm.diagnose, (MODEL, RECORD), r"write jfsm\.diagnose\(record, model\); got \(a Structure, a Record\)"),
        (jfsm.diagnose, (MODEL,), r"write jfsm\.diagnose\(record, model\); got \(a Structure, nothing\)"),
        (jfsm.map_force, (MODEL, RECORD), r"write jfsm\.map_force\(record, model\)"),
        (jfsm.estimate_motion, (MODEL, RECORD), r"write jfsm\.estimate_motion\(record, model\)"),
    ],
)
def test_a_call_the_wrong_way_round_says_which_way(call: Any, given, words):
    with pytest.raises(TypeError, match=f"The arguments are the wrong way round: {words}"):
        call(*given)
