"""Reference systems: every one of the paper, and the field's standard ones, each a function that returns a structure.

    jfsm.systems.duffing()           one of them
    sorted(jfsm.systems.ALL)         their names; `PAPER` and `FIELD` are its two parts
    jfsm.systems.ALL["duffing"]()    by name

"The paper" is *Force State Maps Using Reproducing Kernel Particle Method and Kriging Based Functional Representations*;
(88) is its equation 88. Where what it prints contradicts itself or is not enough, the docstring says so, and which
choice is made. A system without a source has round numbers of our own. Units are SI unless the docstring says
"dimensionless", which any consistent set fits. The drive is not part of a structure: it belongs to the record.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import ArrayLike, Float
from scipy.linalg import eigh

from .structures import (
    AttachedOscillator,
    BilinearStiffness,
    BoucWen,
    Coulomb,
    CubicDamping,
    CubicStiffness,
    DelayedForce,
    DoubleWell,
    EndStop,
    Iwan,
    Jenkins,
    LinearDamping,
    LinearStiffness,
    LuGre,
    Maxwell,
    ParametricStiffness,
    PeriodicDisturbance,
    Preload,
    QuadraticStiffness,
    SineStiffness,
    Stribeck,
    Structure,
    VanDerPol,
)

GROUND = (0, 1)
"""The link between ground and the first mass."""


def modal_damping(mass: ArrayLike, stiffness: ArrayLike, ratios: ArrayLike) -> Float[np.ndarray, "dof dof"]:
    r"""Damping matrix that gives each mode its damping ratio and couples none, M Φ diag(2 η ω) Φᵀ M.

    Parameters
    ----------
    mass, stiffness : (dof, dof) arrays
    ratios : (dof,) array or number
        In the order of rising frequency.

    Notes
    -----
    The paper's :math:`\bar C = [\bar\vartheta^t]^{-1} \kappa\, \bar\vartheta^{-1}`, after (86), for mass-normalised
    shapes.
    """
    mass = np.asarray(mass)
    squares, shapes = eigh(np.asarray(stiffness), mass)
    weighted = mass @ shapes
    return weighted * (2 * np.asarray(ratios) * np.sqrt(squares)) @ weighted.T


# The paper


def linear() -> Structure:
    """Linear oscillator, m ẍ + c ẋ + k x = g, (74): m = 1 kg, c = 0.12 N s/m, k = 9 N/m.

    Natural frequency 3 rad/s, damping ratio 0.02.
    """
    return Structure.sdof(mass=1.0, stiffness=9.0, damping=0.12)


def duffing() -> Structure:
    """Hardening Duffing oscillator, m ẍ + c ẋ + k x + α x³ = g, (75): `linear` with α = 10 N/m³.

    One stable fixed point, the origin.
    """
    return linear() + CubicStiffness(10.0, at=GROUND)


def negative_duffing() -> Structure:
    """Duffing oscillator with two wells, m ẍ + c ẋ - k x + α x³ = g, (76): m, c, k, α as in `duffing`.

    Fixed points 0, a saddle, and ±√(k/α) = ±0.9487 m, stable with eigenvalues -0.06 ± 4.2422i 1/s. The paper reads
    -0.88 and 0.89 m from a map, which cannot come from its own k and α.
    """
    return Structure([1.0], [LinearDamping(0.12, at=GROUND), DoubleWell(9.0, 10.0, at=GROUND)])


def van_der_pol() -> Structure:
    """Van der Pol oscillator, m ẍ - ε ẋ (1 - x²) + k x = g, (77): m = 1 kg, k = 9 N/m, ε = 10 N s/m, x in m.

    The origin is an unstable node. One stable limit cycle: period 3.0992904174 s, amplitude 2.0234204141 m.
    """
    return Structure.sdof(mass=1.0, stiffness=9.0) + VanDerPol(10.0, 1.0, at=GROUND)


def frame() -> Structure:
    """Slab on three aluminium columns and one of steel, (82), case 2: translations z, y [m] and rotation θ [rad].

    K and C as printed after (87); forces of the third degree of freedom are moments [N m]. A base motion x_s in z is
    the force -m ẍ_s on degree of freedom 1 alone, with z relative to the base.

    The dimensions behind m, I, K and C are not printed. A modal damping matrix, as the paper says C is, determines
    I/m = 0.01059 m² and the products η√m, one for each mode; they differ (0.0436, 0.0402, 0.0224 √kg), so one common
    ratio η does not make the printed C. The scale of m stays free: m = 4.75 kg is chosen, for which η₁ = 0.02. Then
    the natural frequencies are 9.9, 10.2 and 20.1 Hz, 1 : 1.032 : 2.036 whatever the scale, and η₂ = 0.0184,
    η₃ = 0.0103. (82) lacks the dot of a θ beside c₁ and has a wrong sign beside c₈; k* of (85) is not used in it.
    """
    stiffness = [[1.9539e4, 0.0, 0.0366e4], [0.0, 1.9539e4, -0.0766e4], [0.0366e4, -0.0766e4, 0.0792e4]]
    damping = [[11.3388, -0.2256, 0.0034], [-0.2256, 11.7035, -0.0072], [0.0034, -0.0072, 0.1306]]
    return Structure.from_matrices(np.diag([4.75, 4.75, 0.05032]), stiffness, damping)


def cubic_chain() -> Structure:
    """Two masses in a row, a cubic spring on the first, (88), case 3: m = 1 kg, k₁ = 120, k₂ = 240 N/m, α = 1000 N/m³.

    Without the cubic spring 7.2535 and 23.3963 rad/s, both modes damped by 0.02. The printed matrix
    C = [[0.6913, -0.3132], [-0.3132, 0.5347]] N s/m is the modal one of these ratios and is taken here. It is not of
    the form of (88) and (89), where c₂₂ = -c₁₂: it needs a third dashpot, 0.2215 N s/m from ground to the second mass.
    With two dashpots alone the same ratios take c₁ = 0.7472, c₂ = 0.2394 N s/m. (89) also prints k₁₂ and k₂₁ as slopes
    of f₂ along x₂.
    """
    mass, stiffness = np.eye(2), np.array([[360.0, -240.0], [-240.0, 240.0]])
    chain = Structure.from_matrices(mass, stiffness, modal_damping(mass, stiffness, 0.02))
    return chain + CubicStiffness(1000.0, at=GROUND)


def _case_4() -> Structure:
    # k x is missing in (90), but the text finds k from the map, and without it case 4b would have no spring
    mass, stiffness, ratio = 1.77, 2500.0, 0.02
    return Structure.sdof(mass, stiffness, 2 * ratio * np.sqrt(stiffness * mass))


def bilinear() -> Structure:
    """Bilinear oscillator, m ẍ + c ẋ + k x + k_s x U(x) = g, (90), case 4a: m = 1.77 kg, k = 2500 N/m, k_s = 1.5 k.

    c = 2.6608 N s/m, 0.02 of critical without k_s. (90) omits k x. Without damping a free period lasts
    π/ω + π/(ω √2.5) = 0.13646 s at every amplitude, ω = √(k/m) = 37.582 rad/s.
    """
    return _case_4() + BilinearStiffness(3750.0, knot=0.0, side=1.0, at=GROUND)


def coulomb() -> Structure:
    """Oscillator with dry friction, m ẍ + c ẋ + k x + μ sgn ẋ = g, (90), case 4b: m, c, k as in `bilinear`, μ = 1.5 N.

    (90) omits k x. It rests anywhere within ±μ/k = ±0.6 mm. Without c a free decay loses 4 μ/k a period.
    """
    return _case_4() + Coulomb(1.5, at=GROUND)


def bilinear_coulomb() -> Structure:
    """Bilinear oscillator with dry friction, (90), case 4c: `bilinear` with μ = 1.5 N.

    It rests anywhere from -μ/k = -0.6 mm to μ/(k + k_s) = 0.24 mm.
    """
    return bilinear() + Coulomb(1.5, at=GROUND)


def cubic_coulomb_chain() -> Structure:
    """Two masses in a row, a cubic spring and dry friction on the first, (91), case 5: `cubic_chain` with μ = 5 N.

    The text takes all else from case 3. Its estimate c₂ = 0.9359 N s/m is 2·0.02·ω₂, an entry of the modal matrix and
    not a dashpot: with it the second mode would be damped by 0.039 at least. C(2,2) = -0.9359 has the wrong sign, and
    K(1,2) = -238.09 beside K(2,1) = -240.00 N/m is an error of the estimate.
    """
    return cubic_chain() + Coulomb(5.0, at=GROUND)


def kinked_spring() -> Structure:
    """The force 0.8 abs(x - 6) of Example 2, massless: a component whose motion is imposed.

    Two springs, one to each side of the knot. The jumps in displacement of Examples 1 and 3 are no law that a structure
    has: `EXAMPLES` holds all three as functions.
    """
    ahead = BilinearStiffness(0.8, knot=6.0, side=1.0, at=GROUND)
    behind = BilinearStiffness(-0.8, knot=6.0, side=-1.0, at=GROUND)  # on its side d - knot < 0
    return Structure([0.0], [ahead, behind])


def example_1(x: ArrayLike) -> np.ndarray:
    """0.5 sgn(x - 6) on 4 ≤ x ≤ 7, Example 1; at the jump the value to its right, where the paper puts x = 6."""
    return np.where(np.asarray(x) < 6.0, -0.5, 0.5)


def example_2(x: ArrayLike) -> np.ndarray:
    """0.8 abs(x - 6) on 4 ≤ x ≤ 7, Example 2."""
    return 0.8 * np.abs(np.asarray(x) - 6.0)


def example_3(x: ArrayLike) -> np.ndarray:
    """0.5 sgn(x - 5) + 0.8 abs(x - 6) on 4 ≤ x ≤ 7, Example 3, (51)."""
    return np.where(np.asarray(x) < 5.0, -0.5, 0.5) + example_2(x)


# The field: oscillators whose force is a function of the state


def softening_duffing() -> Structure:
    """Softening Duffing oscillator, ẍ + 0.12 ẋ + 9 x - x³ = g, dimensionless.

    The origin is stable, ±3 are saddles, beyond which the motion escapes.
    """
    return linear() + CubicStiffness(-1.0, at=GROUND)


def holmes() -> Structure:
    """Buckled beam, ẍ + 0.25 ẋ - x + x³ = g, dimensionless; under g = 0.3 cos t chaotic.

    Fixed points 0, a saddle, and ±1, stable, about which an undamped small motion has √2 rad/s.

    References
    ----------
    P. Holmes, Phil. Trans. R. Soc. Lond. A 292 (1979) 419-448.
    """
    return Structure([1.0], [LinearDamping(0.25, at=GROUND), DoubleWell(1.0, 1.0, at=GROUND)])


def ueda() -> Structure:
    """Ueda's circuit, ẍ + 0.05 ẋ + x³ = g, dimensionless; under g = 7.5 cos t chaotic.

    No linear stiffness: without damping a free period lasts 4 K(1/2)/A = 7.41630/A at the amplitude A.

    References
    ----------
    Y. Ueda, J. Stat. Phys. 20 (1979) 181-196.
    """
    return Structure([1.0], [LinearDamping(0.05, at=GROUND), CubicStiffness(1.0, at=GROUND)])


def helmholtz() -> Structure:
    """Escape from a well, ẍ + 0.1 ẋ + x - x² = g, dimensionless.

    The origin is stable, x = 1 a saddle, 1/6 of energy above it: from rest at x < -1/2 an undamped motion escapes.

    References
    ----------
    J. M. T. Thompson, Proc. R. Soc. Lond. A 421 (1989) 195-225.
    """
    return Structure.sdof(1.0, 1.0, 0.1) + QuadraticStiffness(-1.0, at=GROUND)


def rayleigh() -> Structure:
    """Rayleigh's maintained vibration, ẍ - ẋ + ẋ³/3 + x = 0, dimensionless.

    Its velocity obeys van der Pol's equation with ε = 1: limit cycle of period 6.6632868593.

    References
    ----------
    Lord Rayleigh, Phil. Mag. 15 (1883) 229-235.
    """
    return Structure.sdof(1.0, 1.0, -1.0) + CubicDamping(1.0 / 3.0, at=GROUND)


def silverbox() -> Structure:
    """Electronic Duffing oscillator, m ÿ + c ẏ + k y + k₃ y³ = u, input u and output y in volts.

    Fitted by `jfsm.fit` to the first 8000 samples of the multisine record, with offsets of 8.2419 mV (input) and
    2.8337 mV (output): free run over its last 20 000 samples within 0.30 mV rms. 68.3 Hz, damping ratio 0.049,
    k₃/k = 3.96 1/V².

    References
    ----------
    T. Wigren, J. Schoukens, Three free data sets for development and benchmarking in nonlinear system identification,
    Eur. Control Conf. (2013) 2933-2938: the record.
    """
    return Structure.sdof(5.3756e-6, 0.99056, 2.2527e-4) + CubicStiffness(3.9272, at=GROUND)


def pendulum() -> Structure:
    """Simple pendulum, m ẍ + c ẋ + m g sin(x/l) = 0 with the arc x: m = 1 kg, l = 1 m, c = 0.02 N s/m.

    Fixed points at multiples of π l, every other one stable. Without damping a free period lasts
    4 √(l/g) K(sin²(x₀/2l)), K the complete elliptic integral of its parameter; 2.0064 s for small motion.
    """
    mass, length, gravity = 1.0, 1.0, 9.80665
    swing = SineStiffness(mass * gravity / length, 1.0 / length, at=GROUND)
    return Structure([mass], [LinearDamping(0.02, at=GROUND), swing])


def end_stops() -> Structure:
    """Oscillator between elastic stops: m = 1 kg, c = 0.4 N s/m, k = 100 N/m, beyond ±10 mm 900 N/m more.

    10 rad/s between the stops, √(1000) = 31.6 rad/s against them.
    """
    return Structure.sdof(1.0, 100.0, 0.4) + EndStop(900.0, gap=0.01, at=GROUND)


# The field: friction and memory


def stribeck() -> Structure:
    """Oscillator on a sliding guide: m = 1 kg, c = 0.4 N s/m, k = 100 N/m, F = 1 N, F_static = 1.5 N, v_s = 0.02 m/s.

    It rests anywhere within ±F_static/k = ±15 mm.
    """
    return Structure.sdof(1.0, 100.0, 0.4) + Stribeck(1.0, 1.5, 0.02, at=GROUND)


def emps() -> Structure:
    """Electro-mechanical positioning system, M q̈ = τ - F_v q̇ - F_c sgn q̇ - offset; no spring.

    M = 95.109 kg, F_v = 203.50 N s/m, F_c = 20.394 N, offset -3.165 N: a constant +3.165 N beside the drive τ. It stays
    at rest for -23.559 N < τ < 17.229 N, and beyond moves at last with (τ + 3.165 N ∓ F_c)/F_v.

    References
    ----------
    A. Janot, M. Gautier, M. Brunot, Data set and reference models of EMPS, Workshop on Nonlinear System Identification
    Benchmarks, Eindhoven (2019).
    """
    friction = LinearDamping(203.50, at=GROUND), Coulomb(20.394, at=GROUND)
    return Structure([95.109], [*friction, Preload(3.165, at=GROUND)])


def lugre() -> Structure:
    """A mass pulled by a spring over bristles: 1 kg, 2 N/m, viscous friction 0.4 N s/m.

    F = 1 N, F_static = 1.5 N, v_s = 1 mm/s, σ₀ = 10⁵ N/m, σ₁ = √10⁵ N s/m. Pulled at 0.1 m/s, by the force
    0.2 N/s·t, it sticks and slips in turn. Stuck, it vibrates with √(σ₀/m) = 316 rad/s and half of critical damping.

    References
    ----------
    C. Canudas de Wit, H. Olsson, K. J. Åström, P. Lischinsky, IEEE Trans. Autom. Control 40 (1995) 419-425, Table I.
    """
    return Structure.sdof(1.0, 2.0, 0.4) + LuGre(1.0, 1.5, 1e-3, 1e5, np.sqrt(1e5), at=GROUND)


def bouc_wen() -> Structure:
    """Hysteretic benchmark, m ÿ + c ẏ + k y + z = u, ż = α ẏ - β (γ abs(ẏ) z + δ ẏ abs(z)).

    m = 2 kg, c = 10 N s/m, k = α = 5e4 N/m, β = 1e3 1/m, γ = 0.8, δ = -1.1. In our law z is divided by α, so
    k = 5e4 N/m, beta = β γ = 800 1/m, gamma = β δ = -1100 1/m, n = 1. For small motion 35.59 Hz, √((k + α)/m) =
    223.61 rad/s, damping ratio 0.0112. As γ + δ < 0 the force has no bound: stretched from rest
    z = α (exp(300 y) - 1)/300.

    References
    ----------
    J. P. Noël, M. Schoukens, Hysteretic benchmark with a dynamic nonlinearity, Workshop on Nonlinear System
    Identification Benchmarks, Brussels (2016).
    """
    return Structure.sdof(2.0, 5e4, 10.0) + BoucWen(k=5e4, beta=800.0, gamma=-1100.0, n=1.0, at=GROUND)


def jenkins() -> Structure:
    """Oscillator with an elastic slider: m = 1 kg, c = 0.4 N s/m, k = 100 N/m, slider 50 N/m up to 10 mm.

    √150 rad/s while it sticks; a cycle of amplitude X > 10 mm takes 4·50 N/m·0.01 m·(X - 0.01 m) of energy.
    """
    return Structure.sdof(1.0, 100.0, 0.4) + Jenkins(50.0, slip=0.01, at=GROUND)


def iwan() -> Structure:
    """Oscillator with a joint of sliders: m = 1 kg, c = 0.4 N s/m, k = 100 N/m, joint 50 N/m, 10 mm, χ = -0.5.

    √150 rad/s for the smallest motion. All of the joint slides at a force of k slip (1 + χ)/(2 + χ) = 1/6 N.

    References
    ----------
    D. J. Segalman, J. Appl. Mech. 72 (2005) 752-760.
    """
    return Structure.sdof(1.0, 100.0, 0.4) + Iwan(50.0, slip=0.01, chi=-0.5, at=GROUND)


def zener() -> Structure:
    """Standard linear solid: m = 1 kg on 100 N/m beside a Maxwell element of 50 N/m that relaxes in 0.1 s.

    Poles: the roots of (m s² + k)(s + 1/τ) + k_M s = 0.
    """
    return Structure.sdof(1.0, 100.0) + Maxwell(50.0, tau=0.1, at=GROUND)


def tuned_mass_damper() -> Structure:
    """Undamped host, m = 1 kg, k = 100 N/m, with Den Hartog's absorber of μ = 5 % of its mass.

    Absorber: ω_a = ω/(1 + μ), damping ratio √(3 μ/(8 (1 + μ))). The response of the host has two nearly equal peaks of
    √(1 + 2/μ) = 6.403 static deflections.

    References
    ----------
    J. P. Den Hartog, Mechanical Vibrations, 4th ed., McGraw-Hill (1956).
    """
    mass, stiffness, share = 1.0, 100.0, 0.05
    tuned = np.sqrt(stiffness / mass) / (1 + share)
    absorber = AttachedOscillator(share * mass, omega=tuned, zeta=np.sqrt(3 * share / (8 * (1 + share))), at=GROUND)
    return Structure.sdof(mass, stiffness) + absorber


def delayed() -> Structure:
    """Oscillator that answers late, ẍ + 1.5 x = 0.25 x(t - 2π), dimensionless: no damping but the delay's.

    ẍ + δ x = b x(t - 2π) is stable for 1 < δ < 9/4 where 0 < b < min(δ - 1, 9/4 - δ): this one for b < 1/2.

    References
    ----------
    C. S. Hsu, S. J. Bhatt, J. Appl. Mech. 33 (1966) 119-124.
    """
    return Structure.sdof(1.0, 1.5) + DelayedForce(-0.25, tau=2 * np.pi, at=GROUND)


# The field: parametric and rotating, more than one degree of freedom


def mathieu() -> Structure:
    """Damped Mathieu oscillator at its principal resonance, ẍ + 0.1 ẋ + (1 + 0.15 cos 2t) x = g, dimensionless.

    Stable: to first order a pulsation dk > 2 c = 0.2 is needed for growth, at the rate dk/4 - c/2.

    References
    ----------
    A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, Wiley (1979), ch. 5.
    """
    return Structure.sdof(1.0, 1.0, 0.1) + ParametricStiffness(0.15, omega=2.0, phase=0.0, at=GROUND)


def rotor() -> Structure:
    """Unbalanced disc on a light shaft (Jeffcott rotor), seen from the side: x in degree of freedom 1, y in 2.

    m = 10 kg, k = 4e4 N/m, c = 40 N s/m both ways: 63.2 rad/s, ζ = 0.0316. Eccentricity 0.1 mm, speed 50 rad/s. It
    whirls in a circle of radius e r²/√((1 - r²)² + (2 ζ r)²), r = 50/63.2.

    References
    ----------
    H. H. Jeffcott, Phil. Mag. 37 (1919) 304-314.
    """
    mass, stiffness, damping, eccentricity, speed = 10.0, 4e4, 40.0, 1e-4, 50.0
    unbalance = mass * eccentricity * speed**2
    springs = [LinearStiffness(stiffness, at=(0, j)) for j in (1, 2)]
    dampers = [LinearDamping(damping, at=(0, j)) for j in (1, 2)]
    loads = [PeriodicDisturbance(unbalance, speed, phase, at=(0, j)) for j, phase in ((1, 0.0), (2, -np.pi / 2))]
    return Structure([mass, mass], [*springs, *dampers, *loads])


def duffing_pair() -> Structure:
    """Two Duffing oscillators joined by a cubic spring, ẍ₁ + 0.1 ẋ₁ + x₁ + x₁³ + 0.5 (x₁ - x₂)³ = g₁, dimensionless.

    Two motions are those of one oscillator: x₁ = x₂ with the cubic stiffness 1, x₁ = -x₂ with 1 + 8·0.5 = 5.
    """
    laws = (LinearStiffness, 1.0), (LinearDamping, 0.1), (CubicStiffness, 1.0)
    alone = [law(value, at=(0, j)) for j in (1, 2) for law, value in laws]
    return Structure([1.0, 1.0], [*alone, CubicStiffness(0.5, at=(1, 2))])


def normal_modes() -> Structure:
    """The usual example of nonlinear normal modes, ẍ₁ + 2 x₁ - x₂ + 0.5 x₁³ = 0, ẍ₂ + 2 x₂ - x₁ = 0, dimensionless.

    Undamped; 1 and √3 rad/s for small motion.

    References
    ----------
    G. Kerschen, M. Peeters, J. C. Golinval, A. F. Vakakis, Mech. Syst. Signal Process. 23 (2009) 170-194.
    """
    springs = [LinearStiffness(1.0, at=at) for at in ((0, 1), (1, 2), (0, 2))]
    return Structure([1.0, 1.0], springs) + CubicStiffness(0.5, at=GROUND)


def wing_section() -> Structure:
    """Wing section in still air with free play in pitch: plunge [m] in degree of freedom 1, pitch [rad] in 2.

    Mass 2 kg, static moment 0.05 kg m, inertia 0.01 kg m²; plunge 800 N/m, pitch 9 N m/rad beyond ±0.02 rad (none
    within), both lightly damped. It rests at any pitch within the play. Forces of the flow act on plunge by the pitch
    but not the other way round; no term of a link does that.
    """
    springs = [LinearStiffness(800.0, at=(0, 1)), EndStop(9.0, gap=0.02, at=(0, 2))]
    dampers = [LinearDamping(0.8, at=(0, 1)), LinearDamping(0.006, at=(0, 2))]
    return Structure([[2.0, 0.05], [0.05, 0.01]], [*springs, *dampers])


def _table(*systems: Callable[[], Structure]) -> dict[str, Callable[[], Structure]]:
    return {system.__name__: system for system in systems}


PAPER = _table(
    *(linear, duffing, negative_duffing, van_der_pol, frame, cubic_chain),
    *(bilinear, coulomb, bilinear_coulomb, cubic_coulomb_chain, kinked_spring),
)
"""The paper's systems by name."""

FIELD = _table(
    *(softening_duffing, holmes, ueda, helmholtz, rayleigh, silverbox, pendulum, end_stops),
    *(stribeck, emps, lugre, bouc_wen, jenkins, iwan, zener, tuned_mass_damper, delayed),
    *(mathieu, rotor, duffing_pair, normal_modes, wing_section),
)
"""The field's systems by name."""

ALL = PAPER | FIELD
"""Every system by name; all can move but `kinked_spring`, which has no mass."""

EXAMPLES: dict[str, Callable[[ArrayLike], np.ndarray]] = {
    "example_1": example_1,
    "example_2": example_2,
    "example_3": example_3,
}
"""The forces with jumps and kinks of the paper's section 2.3, as functions of the displacement."""
