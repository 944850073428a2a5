"""The demo scene, written by our own code: a city in a lake, in the spirit of Tenochtitlan.

`city.write_city` writes it; `corridors/avenue.json` leads down the avenue towards the great temple,
eleven cells of 14 m, `corridors/street.json` along a narrow street, six cells.
"""

from pathlib import Path

#: corridor file of a walk down the great avenue, and the edge of the cells it is meant for, metres
AVENUE = Path(__file__).parent / "corridors" / "avenue.json"
CELL_SIZE = 14.0
