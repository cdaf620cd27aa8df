"""FMUs made for tests, by PythonFMU."""

from pathlib import Path

FORM = """
import math
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class {name}(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.time, self.state = 0.0, {state}
        self.set = dict({parameters})
{body}
        for name in {inputs}:
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in {outputs}:
            setattr(self, name, 0.0)
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for name, value in self.set.items():
            setattr(self, name, value)
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )

    def show(self, state):
{show}

    def rates(self, state):
{rates}

    def do_step(self, current_time, step_size):
        late = {late}
        if late:
            self.show(self.state)
        parts = max(1, math.ceil(step_size / {inside}))
        h = step_size / parts
        for _ in range(parts):
            s = self.state
            k1 = self.rates(s)
            k2 = self.rates([x + h / 2 * k for x, k in zip(s, k1)])
            k3 = self.rates([x + h / 2 * k for x, k in zip(s, k2)])
            k4 = self.rates([x + h * k for x, k in zip(s, k3)])
            self.state = [x + h / 6 * (a + 2 * b + 2 * c + d) for x, a, b, c, d in zip(s, k1, k2, k3, k4)]
        if not late:
            self.show(self.state)
        return True
"""


def built(
    folder: Path,
    name: str,
    *,
    states: int,
    parameters: dict[str, float],
    inputs: list[str],
    outputs: list[str],
    rates: str,
    show: str,
    late: bool = False,
    body: str = "",
    inside: float = 1e-3,
    options: dict[str, str] | None = None,
) -> Path:
    """An FMU that integrates `rates` of its state by Runge-Kutta under the inputs that it holds.

    `rates` gives a list, `show` sets the outputs; both see `self` with inputs and parameters, and `state`. A `late` one
    shows its outputs as of the beginning of a step.
    """
    from pythonfmu.builder import FmuBuilder

    def indented(text: str) -> str:
        return "\n".join(f"        {line}" for line in text.strip().splitlines())

    source = FORM.format(
        name=name, state=[0.0] * states, parameters=parameters, inputs=inputs, outputs=outputs, rates=indented(rates),
        show=indented(show), late=late, body=indented(body), inside=inside,
    )  # fmt: skip
    folder.mkdir(exist_ok=True)
    script = folder / f"{name}.py"
    script.write_text(source)
    FmuBuilder.build_FMU(script, dest=folder, **(options or {}))  # pyright: ignore[reportArgumentType]
    return folder / f"{name}.fmu"
