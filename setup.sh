#!/bin/sh
# Make .venv with the package and the extras that EXTRAS names, such as "[test]", and install the
# system libraries that Open3D needs.
# As root all of it is installed; otherwise the line that installs what is missing is printed.
set -eu
PYTHON=${PYTHON:-python3}
VENV=${VENV:-.venv}
EXTRAS=${EXTRAS:-}

"$PYTHON" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || {
    echo "mlscorr needs Python 3.11 or newer; $PYTHON is $("$PYTHON" --version 2>&1)." >&2
    echo "Name another one: make PYTHON=python3.12 ..." >&2
    exit 1
}

missing=""
need() { missing="$missing $1"; }
library() { "$PYTHON" -c "import ctypes; ctypes.CDLL('$1')" 2>/dev/null || need "$2"; }
library libusb-1.0.so.0 libusb-1.0-0
library libGL.so.1 libgl1
library libEGL.so.1 libegl1
library libvulkan.so.1 libvulkan1
library libgomp.so.1 libgomp1
ls /usr/share/vulkan/icd.d/*.json /etc/vulkan/icd.d/*.json >/dev/null 2>&1 || need mesa-vulkan-drivers
"$PYTHON" -c 'import ensurepip, venv' 2>/dev/null || need python3-venv

if [ -n "$missing" ]; then
    if [ "$(id -u)" = 0 ]; then
        export DEBIAN_FRONTEND=noninteractive
        apt-get update -q
        # shellcheck disable=SC2086
        apt-get install -q -y --no-install-recommends $missing
    else
        echo "System libraries are missing. Install them, then repeat:" >&2
        echo "sudo apt-get install -y$missing" >&2
        exit 1
    fi
fi

[ -x "$VENV/bin/python" ] || "$PYTHON" -m venv "$VENV"
echo "Installing mlscorr$EXTRAS and what it needs into $VENV"
# Modules are compiled when they are first imported: all of them would take a third of the time here
"$VENV/bin/python" -m pip install --no-compile --disable-pip-version-check -e ".$EXTRAS"
