"""What all tests share."""

import os

from hypothesis import settings

# A busy machine must not turn a slow example into a failure.
settings.register_profile("farfield", deadline=None)
settings.register_profile("soak", max_examples=5000, deadline=None)
settings.load_profile("soak" if os.environ.get("FARFIELD_SOAK") == "1" else "farfield")
