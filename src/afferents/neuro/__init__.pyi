from .decoding import (
    accuracy_by_resolution as accuracy_by_resolution,
)
from .decoding import (
    accuracy_by_units as accuracy_by_units,
)
from .decoding import (
    cut_windows as cut_windows,
)
from .decoding import (
    decode as decode,
)
from .decoding import (
    some_units as some_units,
)
from .distances import (
    DISTANCES as DISTANCES,
)
from .distances import (
    distance_matrix as distance_matrix,
)
from .distances import (
    found_by_nearest as found_by_nearest,
)
from .exponent import (
    accuracy_by_exponent as accuracy_by_exponent,
)
from .exponent import (
    exponents as exponents,
)
from .exponent import (
    spectral_exponent as spectral_exponent,
)
from .gaps import (
    left_out as left_out,
)
from .gaps import (
    without_gaps as without_gaps,
)
from .matching import (
    matched as matched,
)
from .natural import (
    described_natural as described_natural,
)
from .neo import (
    from_neo as from_neo,
)
from .neo import (
    to_neo as to_neo,
)
from .speed import (
    rate_slopes as rate_slopes,
)
from .speed import (
    stretch_match as stretch_match,
)
