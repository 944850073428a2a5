"""What all tests share."""

import os

from hypothesis import settings

settings.register_profile("soak", max_examples=5000, deadline=None)
if os.environ.get("FARFIELD_SOAK") == "1":
    settings.load_profile("soak")
