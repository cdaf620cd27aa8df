"""Settings and fixtures of the whole suite: double precision, no silent broadcasting across ranks, seeded keys."""

import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from jaxtyping import Array, Key

MOST_MAPS = 25_000

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")


def pytest_configure(config: pytest.Config) -> None:
    """One store of compiled programs for all processes of a run, and one thread of linear algebra for each."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    if "JAX_COMPILATION_CACHE_DIR" not in os.environ and not hasattr(config, "workerinput"):
        store = tempfile.TemporaryDirectory(prefix="jfsm-programs-")
        os.environ["JAX_COMPILATION_CACHE_DIR"] = store.name
        os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0.2")
        config.add_cleanup(store.cleanup)


@pytest.fixture(autouse=True, scope="module")
def programs() -> Iterator[None]:
    """Compiled programs go before they fill the process's table of memory maps: at 65 530 of them Linux ends it."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        jax.clear_caches()


@pytest.fixture
def key() -> Key[Array, ""]:
    """Source of randomness, the same in every run."""
    return jax.random.key(20070423)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of measured records: ``JFSM_DATA``, or ``../shared/data`` beside the checkout."""
    default = Path(__file__).resolve().parents[2] / "shared" / "data"
    folder = Path(os.environ.get("JFSM_DATA", default))
    if folder.is_dir():
        return folder
    message = f"measured records are missing: {folder} is not a folder; set JFSM_DATA to where they are"
    if os.environ.get("CI") == "true":
        pytest.fail(message)
    pytest.skip(message)
