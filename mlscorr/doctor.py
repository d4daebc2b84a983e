"""What is installed, what is missing, and the line that installs it."""

import ctypes
import platform
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

PACKAGES = (
    "numpy",
    "scipy",
    "laspy",
    "lazrs",
    "open3d",
    "threadpoolctl",
    "numba",
    "pyproj",
    "tomlkit",
    "typer",
    "rich",
    "pydantic",
    "matplotlib",
    "pillow",
    "jinja2",
)
# shared library -> Debian package: what importing Open3D and drawing without a screen need
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
INSTALLERS = ("apt-get install -y ", "pip install ")  # that take several names in a line
RENDER_SECONDS = 60  # a software driver takes two


@dataclass(frozen=True)
class Finding:
    """One thing looked at: its name, whether it is there, what was found, and the way out."""

    name: str
    ok: bool
    found: str
    remedy: str = ""
    needed: bool = True


def examine():
    """Look at packages, system libraries, the off-screen driver and geoid grids: Findings."""
    findings = [Finding("python", sys.version_info >= (3, 11), platform.python_version())]
    findings += [_package(name) for name in PACKAGES]
    findings += [_library(name, package) for name, package in LIBRARIES.items()]
    findings += [_driver(), _rendering(), _geoids()]
    return tuple(findings)


def remedy(findings):
    """The lines that install all that is missing, one for each installer.

    >>> missing = [Finding(n, False, "missing", f"pip install {n}") for n in ("lazrs", "numba")]
    >>> remedy(missing)
    ['pip install lazrs numba']
    """
    lines = list(dict.fromkeys(f.remedy for f in findings if not f.ok and f.remedy))
    joined = []
    for installer in INSTALLERS:
        names = [line.removeprefix(installer) for line in lines if line.startswith(installer)]
        joined += [installer + " ".join(names)] if names else []
    return joined + [line for line in lines if not line.startswith(INSTALLERS)]


def _package(name):
    try:
        return Finding(name, True, version(name))
    except PackageNotFoundError:
        return Finding(name, False, "missing", f"pip install {name}")


def _library(name, package):
    try:
        ctypes.CDLL(name)
    except OSError:
        return Finding(name, False, "missing", f"apt-get install -y {package}")
    return Finding(name, True, "found")


def _driver():
    drivers = [path.stem for folder in DRIVER_FOLDERS for path in Path(folder).glob("*.json")]
    if drivers:
        return Finding("Vulkan drivers", True, ", ".join(sorted(drivers)))
    return Finding("Vulkan drivers", False, "missing", f"apt-get install -y {DRIVER_PACKAGE}")


def _rendering():
    """Draw in a child process: Open3D aborts its process when the driver is missing."""
    try:
        child = subprocess.run(
            [sys.executable, "-c", RENDER], capture_output=True, timeout=RENDER_SECONDS
        )
    except subprocess.TimeoutExpired:
        found = f"no picture within {RENDER_SECONDS} s"
    else:
        if child.returncode == 0:
            return Finding("off-screen picture", True, "drawn")
        found = f"failed (exit code {child.returncode})"
    return Finding("off-screen picture", False, found, needed=False)


def _geoids():
    """Geoid grids are needed only for a geographic trajectory with heights above the geoid."""
    from pyproj.datadir import get_data_dir, get_user_data_dir

    folders = [*get_data_dir().split(":"), get_user_data_dir()]
    grids = [path for folder in folders for path in Path(folder).glob("*.tif")]
    found = f"{len(grids)} in {folders[-1]}"
    line = "pyproj sync --area-of-use YOUR_COUNTRY"
    return Finding("geoid grids", bool(grids), found, "" if grids else line, needed=False)
