"""What comes with a call by name, checked: TypeError and KeyError name the parameter that is wrong."""

from typing import Any

Params = dict[str, Any]
Fields = dict[str, list[str] | None]
"""of each object the fields that are wanted; None wants all"""
OBJECTS_MAX = 200


def fields_of(params: Params) -> Fields:
    """``{"objects": {"toolhead": ["position"], "print_stats": null}}``."""
    found = params["objects"]
    if not isinstance(found, dict) or len(found) > OBJECTS_MAX:
        raise TypeError("objects")
    return {str(name): None if keys is None else [str(key) for key in keys] for name, keys in found.items()}


def text_of(params: Params, name: str) -> str:
    """A parameter that must be a text."""
    value = params[name]
    if not isinstance(value, str):
        raise TypeError(name)
    return value
