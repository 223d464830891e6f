"""Types of a record's fields, each with its range, and how an object becomes a record.

Documents are read in strict mode, where no text is a number; tables, which are texts, are not.
"""

import re
from typing import Annotated, Literal, TypeVar

from pydantic import AfterValidator, AliasPath, BeforeValidator, Field, TypeAdapter
from pydantic_core import core_schema

MOST = 10**15  # of what is counted; a double has more digits
LARGEST = 1e300  # of numbers; what is made of them stays a number


def checked_scene(scene: str) -> str:
    if not re.fullmatch(r".+:[0-9]{1,9}", scene):
        raise ValueError(f"{scene!r} is not NAME:NV")
    return scene


def scene_name(scene: str) -> str:
    return scene.rsplit(":", 1)[0]


def scene_size(scene: str) -> int:
    return int(scene.rsplit(":", 1)[1])


SceneName = Annotated[str, AfterValidator(checked_scene)]
Count = Annotated[int, Field(ge=0, le=MOST)]
Whole = Annotated[int, Field(ge=1, le=MOST)]
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
Size = Annotated[float, Field(ge=0, le=LARGEST)]
Positive = Annotated[float, Field(gt=0, le=LARGEST)]
Effort = Annotated[float, Field(ge=1e-3, le=LARGEST)]
Name = Annotated[str, Field(min_length=1)]
Precision = Literal["float32", "float64"]
Sha1 = Annotated[str, Field(pattern="^[0-9a-f]{40}$")]

Of = TypeVar("Of")
# What stands in a cell; None if it is empty.
Maybe = Annotated[Of | None, BeforeValidator(lambda cell: cell or None)]


def at(*path: str, **more):
    """Of a field that stands elsewhere in its object than its name says."""
    return Field(validation_alias=AliasPath(*path), **more)


def record(kind: type, others: bool = True) -> type:
    """Makes a NamedTuple be read from an object, whose other keys are left alone. `checked`, where
    it has such a method, looks at all fields together and returns what is read."""

    def schema(cls, source, handler):
        own = handler(source)
        keys = {field.get("validation_alias", [field["name"]])[0] for field in own["fields"]}

        def known(value) -> dict:
            if not isinstance(value, dict):
                raise ValueError(f"{value!r} is no object")
            return {key: value[key] for key in keys & value.keys()} if others else value

        checked = getattr(cls, "checked", lambda read: read)
        ref = own.pop("ref")  # by which it is known where it occurs again
        found = core_schema.no_info_before_validator_function(known, own)
        return core_schema.no_info_after_validator_function(checked, found, ref=ref)

    kind.__get_pydantic_core_schema__ = classmethod(schema)
    return kind


def exact(kind: type) -> type:
    """The same where no other key may be: what is not known would be lost in a merge."""
    return record(kind, others=False)


def reading(kind, strict: bool = True):
    """What makes such a record of a document, or of a row; ValidationError if it is none."""
    adapter = TypeAdapter(kind)
    return lambda value: adapter.validate_python(value, strict=strict)
