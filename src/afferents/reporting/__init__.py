"""Table 1, Figures 7 to 13 and the report's page, from results alone."""
