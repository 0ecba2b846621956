"""The base of answers, and the rounding of figures that are sent."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict

from app.survey import rounding


class Out(BaseModel):
    """An answer, made of objects that have attributes of the same names."""

    model_config = ConfigDict(from_attributes=True, validate_by_name=True)

    @classmethod
    def read_from(cls, *sources: object, **stated: Any) -> Self:
        """Take each field from `stated`, else from the first source that has it."""
        found = stated
        for name, field in cls.model_fields.items():
            attribute = str(field.validation_alias or name)
            source = next((one for one in sources if hasattr(one, attribute)), None)
            if name not in stated and source is not None:
                found[name] = getattr(source, attribute)
        return cls.model_validate(found)


def rounded_to(digits: int) -> AfterValidator:
    """Round a field to a number of decimals."""
    return AfterValidator(lambda value: rounding.rounded(value, digits))


Tenths = Annotated[float, rounded_to(1)]
Hundredths = Annotated[float, rounded_to(2)]
Thousandths = Annotated[float, rounded_to(3)]


def metres(mm: float | None) -> float | None:
    """Round a distance for publication, to the millimetre."""
    return None if mm is None else rounding.metres(mm)
