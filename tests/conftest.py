"""Settings and fixtures of the whole suite: double precision, no silent broadcasting across ranks, seeded keys."""

import os
from collections.abc import Iterator
from pathlib import Path

import jax
import pytest
from checker import CHECKED
from jaxtyping import Array, Key, install_import_hook

install_import_hook(CHECKED, "checker.checked")  # before the first module of jfsm is imported

from jfsm._programs import make_room  # noqa: E402
from jfsm._traced import clear_programs  # noqa: E402

MOST_MAPS = 25_000
MOST_KEPT = 2_000_000_000

jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")


def pytest_configure(config: pytest.Config) -> None:
    """One store of compiled programs for all processes and for the next run, one thread of linear algebra for each."""
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    chosen = "JAX_COMPILATION_CACHE_DIR" in os.environ or hasattr(config, "workerinput")
    if chosen or not config.pluginmanager.hasplugin("cacheprovider"):
        return
    store = config.cache.mkdir("programs")
    make_room(store, MOST_KEPT)
    kept = {"jax_compilation_cache_dir": str(store), "jax_persistent_cache_min_compile_time_secs": 0.2}
    for name, value in kept.items():
        os.environ[name.upper()] = str(value)  # for the processes that are started
        jax.config.update(name, value)


@pytest.fixture(autouse=True, scope="module")
def programs() -> Iterator[None]:
    """Compiled programs go before they fill the process's table of memory maps: at 65 530 of them Linux ends it."""
    yield
    maps = Path("/proc/self/maps")
    if maps.exists() and maps.read_bytes().count(b"\n") > MOST_MAPS:
        clear_programs()
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
