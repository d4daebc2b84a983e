"""Files of a command's result: clouds, tables, document and pages, written whole or not at all.

A command's result says what it has as ``ResultFiles``; how that is written stands here alone.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from mlscorr.io.store import document, output_folder, progress_of, write_json
from mlscorr.pipeline.logs import write_log
from mlscorr.survey import InputFile, Summary

LOG = logging.getLogger(__name__)
Table = Callable[[Path], object]  # writes the file of this path
Page = Callable[[Path, dict], object]  # likewise, of the document


class WrittenFiles(NamedTuple):
    """Clouds and tables that stand in the folder of a result, before its document is made.

    Attributes
    ----------
    folder : Path
    clouds : object
        What the function that wrote the clouds returned; None without clouds.
    tables : dict
        What the function of each table returned, by the table's name.
    """

    folder: Path
    clouds: Any
    tables: dict[str, Any]


class Reported(NamedTuple):
    """Content of a result's document, and the pages that show it.

    Attributes
    ----------
    content : dict
        Of the document, with or without its schema.
    pages : dict
        Functions of a path and the document that write a page, a picture, or a folder of
        pictures, by its name.
    """

    content: dict
    pages: Mapping[str, Page]


@dataclass(frozen=True)
class ResultFiles:
    """All that a command writes into its folder: clouds, tables, document, pages, in this order.

    Parameters
    ----------
    name : str
        Of the document: NAME.json, with the schema mlscorr.NAME/1.
    inputs : sequence of InputFile
        Files that must stay as they are.
    report : function of WrittenFiles
        Makes what is Reported, once clouds and tables stand: a document may name them.
    tables : dict
        Functions of a path that write a table, by its name.
    """

    name: str
    inputs: Sequence[InputFile]
    report: Callable[[WrittenFiles], Reported]
    tables: Mapping[str, Table] = field(default_factory=dict)

    @classmethod
    def of(
        cls,
        name: str,
        inputs: Sequence[InputFile],
        content: dict,
        tables: Mapping[str, Table],
        pages: Mapping[str, Page],
    ) -> ResultFiles:
        """Files of a result whose document depends on none of them.

        Parameters
        ----------
        name, inputs, content, tables, pages
            As of ResultFiles and Reported.
        """
        return cls(name, inputs, lambda _: Reported(content, pages), tables)

    def write(
        self,
        out: str | Path,
        overwrite: bool = False,
        clouds: Callable[[Path], object] | None = None,
        folders: Sequence[str] = (),
    ) -> dict:
        """Write all files into a folder, which appears whole or not at all.

        Parameters
        ----------
        out : path
        overwrite : bool
            Whether files of the same name are replaced.
        clouds : function of a folder, optional
            Streams the clouds into it.
        folders : sequence of str
            Below ``out``, that hold files of this result.

        Returns
        -------
        dict
            The document.

        Raises
        ------
        ValueError
            When the folder holds an input, or holds anything without overwrite.
        OSError
            When writing fails.
        """
        with output_folder(out, self.inputs, overwrite, folders) as folder:
            if clouds is None:
                written = None
            else:
                written = clouds(folder)
            return self.write_beside(folder, written)

    def write_beside(self, folder: Path, clouds: object) -> dict:
        """Write all but the clouds into a folder that is there, and return the document.

        Parameters
        ----------
        folder : Path
        clouds : object
            What the document says of the clouds.
        """
        tables = {}
        for name, write in self.tables.items():
            progress_of(f"Writing {name}")
            tables[name] = write(folder / name)
        progress_of(f"Writing {self.name}.json")
        content, pages = self.report(WrittenFiles(folder, clouds, tables))
        content = document(self.name, content)
        write_json(folder / f"{self.name}.json", content)
        for name, write in pages.items():
            progress_of(f"Drawing {name}")
            write(folder / name, content)
        for row in content.get("statements", ()):
            LOG.info("%s: %s", row["what"], row["sentence"])
        write_log(folder)
        return content


class KnownResult(Summary):
    """Dataclasses of a result whose document is known before anything is written."""

    _name: ClassVar[str]  # of the document

    @cached_property
    def document(self) -> dict:
        """The JSON document, made once."""
        return document(self._name, self._content())

    def _content(self) -> dict:
        """The document without its schema."""
        raise NotImplementedError

    def _files(self) -> ResultFiles:
        """All that ``write`` writes."""
        raise NotImplementedError

    def write(self, out: str | Path, overwrite: bool = False) -> dict:
        """Write the document as JSON, and the tables, pictures and pages beside it, into a folder.

        Parameters
        ----------
        out : path
            The folder, which appears whole or not at all.
        overwrite : bool
            Whether files of the same name are replaced.

        Returns
        -------
        dict
            The document.

        Raises
        ------
        ValueError
            When the folder holds an input, or holds anything without overwrite.
        OSError
            When writing fails.
        """
        return self._files().write(out, overwrite)
