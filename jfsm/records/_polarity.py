"""The sign of a force against the motion of the point it acts on."""

import numpy as np
from scipy.integrate import cumulative_trapezoid

from jfsm.records._tapers import SHORTEST_PIECE, Pieces, Samples, Spectra

PERIODS, FEWEST_PIECES = 8, 6
PEAK = 0.01  # share of the strongest line's power from which a line belongs to the resonance
PUSHED = 1e-3  # the same of the force
ERRORS = 6.0
CORRELATED = 4.0  # pieces overlap by half, and the taper ties neighbouring lines together
ALIKE = (
    0.995  # correlation of displacement and acceleration from which they are one line: mass is not told from stiffness
)


def is_inverted(force: Samples, motion: Samples, derivative: int, dt: float, frequency: float) -> bool:
    """Whether a force looks like that on a negative mass and a negative stiffness; arguments as in `polarity`."""
    return polarity(force, motion, derivative, dt, frequency) < -ERRORS


def polarity(force: Samples, motion: Samples, derivative: int, dt: float, frequency: float) -> float:
    """Standard errors by which the mass or the stiffness that a force seems to move is above zero, whichever is more.

    It is far below zero where both are negative, and 0 where the two cannot be told apart, or the force drives nothing
    of the motion.

    Parameters
    ----------
    force, motion : (n,) float arrays
        Of one point.
    derivative : int
        What the motion is: 0 displacement, 1 velocity, 2 acceleration.
    dt : float
        Sampling interval [s].
    frequency : float
        Strongest frequency of the motion [Hz].

    Notes
    -----
    Around a resonance the impedance at a driving point is that of one mass, damper and spring, and all reactance rises
    with frequency (Foster), whatever the rest of the structure. Mass and stiffness tell the sign best: a delay changes
    the damping. Under a single line they cannot be told apart, and the answer is no. The delay of a force cannot be
    told from damping without a model, so nothing is said of it.
    """
    for _ in range(derivative):
        motion = cumulative_trapezoid(motion - motion.mean(), dx=dt, initial=0.0)
    length = int(np.clip(round(PERIODS / (frequency * dt)), SHORTEST_PIECE, 2 * force.size // (FEWEST_PIECES + 1)))
    pieces = Pieces.of(force.size, length, dt)
    x, v, a = (pieces.spectra(motion - motion.mean(), order) for order in range(3))
    pushes = pieces.spectra(force - force.mean())
    strength, pushed = (np.mean(np.abs(y) ** 2, axis=0) for y in (v, pushes))
    strength[:3] = pushed[:3] = 0.0
    # What moves without being pushed, as the harmonics that a nonlinear spring makes, tells nothing.
    peak = (strength > PEAK * strength.max()) & (pushed > PUSHED * pushed.max())
    if not np.any(peak):
        return 0.0
    flat = 1.0 / np.sqrt(strength[peak])  # so that the flanks, which tell mass from stiffness, count as the peak does
    columns = np.stack([_real(flat * y[:, peak]) for y in (a, v, x)], axis=1)
    target = _real(flat * pushes[:, peak])
    columns /= np.linalg.norm(columns, axis=0)
    normal = columns.T @ columns
    if abs(normal[0, 2]) > ALIKE:
        return 0.0
    mass, damping, stiffness = found = np.linalg.solve(normal, columns.T @ target)
    left = target - columns @ found
    variance = CORRELATED * (left @ left) / target.size
    errors = np.sqrt(variance * np.diag(np.linalg.inv(normal)))
    if damping > ERRORS * errors[1]:  # it takes energy, as with the right sign: a single line bends the other two
        return 0.0
    return float(max(mass / errors[0], stiffness / errors[2]))


def _real(y: Spectra) -> Samples:
    """Real and imaginary parts, one after the other."""
    return np.concatenate([y.real.ravel(), y.imag.ravel()])
