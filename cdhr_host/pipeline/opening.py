"""A profile ready for use: read, validated, and free of contradictions."""

from collections.abc import Iterator

from cdhr_host.errors import MotionError, Problem, ProfileError
from cdhr_host.extrusion import clay_findings
from cdhr_host.mechanism import inconsistencies
from cdhr_host.pipeline.rig import Rig
from cdhr_host.profile import Profile, described, find, read_table, validate, with_material


def open_profile(name_or_path: str, material: str | None = None) -> Profile:
    """The profile of a name or path; raises ProfileError with every problem of it at once.

    ``material`` names the clay in place of the profile's own.
    """
    profile, problems = check_profile(name_or_path, material)
    if problems:
        raise ProfileError(problems)
    return profile


def check_profile(name_or_path: str, material: str | None = None) -> tuple[Profile, list[Problem]]:
    """A profile and all its problems; not to be used while it has any.

    Contradictions are looked for even where some keys are bad, except those that rely on a
    bad key. Raises ProfileError when there is no such profile or it is not TOML.
    """
    table, wrong_material = with_material(read_table(find(name_or_path)), material)
    profile, problems = validate(table)
    problems += wrong_material
    bad = {problem.key for problem in problems}
    sections = {key for key in bad if key and "." not in key}
    for keys, problem in _contradictions(profile):
        relies_on_bad = keys & bad or {key.split(".")[0] for key in keys} & sections
        if not relies_on_bad:
            problems.append(problem)
    return profile, problems


def _contradictions(profile: Profile) -> Iterator[tuple[frozenset[str], Problem]]:
    found = [*inconsistencies(profile), *clay_findings(profile)]
    yield from found
    if found:
        return
    try:
        Rig.from_profile(profile).limits()
    except MotionError as error:
        sections = ("limits", "sliders", "path", "spring")
        keys = frozenset(f"{section}.{key}" for section, key, *_ in described(profile) if section in sections)
        yield keys, error.problems[0]
