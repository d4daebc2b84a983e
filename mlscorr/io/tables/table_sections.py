"""What survey.toml may state of control lists and of the columns of tables."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from mlscorr.io.store import Column, Coordinate, Positive, TomlSection
from mlscorr.io.tables.column_names import OfficeWord, same_word


class ColumnsSection(TomlSection):
    """Our names of columns with those in a table, or with their numbers from 1."""

    @model_validator(mode="after")
    def _are_of_one_kind(self) -> Self:
        if len({type(column) for column in self.chosen.values()}) > 1:
            raise ValueError("give names of columns or numbers of columns, not both")
        return self

    @property
    def chosen(self) -> dict[str, str | int]:
        """Those that are given."""
        return {name: column for name, column in self if column is not None}


class PlaceColumns(ColumnsSection):
    """Which column of a place is what."""

    easting: Column = None
    northing: Column = None
    height: Column = None


class ControlColumns(PlaceColumns):
    """Which column of a control list is what."""

    name: Column = None
    sigma: Column = None
    sigma_horizontal: Column = None
    sigma_vertical: Column = None
    kind: Column = None
    size: Column = None
    role: Column = None


class ControlSection(TomlSection):
    """The file of the surveyed points, and what all of them are where it does not say so."""

    file: str
    kind: str | None = None
    size: Positive | None = None  # m
    sigma: Annotated[list[Positive], Field(min_length=2, max_length=2)] | None = None  # m: E/N, H
    check: list[str] = Field(default_factory=list)  # names of check points, or patterns
    words: dict[str, str] = Field(default_factory=dict)  # of an office: to "circle 0.6", "check"
    columns: ControlColumns = ControlColumns()
    # By what eastings and northings are multiplied; "ground": by the map's own factor there
    scale_factor: Annotated[float, Field(ge=0.99, le=1.01)] | Literal["ground"] | None = None
    scale_origin: Annotated[list[Coordinate], Field(min_length=2, max_length=2)] | None = None  # m

    @model_validator(mode="after")
    def _scales_about_an_origin(self) -> Self:
        if self.scale_origin is not None and self.scale_factor is None:
            raise ValueError('scale_origin needs a scale_factor: a number, or "ground"')
        return self

    @model_validator(mode="after")
    def _are_words_known(self) -> Self:
        _ = self.meanings
        return self

    @property
    def meanings(self) -> dict[str, OfficeWord]:
        """Words of the office, without case and surplus blanks, with their meanings."""
        return {same_word(word): OfficeWord.of(text) for word, text in self.words.items()}
