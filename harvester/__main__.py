"""``python -m harvester`` is the program ``harvester``."""

from harvester.cli import main

main()
