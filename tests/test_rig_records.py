"""Measured rigs as their owners keep them, read and inspected; `benchmarks/rig_records.py` has all fifteen."""

import numpy as np
import pytest

from benchmarks.rig_records import RIGS

# What the note beside each set says: samples, rate [Hz], channels, units; and what its page must tell.
RADIANS = {"force": "N m", "displacement": "rad", "velocity": "rad/s"}
VOLTS = {"force": "V", "displacement": "V"}
STATED = {
    "arm_two_joint": (2996, 500.0, ("force 1", "force 2", "displacement 1", "displacement 2", "velocity 1",
                                    "velocity 2"), RADIANS, "`time` must have uniform steps"),
    "ball_drops": (54, 15.0, ("displacement 1", "velocity 1"), {"displacement": "m", "velocity": "m/s"},
                   "Rows with ball = Whiffle Ball 1 and drop = 1: 54 of 756."),
    "bouc_wen": (40960, 750.0, ("force 1", "displacement 1"), {"force": "N", "displacement": "m"},
                 "Periodic: 5 periods of 8192 samples"),
    "coupled_drives": (400, 50.0, ("force 1", "velocity 1"), {"force": "V", "velocity": "V"}, "Bends or jumps"),
    "double_pendulum": (17782, 400.0, tuple(f"displacement {j}" for j in (1, 2, 3, 4)), {"displacement": "px"},
                        "Quantised in steps of 1 px"),
    "emps": (24841, 1000.0, ("force 1", "displacement 1"), {"force": "N", "displacement": "m"},
             "Quantised in steps of 5e-08 m"),
    "friction_damper_brfd": (7169, 1024.0, ("force 1", "displacement 1", "velocity 1"),
                             {"force": "N", "displacement": "m"}, "Quantised in steps of 3.562 N"),  # 0.0008 kip
    "motion_capture_sl": (819, 100.0, ("displacement 1", "displacement 2", "velocity 1", "velocity 2"),
                          {"displacement": "rad", "velocity": "rad/s"}, "gaps, of at most 0.15 s"),
    "mr_damper": (3001, 100.0, ("force 1", "displacement 1"), {"force": "N", "displacement": "m"},
                  "Quantised in steps of 5e-06 m"),
    "pendulum_large_angle": (13604, 100.0, ("displacement 1",), {"displacement": "rad"},
                             "Quantised in steps of 0.005236 rad"),
    "roll_decay_kvlcc2": (19464, 100.0, ("displacement 1",), {"displacement": "rad"},
                          "Quantised in steps of 8.727e-05 rad"),  # 0.005 degrees
}  # fmt: skip


@pytest.mark.parametrize("rig", STATED)
def test_a_rig_is_read_as_its_owner_describes_it_and_inspected(shared_data, rig):
    samples, rate, channels, units, message = STATED[rig]
    record = RIGS[rig](shared_data / rig)
    assert (len(record), tuple(f"{kind} {dof}" for kind, dof in record.channels)) == (samples, channels)
    assert 1 / np.median(np.diff(record.time)) == pytest.approx(rate, rel=0.01)  # the camera gives 14.98 for 15
    assert {kind: record.units[kind] for kind in units} == units
    page = record.inspect()
    assert [one.channel for one in page.channels] == list(channels)
    assert any(message in finding.message for finding in page.findings)
    for wrong in ("hung", "spikes"):  # joints that stick and chatter, drives in steps
        assert not any(wrong in finding.message for finding in page.findings)


def test_input_and_output_in_two_files_make_one_record_and_one_mean_period(shared_data):
    record = RIGS["silverbox_levels"](shared_data / "silverbox_levels")
    assert (len(record), record.sample_rate) == (245760, pytest.approx(2441.40625, rel=1e-9))
    assert (record.units["force"], record.units["displacement"]) == ("V", "V")
    folded = record.folded(transient=5)
    assert len(folded) == 8192
    change = next(note for note in folded.notes if note.startswith("From period to period"))
    noise = float(change.split("displacement 1 by ")[1].split()[0])
    assert noise == pytest.approx(0.2e-3, rel=0.2)  # "about 0.2 mV on y"
