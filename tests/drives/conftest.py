import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from links import LINKS


@pytest.fixture(params=LINKS)
def far(request):
    link, clock = LINKS[request.param]()
    yield link, clock
    link.close()
    if hasattr(link, "bench"):
        link.bench.close()
