"""What is akin to a law that was found."""

import jfsm
from jfsm.diagnosis.hypotheses.candidate import Candidate
from jfsm.diagnosis.hypotheses.effect import Effect
from jfsm.diagnosis.search.pairs import _held_by
from jfsm.diagnosis.search.related_laws import special_cases

CAUSES = jfsm.causes()
MODEL = jfsm.Structure.sdof(1.0, 100.0, 1.0)


def test_a_special_case_keeps_the_sign_of_its_cause():
    among = [
        Candidate((Effect(CAUSES[name], (0, 1)),), (MODEL + jfsm.CubicStiffness(sign, at=(0, 1)),))
        for name, sign in (("cubic_hardening", 1.0), ("cubic_softening", -1.0))
    ]
    law = jfsm.DoubleWell(30.0, 4.0, at=(0, 1))
    [case] = special_cases(law, {}, among)
    assert case.effects[0].cause.id == "cubic_hardening" and float(case.starts[0].terms[-1].values[0]) == 4.0
    [(effect, special)] = _held_by(law, [c.effects[0] for c in among])
    assert effect.cause.id == "cubic_hardening" and float(special.values[0]) == 4.0
