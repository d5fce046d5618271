"""The size budget: short functions, short files."""

from statistics import median

from looking import dotted, functions, length, modules, python_files


def test_no_function_is_longer_than_sixty_lines() -> None:
    long = {
        f"{path}:{function.name}": length(function)
        for path in python_files()
        for function in functions(path)
        if length(function) > 60
    }
    assert not long


def test_the_median_function_is_short() -> None:
    lengths = [length(function) for path in modules() for function in functions(path)]
    assert median(lengths) < 10


def test_files_stay_under_four_hundred_lines() -> None:
    sizes = {str(path): len(path.read_text(encoding="utf-8").splitlines()) for path in python_files()}
    assert not {path: lines for path, lines in sizes.items() if lines >= 400}


def test_modules_are_named_for_what_they_hold() -> None:
    vague = {"utils", "util", "helpers", "helper", "misc", "common", "tools"}
    assert not [path for path in modules() if set(dotted(path).split(".")) & vague]
