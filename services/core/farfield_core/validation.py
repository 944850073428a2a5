"""Documents from outside into models, every complaint in one sentence."""

from __future__ import annotations

from typing import Annotated, Any, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    GetJsonSchemaHandler,
    Strict,
    ValidationError,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema

from farfield_core.errors import BadInputError

M = TypeVar("M", bound=BaseModel)

#: numbers and truth values as JSON has them: "5" is no number, and 1 is not true
Number = Annotated[float, Strict()]
Flag = Annotated[bool, Strict()]


def _no_text(value: object) -> object:
    if isinstance(value, str | bool):
        raise ValueError("input should be a whole number")
    return value


#: the same for int, where JSON Schema takes 5.0 for a whole number; goes after all bounds
WHOLE = BeforeValidator(_no_text)


class Alike:
    """Has a tuple's items, all of one kind, described once: fewer tools know `prefixItems`."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        found = handler(schema)
        if "prefixItems" in found:  # a validator before it may let in something else besides
            found["items"] = found.pop("prefixItems")[0]
        return found


def explain(error: ValidationError, what: str) -> str:
    """One sentence about the first thing wrong with `what`."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    message = first["msg"].removeprefix("Value error, ").rstrip(".")
    more = error.error_count() - 1
    rest = f" (and {more} more)" if more else ""
    return f"{what}: {place}: {message}{rest}." if place else f"{what}: {message}{rest}."


def parse(model: type[M], data: bytes | str | dict[str, Any], what: str) -> M:
    """Read `data`, JSON text or its content, as `model`; raises BadInputError naming `what`."""
    try:
        if isinstance(data, dict):
            return model.model_validate(data)
        return model.model_validate_json(data)
    except ValidationError as error:
        raise BadInputError(explain(error, what)) from None
