"""`python -m afferents`."""

from afferents.cli import main

main()
