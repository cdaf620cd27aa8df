"""Names of the classes of laws: what a verdict can be sure of where it cannot tell the law."""

PLAY = "a spring with play or a stop"
FRICTION = "dry friction"
HYSTERESIS = "a spring that yields"
HARDENING = "a hardening spring"
SOFTENING = "a softening spring"
TWO_SIDED = "a spring that differs between its two sides"
FASTER = "damping that grows faster than speed"
TWO_WAYS = "damping that differs between the two directions"
AMPLITUDE = "damping that grows with amplitude"
LINK = "a link that the model lacks"
SPRING = "a nonlinear spring"
DAMPING = "nonlinear damping"
MEMORY = "a force with memory"
CHANGING_STIFFNESS = "a stiffness that changes with time"
CHANGE = "a change with time"
LOAD = "an unmeasured load"
RIPPLE = "a force that repeats with position"
DELAY = "a delay between sensors"
SENSOR = "a fault of a sensor"
DRIVE = "a drive that does not do what it is told"

NARROWEST_FIRST = (
    LINK, RIPPLE, PLAY, FRICTION, HYSTERESIS, HARDENING, SOFTENING, TWO_SIDED, FASTER, TWO_WAYS, AMPLITUDE,
    CHANGING_STIFFNESS, DELAY, SPRING, DAMPING, MEMORY, CHANGE, LOAD, SENSOR, DRIVE,
)  # fmt: skip
"""Every class, by how much it says."""
