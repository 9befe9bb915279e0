"""Table 1, Figures 7 to 13 and one self-contained page, from results alone."""
