import numpy as np
import pytest

from afferents.rig import Rig, bumped_surface, simulate


@pytest.fixture(scope="session")
def quiet_rig():
    """The rig with every nuisance off."""
    return Rig().with_nuisances({})


@pytest.fixture(scope="session")
def quiet_run(quiet_rig):
    """Two seconds of g at 50 mm/s, nothing disturbed."""
    return simulate(quiet_rig, "3", bumped_surface(3.0, quiet_rig.drum), 50.0, 2.0, seed=0)


@pytest.fixture(scope="session")
def run():
    """Two seconds of g at 50 mm/s as they come."""
    return simulate(Rig(), "3", bumped_surface(3.0), 50.0, 2.0, seed=0)


@pytest.fixture
def rng():
    return np.random.default_rng(0)
