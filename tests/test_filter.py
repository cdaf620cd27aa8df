"""The filter of a plant: for a linear one it must say what a dense multivariate normal law says."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from references import sticking_motion
from scipy.linalg import expm
from scipy.stats import multivariate_normal

import jfsm
from jfsm.estimation import Innovations, ProcessNoise, Readings, Start, innovations
from jfsm.plant import excitation, lower, observation_of
from jfsm.structures import (
    AccelerationGain,
    AttachedOscillator,
    Coulomb,
    CubicStiffness,
    DelayedForce,
    ForceGain,
    Maxwell,
    Offset,
)

N, DT, PADDED = 60, 0.02, 64
TIME = DT * np.arange(N)
MODEL = (
    jfsm.Structure.chain(mass=[1.0, 0.6], stiffness=[9.0, 5.0], damping=[0.2, 0.1])
    + ForceGain(0.1, at=("force", 2))
    + Offset(0.3, at=("displacement", 1))
    + AccelerationGain(-0.2, at=("acceleration", 2))
)
CHANNELS = (("displacement", 1), ("velocity", 2), ("acceleration", 2))
VARIANCE = np.array([1e-4, 4e-4, 9e-3])
LOG_SCALE = np.array([0.3, 0.0, -0.5])
PROCESS = np.array([[2e-5, 1e-5], [1e-5, 7e-5]])
X0, V0 = np.array([0.2, -0.1]), np.array([0.0, 0.4])
START_COVARIANCE = np.diag([0.02, 0.03, 0.05, 0.01])
WANDER = np.array([[1e-4, 1e-6], [3e-5, 2e-6], [2e-3, 1e-5]])

COLOUR = np.array([[0.9, 0.95], [0.5, 0.3], [0.99, 0.6]])


def measured() -> tuple[np.ndarray, np.ndarray]:
    """Force (n, 2) and readings (n, channels): any will do, they need not be likely."""
    rng = np.random.default_rng(5)
    force = np.column_stack([np.sin(3 * TIME), 2 * np.cos(5 * TIME)])
    return force, 0.1 * rng.standard_normal((N, len(CHANNELS))) + np.array([0.5, 0.2, 1.0])


def filtered(
    model=MODEL,
    values=None,
    use=None,
    length: int = PADDED,
    x0=X0,
    covariance=START_COVARIANCE,
    one_kernel=False,
    wandering: tuple[int, ...] = (),
    coloured: tuple[int, ...] = (),
) -> Innovations:
    force, readings = measured()
    readings = readings if values is None else values
    use = np.ones_like(readings) if use is None else use
    record = jfsm.Record(TIME, force)
    fill = ((0, length - N), (0, 0))
    return RUN(
        lower(model, CHANNELS),
        observation_of(CHANNELS, 2),
        excitation(record, 2, 4, "linear", length=length),
        Readings(
            jnp.asarray(np.pad(readings, fill, constant_values=7.0)),
            jnp.asarray(np.pad(use, fill)),
            jnp.asarray(VARIANCE),
            jnp.asarray(np.arange(length) < N, dtype=jnp.float64),
            jnp.asarray(WANDER[list(wandering)]),
            wandering,
            jnp.asarray(COLOUR[list(coloured)]),
            coloured,
        ),
        ProcessNoise(jnp.asarray(PROCESS)),
        Start(jnp.asarray(x0), jnp.asarray(V0), jnp.asarray(covariance)),
        jnp.asarray(LOG_SCALE),
        one_kernel=one_kernel,
    )


def log_likelihood(found: Innovations, use: np.ndarray) -> float:
    e, s = np.asarray(found.error)[:N], np.asarray(found.variance)[:N]
    return float(-0.5 * np.sum(use * (e**2 / s + np.log(2 * np.pi * s))))


def dense_law() -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of all readings at once, (n * channels,), by matrix exponentials and plain propagation."""
    mass = np.diag([1.0, 0.6])
    stiffness = np.array([[14.0, -5.0], [-5.0, 5.0]])
    damping = np.array([[0.3, -0.1], [-0.1, 0.1]])
    inverse = np.linalg.inv(mass)
    rate = np.block([[np.zeros((2, 2)), np.eye(2)], [-inverse @ stiffness, -inverse @ damping]])
    by_force = np.vstack([np.zeros((2, 2)), inverse])
    chain = np.zeros((8, 8))  # state, force, slope of the force
    chain[:4, :4], chain[:4, 4:6], chain[4:6, 6:] = rate, by_force, np.eye(2)
    step = expm(chain * DT)
    force = measured()[0] / (1 + np.array([0.0, 0.1]))
    noise = np.zeros((4, 4))
    noise[2:, 2:] = PROCESS
    rows = np.array([[1, 0, 0, 0], [0, 0, 0, 1], 0.8 * rate[3]])
    through = np.array([np.zeros(2), np.zeros(2), 0.8 * inverse[1]])
    means, covariance = [np.concatenate([X0, V0])], np.zeros((N, 4, N, 4))
    covariance[0, :, 0] = START_COVARIANCE
    for k in range(N - 1):
        slope = (force[k + 1] - force[k]) / DT
        means.append(step[:4, :4] @ means[k] + step[:4, 4:6] @ force[k] + step[:4, 6:] @ slope)
        for j in range(k + 1):
            covariance[k + 1, :, j] = step[:4, :4] @ covariance[k, :, j]
            covariance[j, :, k + 1] = covariance[k + 1, :, j].T
        covariance[k + 1, :, k + 1] = step[:4, :4] @ covariance[k, :, k] @ step[:4, :4].T + noise
    mean = np.array(means) @ rows.T + force @ through.T + np.array([0.3, 0.0, 0.0])
    spread = np.einsum("ci,kilj,dj->kcld", rows, covariance, rows).reshape(N * 3, N * 3)
    return mean.ravel(), spread + np.diag(np.tile(VARIANCE * np.exp(LOG_SCALE), N))


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(CubicStiffness(3.0, at=(1, 2)), marks=pytest.mark.slow),
        Coulomb(0.3, at=(0, 1)),
        DelayedForce(1.0, 0.05, at=(0, 1)),
        Maxwell(2.0, 0.3, at=(0, 1)),
    ],
    ids=lambda law: law.kind,
)
def test_one_kernel_gives_what_the_ordinary_loop_gives_with_its_derivatives(law):
    """Also where it must not be one: a look at the past, more states than four."""

    def found(one_kernel):
        def run(x0):
            covariance = np.diag([*np.diag(START_COVARIANCE), 0.01, 0.01][: 4 + 2 * bool(law.states)])
            return filtered(MODEL + law, x0=x0, covariance=covariance, one_kernel=one_kernel)

        return jax.jvp(run, (jnp.asarray(X0),), (jnp.array([1.0, -0.5]),))

    for one, other in zip(jax.tree.leaves(found(True)), jax.tree.leaves(found(False)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(other).max()))


