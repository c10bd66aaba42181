"""Folder of a search: the study, one file per generation, and the front at the end.

Every file is written whole or not at all. One run at a time holds the lock of the folder. The state of the search is
not stored: a resumed search starts again from its seed, and reads the results of stored generations instead of
computing them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from filelock import FileLock, Timeout

from gearbench.errors import InputError
from gearbench.files import is_part, make_folder, write_text
from gearbench.optimisation.dataset import designs_dataset, read_designs
from gearbench.optimisation.problem import Evaluation
from gearbench.optimisation.study import Design, OptimisationStudy
from gearbench.results.netcdf import open_result, save
from gearbench.results.provenance import versions

STUDY, FRONT, LOCK = "study.toml", "front.nc", ".lock"


class Store:
    """Folder of a search; a context manager that holds its lock.

    Parameters
    ----------
    folder
        Path of the folder; it is made if it does not exist.
    study
        The study to run.
    resume
        Whether to continue a search that is in the folder.

    Raises
    ------
    InputError
        If the folder cannot be made or written, is not empty although ``resume`` is False, holds another study, or is
        in use.
    """

    def __init__(self, folder: str | Path, study: OptimisationStudy, *, resume: bool) -> None:
        self.folder, self._study = make_folder("output", folder), study
        names = sorted(path.name for path in self.folder.iterdir())
        self._check(names, resume)
        self._lock = self._take_lock()
        try:
            if STUDY not in names:
                write_text(self.folder / STUDY, self._study.to_toml())
        except BaseException:
            self._lock.release()
            raise
        for part in filter(is_part, names):  # files that a run has not written to their end
            (self.folder / part).unlink(missing_ok=True)

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.release()

    def _check(self, names: Sequence[str], resume: bool) -> None:
        """Refuse a folder with files ``names`` that the search must not write into."""
        content = [name for name in names if name != LOCK and not is_part(name)]
        same_study = STUDY in content and (self.folder / STUDY).read_text(encoding="utf-8") == self._study.to_toml()
        without_generation = content == [STUDY]
        if not content or (same_study and (resume or without_generation)):
            return
        if not resume:
            instead = "continue its search with --resume" if STUDY in content else "name another one"
            raise InputError("output", str(self.folder), f"the folder is not empty: {instead}")
        if STUDY not in content:
            raise InputError("output", str(self.folder), f"holds no optimisation: there is no {STUDY}")
        raise InputError("output", str(self.folder), f"belongs to another study: see its {STUDY}")

    def _take_lock(self) -> FileLock:
        """Take the lock: as long as this process lives, a second run into the folder is refused."""
        lock = FileLock(self.folder / LOCK, timeout=0)
        try:
            lock.acquire()
        except Timeout:
            raise InputError("output", str(self.folder), "another run is writing into the folder") from None
        except NotImplementedError:  # a file system without locks
            pass
        return lock

    def path(self, generation: int) -> Path:
        """Path of the file of a generation, counted from 1."""
        return self.folder / f"generation_{generation:04d}.nc"

    def read(self, generation: int, designs: Sequence[Design]) -> list[Evaluation] | None:
        """Read the results of a generation's ``designs``; None if they are not stored, or the file is damaged.

        Raises
        ------
        InputError
            If the file holds other designs, because other versions of the packages ran the search.
        """
        path = self.path(generation)
        if not path.exists():
            return None
        try:
            dataset = open_result(path)
            rows = read_designs(dataset, self._study)
        except (InputError, LookupError, ValueError):
            return None
        if [design for design, _ in rows] != list(designs):
            searched_with = dataset.attrs.get("versions", "other versions")
            raise InputError("output", str(path), f"was searched with {searched_with}: continue with those")
        return [result for _, result in rows]

    def write(self, generation: int, designs: Sequence[Design], results: Sequence[Evaluation]) -> None:
        """Write a generation.

        Raises
        ------
        OSError, InputError
            If the disk is full or the folder is no longer writable; earlier generations are untouched.
        """
        dataset = designs_dataset(self._study, designs, results, [generation] * len(designs))
        dataset = dataset.drop_vars("first_generation")
        save(dataset.assign_attrs(generation=generation, versions=versions()), self.path(generation))
