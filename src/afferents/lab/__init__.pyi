from . import devices as devices
from . import live as live
from . import recorder as recorder
