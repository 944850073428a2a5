"""The demo scene, written by our own code: a city in a lake, in the spirit of Tenochtitlan.

`city.write_city` writes it; `corridors/avenue.json` leads down the avenue towards the great temple,
eleven cells of 14 m, `corridors/street.json` along a narrow street, six cells.
"""
