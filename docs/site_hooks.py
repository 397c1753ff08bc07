"""What the site has beside the files of this folder: the page of all sentences, written when it is built."""

import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from docs.make_sentences import page


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the generated page."""
    files.append(File.generated(config, "sentences.md", content=page()))
    return files
