"""One profile of hypothesis for the gate: the same examples each time. Look for new ones now and then with
HYPOTHESIS_PROFILE=explore."""

import os

from hypothesis import settings

settings.register_profile("gate", derandomize=True, deadline=None)
settings.register_profile("explore", deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "gate"))