RUN = eqx.filter_jit(innovations)
ALL = np.ones((N, len(CHANNELS)))


def random_mask() -> np.ndarray:
    return (np.random.default_rng(6).uniform(size=ALL.shape) < 0.7).astype(float)


@pytest.mark.parametrize("use", [ALL, random_mask()], ids=["all", "some masked"])
def test_the_innovations_of_a_linear_plant_have_the_likelihood_of_a_dense_normal_law(use):
    mean, covariance = dense_law()
    kept = use.ravel() > 0
    law = multivariate_normal(mean[kept], covariance[np.ix_(kept, kept)])  # pyright: ignore[reportArgumentType]
    expected = law.logpdf(measured()[1].ravel()[kept])
    assert log_likelihood(filtered(use=use), use) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("wandering", [(0,), (2, 1)])
def test_zeros_that_wander_are_slopes_that_change_at_random(wandering):
    mean, covariance = dense_law()
    whole = covariance.reshape(N, 3, N, 3).copy()
    sample = np.arange(N)
    since = np.maximum(sample[:, None] - 1 - sample[None, :], 0.0)  # samples for which a change of slope has acted
    for channel in wandering:
        begun, changed = WANDER[channel]
        whole[:, channel, :, channel] += begun * np.outer(sample, sample) + changed * since @ since.T
    law = multivariate_normal(mean, whole.reshape(3 * N, 3 * N))  # pyright: ignore[reportArgumentType]
    found = filtered(wandering=wandering)
    assert log_likelihood(found, ALL) == pytest.approx(law.logpdf(measured()[1].ravel()), rel=1e-6)


@pytest.mark.parametrize("coloured", [(0,), (2, 1)])
def test_noise_with_a_memory_is_correlated_from_sample_to_sample(coloured):
    mean, covariance = dense_law()
    whole = covariance.reshape(N, 3, N, 3).copy()
    apart, variance = np.abs(np.subtract.outer(np.arange(N), np.arange(N))), VARIANCE * np.exp(LOG_SCALE)
    for channel in coloured:
        memory, share = COLOUR[channel]
        whole[:, channel, :, channel] += share * variance[channel] * (memory**apart - np.eye(N))
    law = multivariate_normal(mean, whole.reshape(3 * N, 3 * N))  # pyright: ignore[reportArgumentType]
    found = filtered(coloured=coloured)
    assert log_likelihood(found, ALL) == pytest.approx(law.logpdf(measured()[1].ravel()), rel=1e-6)


