"""Files of a command's result: clouds, tables, document and pages, written atomically.

A command's result lists its files as ``ResultFiles``; only this module writes them.
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
Page = Callable[[Path, dict], object]  # likewise, from the document


class WrittenFiles(NamedTuple):
    """Clouds and tables already in the folder of a result, before its document is made.

    Attributes
    ----------
    folder : Path
    clouds : object
        Result of the function that wrote the clouds; None without clouds.
    tables : dict
        Result of the function of each table, by name of the table.
    """

    folder: Path
    clouds: Any
    tables: dict[str, Any]


class Reported(NamedTuple):
    """Contents of a result's document, and the pages that show it.

    Attributes
    ----------
    content : dict
        Contents of the document, with or without its schema.
    pages : dict
        Functions of a path and the document that write a page, a picture, or a folder of pictures,
        by name.
    """

    content: dict
    pages: Mapping[str, Page]


@dataclass(frozen=True)
class ResultFiles:
    """All files that a command writes into its folder: clouds, tables, document, then pages.

    Parameters
    ----------
    name : str
        Name of the document: NAME.json, with the schema mlscorr.NAME/1.
    inputs : sequence of InputFile
        Files that must not change.
    report : function of WrittenFiles
        Makes the Reported after clouds and tables, because a document may name them.
    tables : dict
        Functions of a path that write a table, by name.
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
        """Make the files of a result whose document depends on none of them.

        Parameters
        ----------
        name, inputs, content, tables, pages
            See ResultFiles and Reported.
        """
        return cls(name, inputs, lambda _: Reported(content, pages), tables)

    def write(
        self,
        out: str | Path,
        overwrite: bool = False,
        clouds: Callable[[Path], object] | None = None,
        folders: Sequence[str] = (),
    ) -> dict:
        """Write all files into a folder, atomically.

        Parameters
        ----------
        out : path
        overwrite : bool
            True to replace files of the same name.
        clouds : function of a folder, optional
            Streams the clouds into it.
        folders : sequence of str
            Subfolders of ``out`` with files of this result.

        Returns
        -------
        dict
            The document.

        Raises
        ------
        ValueError
            If the folder contains an input, or anything without overwrite.
        OSError
            If writing fails.
        """
        with output_folder(out, self.inputs, overwrite, folders) as folder:
            if clouds is None:
                written = None
            else:
                written = clouds(folder)
            return self.write_beside(folder, written)

    def write_beside(self, folder: Path, clouds: object) -> dict:
        """Write everything except the clouds into an existing folder, and return the document.

        Parameters
        ----------
        folder : Path
        clouds : object
            Information on the clouds for the document.
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
    """Base of results whose document is known before anything is written."""

    _name: ClassVar[str]  # of the document

    @cached_property
    def document(self) -> dict:
        """JSON document, made only once."""
        return document(self._name, self._content())

    def _content(self) -> dict:
        """Return the document without its schema."""
        raise NotImplementedError

    def _files(self) -> ResultFiles:
        """Return the files for ``write``."""
        raise NotImplementedError

    def write(self, out: str | Path, overwrite: bool = False) -> dict:
        """Write the document as JSON, with tables, pictures and pages, into a folder.

        Parameters
        ----------
        out : path
            Folder, written atomically.
        overwrite : bool
            True to replace files of the same name.

        Returns
        -------
        dict
            The document.

        Raises
        ------
        ValueError
            If the folder contains an input, or anything without overwrite.
        OSError
            If writing fails.
        """
        return self._files().write(out, overwrite)
