EXAMPLES = ""


def jog() -> None: ...
