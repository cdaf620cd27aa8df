"""The equation of motion as a file of Python that needs NumPy and SciPy alone."""

from .equations import Equations
from .expressions import ELEMENTWISE
from .writing import Language, forces_of, numbers_of, opening_of, relaxed_of

_PYTHON = Language(
    functions={name: f"np.{function.__name__}" for name, function in ELEMENTWISE.items()},
    choice="({1} if {0} else {2})",
    constants={True: "True", False: "False", float("inf"): "np.inf", float("-inf"): "-np.inf"},
)

_FILE = '''"""{opening}

acceleration(t, q, v, force{z}) is the right-hand side; simulate(time, force) is a run.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

DOF, HIDDEN = {dof}, {hidden}
MASS = np.array([{mass}])  # kg

{numbers}


def forces(t, q, v, z):
    """Forces of the terms (DOF,), restoring side positive, and rates of the hidden states (HIDDEN,)."""
    total, rate = np.zeros(DOF), np.zeros(HIDDEN)

    {forces}

    return total, rate


def acceleration(t, q, v, force{z_default}):
    """Acceleration (DOF,) at time t, displacement q, velocity v and force, all (DOF,){z_words}."""
    return np.linalg.solve(MASS, force - forces(t, q, v, z)[0])


def relaxed(q, v):
    """Hidden states (HIDDEN,) at rest at displacement q and velocity v."""
    z = np.zeros(HIDDEN){relaxed}
    return z


def rates(t, y, force):
    """Rate of y, which is q, v and z in a row."""
    q, v, z = np.split(y, [DOF, 2 * DOF])
    total, rate = forces(t, q, v, z)
    return np.concatenate([v, np.linalg.solve(MASS, force - total), rate])


def simulate(time, force, displacement=None, velocity=None, method="{method}", rtol=1e-8, atol=1e-12):
    """Displacement, velocity and acceleration (n, DOF) at the instants `time` (n,).

    `force` (n, DOF), or (n,) for one degree of freedom, goes between its samples as a cubic spline. The run begins at
    `displacement` and `velocity`, by default at rest, with the hidden states relaxed. `method`, `rtol` and `atol` are
    those of scipy.integrate.solve_ivp.
    """
    time = np.asarray(time, float)
    drive = CubicSpline(time, np.reshape(np.asarray(force, float), (time.size, DOF)))
    start = (np.zeros(DOF) if each is None else np.asarray(each, float) for each in (displacement, velocity))
    q, v = (each.reshape(DOF) for each in start)
    run = solve_ivp(
        lambda t, y: rates(t, y, drive(t)),
        (time[0], time[-1]),
        np.concatenate([q, v, relaxed(q, v)]),
        method=method,
        t_eval=time,
        max_step=np.max(np.diff(time)),
        rtol=rtol,
        atol=atol,
    )
    if not run.success:
        raise RuntimeError(f"The run ended at t = {{run.t[-1] if len(run.t) else time[0]:g}} s: {{run.message}}")
    accelerations = [rates(t, y, drive(t))[DOF : 2 * DOF] for t, y in zip(run.t, run.y.T)]
    return run.y[:DOF].T, run.y[DOF : 2 * DOF].T, np.array(accelerations)
'''


def python_text(equations: Equations) -> str:
    """The file."""
    relaxed = relaxed_of(equations, _PYTHON, "z")
    hidden = equations.hidden > 0
    return _FILE.format(
        opening="\n".join(opening_of(equations, "Python with NumPy and SciPy")),
        dof=equations.dof,
        method="RK45" if equations.bounded else "LSODA",
        hidden=equations.hidden,
        mass=", ".join(f"[{_PYTHON.matrix(row[None])}]" for row in equations.mass),
        numbers="\n".join(numbers_of(equations, _PYTHON)),
        forces="\n    ".join(forces_of(equations, _PYTHON, "total", "rate")),
        relaxed="".join(f"\n    {line}" for line in relaxed),
        z=", z" if hidden else "",
        z_default=", z" if hidden else ", z=()",
        z_words=", and hidden states z" if hidden else "",
    )
