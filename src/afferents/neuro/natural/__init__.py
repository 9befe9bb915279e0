"""Natural afferents: recordings of nerve fibres, from MATLAB, NWB and tables."""