def test_the_value_of_a_masked_reading_changes_nothing_else():
    use, values = random_mask(), measured()[1]
    torn = np.where(use > 0, values, 1e6)
    found, expected = filtered(values=torn, use=use), filtered(values=values, use=use)
    np.testing.assert_array_equal(found.variance, expected.variance)
    np.testing.assert_array_equal(np.asarray(found.error)[:N][use > 0], np.asarray(expected.error)[:N][use > 0])


def test_a_masked_stretch_is_predicted_with_an_error_bar_that_grows():
    use = ALL.copy()
    use[20:] = 0.0
    variance = np.asarray(filtered(use=use).variance)[20:N, 0]
    assert np.all(np.diff(variance) > 0)


def test_padding_changes_no_innovation():
    short, long = filtered(length=N), filtered(length=PADDED + 16)
    # The same operations, but a compiler may order a sum in another way for another length.
    np.testing.assert_allclose(long.error[:N], short.error, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(long.variance[:N], short.variance, rtol=1e-12)


def test_an_empty_slot_for_a_law_or_for_friction_changes_nothing():
    plain = filtered()
    for term in (jfsm.CubicStiffness(0.0, at=(1, 2)), jfsm.Coulomb(0.0, at=(0, 1))):
        found = filtered(MODEL + term)
        np.testing.assert_allclose(found.error[:N], plain.error[:N], rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(found.variance[:N], plain.variance[:N], rtol=1e-6)


def test_while_a_link_sticks_nothing_is_uncertain_about_its_speed():
    model = jfsm.Structure.sdof(1.0, 9.0, 0.2) + jfsm.Coulomb(50.0, at=(0, 1))
    channels = (("displacement", 1), ("velocity", 1))
    values, n = np.zeros((32, 2)), 32
    found = RUN(
        lower(model, channels),
        observation_of(channels, 1),
        excitation(jfsm.Record(DT * np.arange(n), np.sin(np.arange(n))), 1, 2, "linear"),
        Readings(jnp.asarray(values), jnp.ones((n, 2)), jnp.asarray([1e-4, 1e-4]), jnp.ones(n)),
        ProcessNoise(jnp.asarray([[0.1]])),
        Start(jnp.zeros(1), jnp.zeros(1), jnp.diag(jnp.asarray([0.01, 0.0]))),
        jnp.zeros(2),
    )
    np.testing.assert_allclose(found.variance[:, 1], 1e-4, rtol=1e-9)
    # The place at rest is known ever better, as a mean of readings is.
    expected = 1e-4 + 1 / (1 / 0.01 + np.arange(n) / 1e-4)
    np.testing.assert_allclose(found.variance[:, 0], expected, rtol=1e-9)


RUBBING = {"mass": 1.0, "stiffness": 9.0, "damping": 0.05, "F": 0.6}
RUBBED = jfsm.Structure.sdof(RUBBING["mass"], RUBBING["stiffness"], RUBBING["damping"]) + jfsm.Coulomb(0.6, at=(0, 1))
STEP, SUBSTEPS = 0.05, 2
ACCELERATION = (("acceleration", 1),)


def test_a_mass_that_is_stiffly_attached_takes_no_share_of_the_process_noise():
    rigid = jfsm.Structure.chain(mass=[1.0, 0.6], stiffness=[9.0, 5.0], damping=[0.2, 0.1])
    apart = jfsm.Structure.chain(mass=[1.0, 0.3], stiffness=[9.0, 5.0], damping=[0.2, 0.1])
    apart = apart + AttachedOscillator(0.3, omega=100.0, zeta=0.7, at=(0, 2))
    with_it = np.vstack([np.eye(4), np.eye(4)[[1, 3]]])  # at first it moves with what it hangs on
    use = np.tile([1.0, 1.0, 0.0], (N, 1))  # an acceleration tells how it pulls
    one = filtered(rigid, use=use)
    two = filtered(apart, use=use, covariance=with_it @ START_COVARIANCE @ with_it.T)
    settled = np.s_[20:N, :2]
    np.testing.assert_allclose(two.variance[settled], one.variance[settled], rtol=0.01)


def rubbing(n: int, force=lambda t: np.zeros(1), x0: float = 0.0) -> np.ndarray:
    """Acceleration (n,) of a mass on a spring that rubs, with true stick, by SciPy."""
    time, (m, k, c, limit) = STEP * np.arange(n), RUBBING.values()
    x, v, _ = sticking_motion(m, c, k, [[1.0]], [limit], force, time, x0, 0.0)
    x, v, g = x[:, 0], v[:, 0], np.array([force(t)[0] for t in time])
    moves = np.abs(v) > 1e-9 * np.max(np.abs(v))
    pull = g - k * x - c * v
    return np.where(moves, pull - limit * np.sign(v), np.sign(pull) * np.maximum(np.abs(pull) - limit, 0.0)) / m


def rubbed(readings, force, noise: float, forgiven: float, x0: float) -> Innovations:
    """Innovations of the true structure on readings (n,) of the acceleration."""
    n = readings.shape[0]
    return RUN(
        lower(RUBBED, ACCELERATION),
        observation_of(ACCELERATION, 1),
        excitation(jfsm.Record(STEP * np.arange(n), force), 1, SUBSTEPS, "band-limited"),
        Readings(readings[:, None], jnp.ones((n, 1)), jnp.asarray([noise**2]), jnp.ones(n)),
        ProcessNoise(jnp.asarray([[forgiven**2]])),
        Start(jnp.asarray([x0]), jnp.zeros(1), jnp.diag(jnp.asarray([1e-12, 1e-12]))),
        jnp.zeros(1),
    )


@pytest.mark.parametrize("noise", [0.01, 0.1, 0.4])
def test_a_motion_that_rubs_to_a_stop_leaves_nothing_but_its_noise(noise):
    """While it rests, friction of every size up to the limit is a reading of zero: nothing else is to be chosen."""
    n, x0 = 2000, 1.13
    white = noise * np.random.default_rng(11).standard_normal(n)
    true = rubbing(n, x0=x0)
    assert 100 < np.flatnonzero(true)[-1] < 200, "it slides for some periods, and rests most of the time"
    found = rubbed(jnp.asarray(true + white), np.zeros(n), noise, 1e-5, x0)
    error, variance, log_share = (np.asarray(array)[:, 0] for array in found)
    # Mean squares of so many normal numbers scatter by 3 %; what the noise's own is, is known.
    assert np.mean(error**2 / variance) == pytest.approx(np.mean((white / noise) ** 2), rel=0.01)
    assert np.max(np.abs(error) / np.sqrt(variance)) < 4.5
    likelihood = np.sum(log_share - (error**2 / variance + np.log(variance)) / 2)
    assert likelihood == pytest.approx(-np.sum((white / noise) ** 2 / 2 + np.log(noise)), abs=3.0)


def test_a_link_that_is_put_to_rest_too_early_is_no_surprise():
    """The force is known to some per cent, so that the instant of an arrest is not known to the sample."""
    n, noise, rng = 3000, 0.02, np.random.default_rng(12)
    omegas, phases = np.array([1.1, 1.7, 2.3, 4.1]), rng.uniform(0, 2 * np.pi, 4)

    def force(t):
        return np.array([0.55 * np.sum(np.cos(omegas * t + phases))])

    disturbance = 0.05 * rng.standard_normal(n)
    measured = np.array([force(t)[0] for t in STEP * np.arange(n)]) + disturbance
    true = rubbing(n, force)
    arrests = np.flatnonzero((true[1:] == 0) & (true[:-1] != 0))
    assert arrests.size > 20
    readings = jnp.asarray(true + noise * rng.standard_normal(n))
    error, variance, log_share = (
        np.asarray(array)[:, 0] for array in rubbed(readings, measured, np.hypot(noise, 0.05), 0.05 * STEP, 0.0)
    )
    assert np.max(np.abs(error) / np.sqrt(variance)) < 5.0
    assert np.min(log_share) > np.log(0.002)


@pytest.mark.slow
def test_what_a_reading_may_be_adds_up_to_certainty():
    """While it slides, where it turns, where it comes to rest, and at rest; with a speed that is known badly."""
    n, noise, x0 = 90, 0.3, 0.43
    exact = rubbing(n, x0=x0)
    assert np.all(exact[-20:] == 0) and exact[-40] != 0
    true = exact + noise * np.random.default_rng(13).standard_normal(n)
    grid = jnp.arange(-7.0, 7.0, 0.15)

    def density(k, y):
        readings = jnp.where(jnp.arange(n) == k, y, true)
        error, variance, log_share = (array[k, 0] for array in rubbed(readings, np.zeros(n), noise, 0.03, x0))
        return jnp.exp(log_share - error**2 / (2 * variance)) / jnp.sqrt(2 * jnp.pi * variance)

    of_all = jax.jit(jax.vmap(jax.vmap(density, (None, 0)), (0, None)))(jnp.arange(0, n, 3), grid)
    several = np.sum(np.diff(np.sign(np.diff(of_all, axis=1)), axis=1) < 0, axis=1) > 1
    assert 2 < np.sum(several) < 30, "at some samples there is more than one thing that a reading may be"
    np.testing.assert_allclose(np.sum(of_all, axis=1) * 0.15, 1.0, rtol=1e-6)
