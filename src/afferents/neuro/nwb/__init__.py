"""An extracted store as a file of Neurodata Without Borders (NWB)."""
