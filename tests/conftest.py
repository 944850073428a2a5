"""What all tests share."""

import os
import signal

from hypothesis import settings

# A busy machine must not turn a slow example into a failure.
settings.register_profile("farfield", deadline=None)
settings.register_profile("soak", max_examples=5000, deadline=None)
settings.load_profile("soak" if os.environ.get("FARFIELD_SOAK") == "1" else "farfield")

# A shell starts background jobs with interrupts ignored; so would be the commands that tests start.
signal.signal(signal.SIGINT, signal.default_int_handler)
