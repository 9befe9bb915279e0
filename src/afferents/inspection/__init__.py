"""Looking at recordings before anything is learnt: what is in them, and whether they are sound."""
