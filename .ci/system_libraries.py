"""Say which system libraries of gmsh's wheel are missing, and the command that installs them.

gmsh's wheel brings no graphics libraries, although it needs them to load even where nothing is drawn.
With ``--packages`` only the missing Debian packages are printed. Uses nothing but Python itself, so that
it runs before anything is installed.
"""

import ctypes
import sys

DEBIAN_PACKAGE = {
    "libGL.so.1": "libgl1",
    "libGLU.so.1": "libglu1-mesa",
    "libX11.so.6": "libx11-6",
    "libXcursor.so.1": "libxcursor1",
    "libXext.so.6": "libxext6",
    "libXfixes.so.3": "libxfixes3",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libXrender.so.1": "libxrender1",
    "libfontconfig.so.1": "libfontconfig1",
    "libgomp.so.1": "libgomp1",
}


def missing() -> dict[str, str]:
    """Return library -> Debian package of those that cannot be loaded."""
    absent = {}
    for library, package in DEBIAN_PACKAGE.items():
        try:
            ctypes.CDLL(library)
        except OSError:
            absent[library] = package
    return absent


def main() -> int:
    """Print what is missing; the exit code is 1 where gmsh will not load."""
    absent = missing()
    if "--packages" in sys.argv[1:]:
        print(" ".join(absent.values()))
        return 0
    if not absent:
        return 0
    print(
        f"gmsh, which meshes the blades, needs system libraries that this machine lacks: {', '.join(absent)}.\n"
        f"On Debian or Ubuntu: sudo apt-get install {' '.join(absent.values())}\n"
        "Then call make again.",
        file=sys.stderr,
    )
    return 1


if __name__ == "__main__":
    sys.exit(main())
