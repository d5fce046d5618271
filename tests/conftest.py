"""What tests leave behind stays away from the user's own: journals, references, histories."""

import os
import tempfile

os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="cdhr-tests-")
