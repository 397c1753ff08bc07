"""Add pages to the site that are not files of this folder: they are written when it is built."""

import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from docs import make_faults, make_sentences


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the generated pages."""
    for name, page in {**make_sentences.pages(), "faults.md": make_faults.page()}.items():
        files.append(File.generated(config, name, content=page))
    return files
