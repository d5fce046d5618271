from functools import cache

from cdhr_host.profile import Profile, find, read_table, validate


@cache
def profile_of(name: str) -> Profile:
    profile, problems = validate(read_table(find(name)))
    assert problems == []
    assert profile is not None
    return profile
