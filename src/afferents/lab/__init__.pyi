from . import devices as devices, live as live, recorder as recorder
