"""Prints pyproject's lower bounds as constraints for pip: the lowest versions that it allows."""

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())["project"]
extras = project["optional-dependencies"]
for requirement in [*project["dependencies"], *extras["web"], *extras["cluster"]]:
    # A constraint names no extras.
    print(re.sub(r"(\[.*\])?>=([^,]+).*", r"==\2", requirement))
