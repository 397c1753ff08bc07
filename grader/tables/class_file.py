"""`planmark.toml` in a class's folder: options that are the same for every command on that class."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator

from grader.options import GradeOptions, model_of, offered
from reference.authored.assignment import built_in, locate
from reference.authored.toml_file import Authored, is_file, load
from reference.errors import AuthoredFileError, FaultError, Finding


def _check_path(text: str) -> str:
    if not text or not text.isprintable():
        # In double quotes TOML takes the backslash of a path for the begin of a sign: \\r, \\t.
        raise FaultError("no_path", advice="path_quotes")
    return text


_Path = Annotated[str, AfterValidator(_check_path)]


ClassFile = model_of(
    "ClassFile", GradeOptions, Authored, kinds={Path: _Path, str: _Path},
    assignment=(_Path | None, None), out=(_Path, "results"), log=(_Path | None, None),
)  # fmt: skip
"""The keys as they are written; all may be absent."""


@dataclass(frozen=True, slots=True)
class ClassSettings:
    """The settings of a class.

    Attributes
    ----------
    values : by the names of the commands' parameters; paths are resolved against the file's folder
    keys : the keys that are in the file, each with the parameter that it stands for
    """

    file: Path
    values: dict[str, str | int]
    keys: dict[str, str]

    @property
    def out(self) -> Path:
        """The folder of results."""
        return Path(str(self.values["out"]))


_PARAMETERS = {told.key: one.name for one, told in offered(GradeOptions) if told.key}
"""The parameters that keys stand for, where a record of options says so."""


_PATHS = ("roster", "out", "log")


def read_class_file(path: Path, platforms: Collection[str]) -> ClassSettings:
    """The settings of a class; raises AuthoredFileError with every fault of the file.

    Arguments: `platforms` that there are exports for.
    """
    written = load(ClassFile, path).model_dump(exclude_none=True)
    # Windows writes backslashes, and takes slashes as well.
    texts = {key: written[key].replace("\\", "/") for key in ("assignment", *_PATHS) if key in written}
    resolved = {
        key: text if key == "assignment" and not text.endswith(".toml") else str(path.parent / text)
        for key, text in texts.items()
    }
    faults = list(_faults({**written, **resolved}, platforms))
    if faults:
        raise AuthoredFileError(str(path), tuple(faults))
    keys = {key: _PARAMETERS.get(key, key) for key in written}
    values = {**written, **resolved}
    return ClassSettings(path, {keys[key]: values[key] for key in written}, keys)


def _faults(values: dict[str, Any], platforms: Collection[str]) -> Iterator[Finding]:
    """Report files and platforms that the values name and that do not exist."""
    name, roster, platform = (values.get(key) for key in ("assignment", "roster", "platform"))
    if name is not None and not is_file(locate("assignment", name)):
        yield Finding("$.assignment", "class_assignment", {"text": name, "names": tuple(built_in())})
    if roster is not None and not is_file(Path(roster)):
        yield Finding("$.roster", "no_file_beside", {"file": roster})
    if platform is not None and platform not in platforms:
        yield Finding("$.platform", "one_of", {"names": tuple(platforms)})
