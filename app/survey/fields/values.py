"""Values of the header as people write them in tables and file names."""

from __future__ import annotations

import re

from app.survey.fields.declaration import Value
from app.survey.fields.header import BY_NAME, HeaderField, faults

_SHORT_DATE = re.compile(r"([0-9]{4})[-_.]?([0-9]{2})[-_.]?([0-9]{2})")
_BOOLS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


class InvalidValue(ValueError):
    """The text is not a value of the field; the message names both."""


def value_of(name: str, text: str) -> Value:
    """Return the value of a known field that a text states.

    Numbers may have a decimal comma; a date may lack its hyphens; the case of a choice does not
    matter, and another word for it will do.

    Raises:
        InvalidValue: The text does not fit the field.
    """
    value = _read(BY_NAME[name], text.strip())
    if found := faults({name: value}):
        raise InvalidValue(found[0])
    return value


def _read(field: HeaderField, text: str) -> Value:
    match field.kind:
        case "number":
            try:
                number = float(text.replace(",", "."))
            except ValueError:
                return text
            return int(number) if number.is_integer() else number
        case "choice":
            tidy = text.lower().replace(" ", "_").replace("-", "_")
            meaning = field.values.meaning_of(text) if field.values else None
            return tidy if tidy in field.choices or meaning is None else str(meaning.value)
        case "bool":
            return _BOOLS.get(text.lower(), text)
        case "date":
            found = _SHORT_DATE.fullmatch(text)
            return "-".join(found.groups()) if found else text
        case _:
            return text
