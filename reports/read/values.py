"""Values of a record, each of its type and within its range; else ValueError with the value."""

MOST = 10**15  # of what is counted; a double has more digits
LARGEST = 1e300  # of numbers; what is made of them stays a number


def text(value) -> str:
    if not isinstance(value, str):
        raise ValueError(f"{value!r} is no text")
    return value


def number(name: str, value, least: float = -LARGEST) -> float:
    known = isinstance(value, (int, float)) and not isinstance(value, bool)
    if not (known and least <= value <= LARGEST):
        raise ValueError(f"{name} is {value!r}")
    return float(value)


def optional(name: str, value, least: float = -LARGEST) -> float | None:
    return None if value is None else number(name, value, least)


def count(name: str, value) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= MOST:
        raise ValueError(f"{name} is {value!r}")
    return value


def count_in(row: dict, name: str) -> int:
    """Of a row of texts."""
    return count(name, int(row[name]))


def number_in(row: dict, name: str, least: float = -LARGEST) -> float:
    return number(name, float(row[name]), least)
