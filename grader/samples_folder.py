"""Where the bundled samples are: inside the installed package, or beside it in a checkout."""

from importlib.resources import files
from pathlib import Path

from reference.errors import CallError


def samples_folder() -> Path:
    """The folder of samples. Raises CallError where an installation has none."""
    installed = Path(str(files("grader"))) / "samples"
    for folder in (installed, Path(__file__).resolve().parent.parent / "samples"):
        if folder.is_dir():
            return folder
    raise CallError("samples_missing", "the samples are not there; install planmark again")
