from .decoding import (
    accuracy_by_resolution as accuracy_by_resolution,
    accuracy_by_units as accuracy_by_units,
    cut_windows as cut_windows,
    decode as decode,
    some_units as some_units,
)
from .distances import (
    DISTANCES as DISTANCES,
    distance_matrix as distance_matrix,
    found_by_nearest as found_by_nearest,
)
from .exponent import (
    accuracy_by_exponent as accuracy_by_exponent,
    exponents as exponents,
    spectral_exponent as spectral_exponent,
)
from .matching import left_out as left_out, matched as matched, without_gaps as without_gaps
from .natural import described_natural as described_natural
from .neo import from_neo as from_neo, to_neo as to_neo
from .speed import rate_slopes as rate_slopes, stretch_match as stretch_match
