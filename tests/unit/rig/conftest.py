import numpy as np
import pytest

from afferents.rig import Rig, bumped_surface
from afferents.rig.run import simulate_run


def changed(rig, part, **values):
    """Return a rig with other constants of a part, such as its mounting."""
    return rig.model_copy(update={part: getattr(rig, part).model_copy(update=values)})


@pytest.fixture(scope="session")
def quiet_rig():
    """The rig with every nuisance off."""
    return Rig().with_nuisances({})


@pytest.fixture(scope="session")
def quiet_run(quiet_rig):
    """Two seconds of g at 50 mm/s, nothing disturbed."""
    return simulate_run(quiet_rig, "3", bumped_surface(3.0, quiet_rig.drum), 50.0, 2.0, seed=0)


@pytest.fixture(scope="session")
def lifted_run(quiet_rig):
    """The same, but that the drum is brought on after the rest frames."""
    rig = changed(quiet_rig, "mounting", contact_at_rest=False)
    return simulate_run(rig, "3", bumped_surface(3.0, rig.drum), 50.0, 2.0, seed=0)


@pytest.fixture(scope="session")
def run():
    """Two seconds of g at 50 mm/s as they come."""
    return simulate_run(Rig(), "3", bumped_surface(3.0), 50.0, 2.0, seed=0)


@pytest.fixture
def rng():
    return np.random.default_rng(0)
