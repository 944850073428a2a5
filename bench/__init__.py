"""Every figure that Farfield quotes, one command each: `python -m bench.NAME --json`."""
