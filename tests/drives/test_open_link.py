import pytest
from trajectories import PAPER

from cdhr_host.drives import LinkState, PacedClock, open_link
from cdhr_host.errors import DriveError, ProfileError


def _open(url):
    return open_link(url, PAPER, PacedClock(float("inf")))


def test_loopback_is_opened():
    assert _open("loopback:").state is LinkState.OPEN


@pytest.mark.parametrize("url", ["slcan:", "slcan:@1000000", "slcan:/dev/null@fast", "link:", "link:/dev/x@"])
def test_paths_and_rates_are_checked_before_anything_is_started(url):
    with pytest.raises(DriveError, match=r"are not (slcan|link):PATH"):
        _open(url)


@pytest.mark.parametrize(
    ("url", "hint"),
    [
        ("loopbak:", "did you mean loopback:?"),
        ("loopback", "did you mean loopback:?"),
        ("SLCAN:/dev/x", "did you mean slcan:PATH@BITRATE?"),
        ("quux:1", "known are loopback:, slcan:PATH@BITRATE"),
        ("", "known are loopback:"),
    ],
)
def test_unknown_links_are_refused_with_the_nearest(url, hint):
    with pytest.raises(DriveError, match="are not known") as caught:
        _open(url)
    assert caught.value.problems[0].hint.startswith(hint)


def test_a_bus_that_would_be_too_full_is_refused_before_anything_is_started():
    with pytest.raises(ProfileError, match=r"worst case \(limit 70%\) at 250 kbit/s") as caught:
        _open("slcan:/dev/null@250000")
    assert caught.value.problems[0].limit == 70.0
    busy = PAPER.model_copy(update={"drives": PAPER.drives.model_copy(update={"period": 0.001})})
    with pytest.raises(ProfileError, match="at 1000 kbit/s"):
        open_link("socketcan:can0", busy, PacedClock(float("inf")))


def test_loopback_takes_nothing():
    with pytest.raises(DriveError, match="takes nothing"):
        _open("loopback:fast")
