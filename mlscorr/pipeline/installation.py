"""Installed and missing components, and the commands that install them."""

import ctypes
import platform
import subprocess
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from mlscorr.survey import Summary

SYSTEM = platform.system()  # Linux, Windows, Darwin
OPEN3D = "open3d"
if SYSTEM == "Linux" and platform.machine() == "x86_64":
    OPEN3D = "open3d-cpu"  # the same module without CUDA
PACKAGES = (  # for numbers and points, maps and texts, commands and pages
    *("numpy", "scipy", "laspy", "lazrs", OPEN3D, "threadpoolctl", "numba"),
    *("pyproj", "tomlkit", "scikit-learn"),
    *("typer", "rich", "pydantic", "matplotlib", "pillow", "jinja2"),
)
EXTRAS = {  # package -> extra that installs it
    "pye57": "e57",
    "openpyxl": "excel",
    "pandas": "pandas",
    "distributed": "cluster",
    "s3fs": "remote",
}
# shared library -> Debian package: required on Linux to import Open3D and to draw without a screen
LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libvulkan.so.1": "libvulkan1",
}
DRIVER_FOLDERS = ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d")
DRIVER_PACKAGE = "mesa-vulkan-drivers"
RENDER = """
import open3d
renderer = open3d.visualization.rendering.OffscreenRenderer(64, 48)
renderer.scene.add_geometry("box", open3d.geometry.TriangleMesh.create_box(),
                            open3d.visualization.rendering.MaterialRecord())
assert renderer.render_to_image() is not None
"""
INSTALLERS = ("apt-get install -y ", "pip install ")  # that accept several names in a line
RENDER_SECONDS = 60  # a software renderer takes two


@dataclass(frozen=True)
class InstalledPart:
    """Package, library or file: availability, version, and remedy.

    Parameters
    ----------
    name : str
    ok : bool
    state : str
        Version, or the fault.
    remedy : str
        Command that installs it.
    needed : bool
    """

    name: str
    ok: bool
    state: str
    remedy: str = ""
    needed: bool = True

    @property
    def mark(self) -> str:
        """State in a word."""
        if self.ok:
            return "ok"
        if self.needed:
            return "MISSING"
        return "without"


@dataclass(frozen=True, repr=False)
class Installation(Summary):
    """Installed and missing components, and the commands that install them.

    Parameters
    ----------
    parts : tuple of InstalledPart
    """

    parts: tuple[InstalledPart, ...]

    @property
    def remedies(self) -> list[str]:
        """Commands that install all missing components, one for each installer."""
        return remedy(self.parts)

    @property
    def is_complete(self) -> bool:
        """True if all required components are available."""
        return all(part.ok or not part.needed for part in self.parts)

    def _overview(self):
        """Return the rows that a notebook shows."""
        return [(part.name, part.mark, part.state) for part in self.parts] + [
            (line,) for line in self.remedies
        ]


def doctor() -> Installation:
    """Check packages, extras, system libraries, the off-screen driver and geoid grids.

    System libraries and the driver are checked only on Linux; elsewhere they come with the system,
    or with Open3D's wheel.

    Returns
    -------
    Installation
        The check takes seconds, because a picture is drawn.

    >>> import mlscorr
    >>> "python" in [part.name for part in mlscorr.doctor().parts]
    True
    """
    findings = [InstalledPart("python", sys.version_info >= (3, 11), platform.python_version())]
    findings += [_package(name) for name in PACKAGES]
    findings += [_extra(name, extra) for name, extra in EXTRAS.items()]
    if SYSTEM == "Linux":
        findings += [_library(name, package) for name, package in LIBRARIES.items()]
        findings.append(_driver())
    findings += [_rendering(), _geoids()]
    return Installation(tuple(findings))


def remedy(parts: Iterable[InstalledPart]) -> list[str]:
    """Commands that install all missing components, one for each installer.

    Parameters
    ----------
    parts : iterable of InstalledPart

    Returns
    -------
    list of str

    Examples
    --------
    >>> names = ("lazrs", "numba")
    >>> remedy([InstalledPart(name, False, "missing", f"pip install {name}") for name in names])
    ['pip install lazrs numba']
    """
    lines = list(dict.fromkeys(f.remedy for f in parts if not f.ok and f.remedy))
    joined = []
    for installer in INSTALLERS:
        names = [line.removeprefix(installer) for line in lines if line.startswith(installer)]
        joined += [installer + " ".join(names)] if names else []
    return joined + [line for line in lines if not line.startswith(INSTALLERS)]


def installed_version(name: str) -> str | None:
    """Version of a package, None if it is not installed; for Open3D of either wheel.

    Parameters
    ----------
    name : str
    """
    for known in (name, name.removesuffix("-cpu")):
        try:
            return version(known)
        except PackageNotFoundError:
            continue
    return None


def _package(name):
    installed = installed_version(name)
    if installed is None:
        return InstalledPart(name, False, "missing", f"pip install {name}")
    return InstalledPart(name, True, installed)


def _extra(name, extra):
    """Package that only some inputs need, and thus never missing."""
    installed = installed_version(name)
    if installed is None:
        line = f"pip install 'mlscorr[{extra}]'"
        return InstalledPart(name, False, f"not installed: {line}", needed=False)
    return InstalledPart(name, True, installed, needed=False)


def _library(name, package):
    try:
        ctypes.CDLL(name)
    except OSError:
        return InstalledPart(name, False, "missing", f"apt-get install -y {package}")
    return InstalledPart(name, True, "found")


def _driver():
    drivers = [path.stem for folder in DRIVER_FOLDERS for path in Path(folder).glob("*.json")]
    if drivers:
        return InstalledPart("Vulkan drivers", True, ", ".join(sorted(drivers)))
    return InstalledPart("Vulkan drivers", False, "missing", f"apt-get install -y {DRIVER_PACKAGE}")


def _rendering():
    """Draw in a child process: Open3D aborts its process when the driver is missing."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", RENDER], capture_output=True, timeout=RENDER_SECONDS, check=False
        )
        if child.returncode:
            state = f"failed (exit code {child.returncode})"
        else:
            state = "drawn"
    except subprocess.TimeoutExpired:
        state = f"no picture within {RENDER_SECONDS} s"
    except OSError as error:  # where Python itself cannot be started
        state = f"failed ({error})"
    return InstalledPart("off-screen picture", state == "drawn", state, needed=False)


def _geoids():
    """Geoid grids are needed only for a geographic trajectory with heights above the geoid."""
    from pyproj.datadir import get_data_dir, get_user_data_dir

    folders = [*get_data_dir().split(":"), get_user_data_dir()]
    grids = [path for folder in folders for path in Path(folder).glob("*.tif")]
    state = f"{len(grids)} in {folders[-1]}"
    line = "pyproj sync --area-of-use YOUR_COUNTRY"
    return InstalledPart("geoid grids", bool(grids), state, "" if grids else line, needed=False)
