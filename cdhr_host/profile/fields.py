"""How a profile's field is declared: name with unit, bounds in the file's unit, value in SI."""

from typing import Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from cdhr_host.units import DEG, KPA, MM, MM3, MS, N_MM


def key(name: str, text: str, **bounds: Any) -> Any:
    """The file's key for a field, with its description and its bounds in the file's unit."""
    return Field(alias=name, description=text, **bounds)


def to_si(factor: float) -> AfterValidator:
    """Marker that turns a validated number of the file into SI."""
    return AfterValidator(lambda value: value * factor)


IN_MM = to_si(MM)
IN_MM3 = to_si(MM3)
IN_N_MM = to_si(N_MM)
IN_DEG = to_si(DEG)
IN_KPA = to_si(KPA)
IN_MS = to_si(MS)
IN_KPA_S_MM3 = to_si(KPA / MM3)
IN_MM3_KPA = to_si(MM3 / KPA)


class Section(BaseModel):
    """Base of all sections: unknown keys, other types and infinities are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
