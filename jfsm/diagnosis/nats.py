"""Gains in log-evidence in words."""

MOST = 10_000
"""Nats of a gain beyond which more of them tell nothing more."""


def shown(nats: float) -> str:
    """A number of nats, to be compared with another one."""
    return f"{nats:,.0f}" if abs(nats) >= 100 else f"{nats:.3g}"


def many(nats: float) -> str:
    """A number of nats as far as more of them tell anything."""
    return f"more than {MOST:,}" if nats > MOST else shown(nats)


def gains(nats: float) -> str:
    """A gain, or a loss."""
    return f"{'loses' if nats < 0 else 'gains'} {many(abs(nats))} nats"
