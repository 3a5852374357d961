"""What is declared of a figure."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Figure:
    """One figure. `digits` are significant ones; None leaves the text as its source has it."""

    id: str
    what: str
    unit: str
    source: object
    rooms: tuple = ()
    bar: str = ""
    digits: int | None = None
