"""``python -m cornersmooth``."""

from cornersmooth.cli import main

main()
