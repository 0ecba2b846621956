"""What the file beside a user's model declares: how pictures go in, and what comes out."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

import yaml
from pydantic import Field, StringConstraints, ValidationError, model_validator

from app.errors import InvalidDetector
from app.survey.given import CodeName, Given, Letter, PackName

MOST_CHARACTERS = 20_000
"""Longest declaration."""
_MOST_CLASSES = 100
_SHOWN_FAULTS = 10

_Side = Annotated[int, Field(ge=32, le=2048)]
_Channels = Annotated[
    list[Annotated[float, Field(ge=-1000, le=1000)]], Field(min_length=1, max_length=3)
]


FindingKind = Annotated[str, StringConstraints(pattern=r"^[a-z][a-z0-9_]{0,39}$")]


class FindingCode(Given):
    """The code that a proposal starts from."""

    code: CodeName | None = Field(
        None, description="Code to start from; without it that of the kind"
    )
    char1: Letter | None = None
    char2: Letter | None = None


class DetectedClass(FindingCode):
    """A class of a model; without a kind it is the background, and proposes nothing."""

    kind: FindingKind | None = Field(
        None, description="crack, joint_open, joint_displaced, hole, spall, deposit, roots, water, "
        "stain, or a kind of its own; null for the background",
    )  # fmt: skip


class Declaration(Given):
    """A declaration."""

    name: PackName = Field(description="What people call the model")
    task: Literal["detect", "segment"]
    input: Annotated[list[_Side], Field(min_length=2, max_length=2)] = Field(
        description="[width, height] of its input, px"
    )
    mm_per_px: Annotated[float, Field(ge=0.1, le=20)] = Field(
        description="Size of a pixel on the wall that it was trained for"
    )
    overlap: Annotated[float, Field(ge=0, le=0.5)] = Field(
        0.2, description="Share of the input by which neighbouring tiles overlap"
    )
    colours: Literal["rgb", "bgr", "grey"] = "rgb"
    mean: _Channels = Field(
        default=[0.0], description="Subtracted from 0..255 of each channel; one number for all"
    )
    scale: _Channels = Field(
        default=[1 / 255], description="Then multiplied; one number for all channels"
    )
    output: Literal["rows", "columns", "logits", "probabilities", "labels"] = Field(
        description="detect: rows [1, N, C] or columns [1, C, N] of boxes; segment: logits or "
        "probabilities [1, C, H, W], or labels [1, H, W]"
    )
    boxes: Literal["px", "share"] = Field(
        "px", description="detect: cx, cy, w, h in px of the input, or as its share"
    )
    objectness: bool = Field(
        False, description="detect: whether the fifth value is that of any object"
    )
    threshold: Annotated[float, Field(ge=0.01, le=0.999)] = Field(
        0.5, description="Least score of a proposal"
    )
    least_mm: Annotated[float, Field(ge=0, le=10_000)] = Field(
        20.0, description="Smaller regions are left out"
    )
    classes: Annotated[list[DetectedClass], Field(min_length=1, max_length=_MOST_CLASSES)] = Field(
        description="In the order of the model's output"
    )

    @model_validator(mode="after")
    def _fits(self) -> Self:
        boxes = ("rows", "columns")
        if (self.output in boxes) != (self.task == "detect"):
            raise ValueError(f"output {self.output} is not one of a model that {self.task}s")
        channels = 1 if self.colours == "grey" else 3
        for name in ("mean", "scale"):
            if len(getattr(self, name)) not in (1, channels):
                raise ValueError(f"{name} has another number of values than there are channels")
        kinds = [each.kind for each in self.classes if each.kind]
        if len(set(kinds)) != len(kinds):
            raise ValueError("two classes have the same kind")
        if not kinds:
            raise ValueError("no class has a kind, so the model would propose nothing")
        return self


def read_declaration(text: str) -> Declaration:
    """Read a declaration in YAML or JSON.

    Raises:
        InvalidDetector: The text names the faults.
    """
    if len(text) > MOST_CHARACTERS:
        raise InvalidDetector(f"The declaration may have {MOST_CHARACTERS} characters.")
    try:
        values: Any = yaml.load(text, _Loader)  # noqa: S506  (it is a safe one)
        return Declaration.model_validate(values)
    except (yaml.YAMLError, RecursionError, ValueError) as error:
        if isinstance(error, ValidationError):
            raise InvalidDetector(f"The declaration: {_reasons(error)}.") from error
        raise InvalidDetector(f"The declaration is neither YAML nor JSON: {error}") from error


class _Loader(yaml.SafeLoader):
    """Refuses aliases: a few of them stand for billions of values."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("aliases are not allowed.")
        return super().compose_node(parent, index)


def _reasons(error: ValidationError) -> str:
    found = [
        f"{'.'.join(map(str, fault['loc'])) or 'the whole'}: "
        f"{fault['msg'].removeprefix('Value error, ')}"
        for fault in error.errors(include_url=False, include_input=False)
    ]
    more = [f"and {len(found) - _SHOWN_FAULTS} more"] if len(found) > _SHOWN_FAULTS else []
    return "; ".join([*found[:_SHOWN_FAULTS], *more])
