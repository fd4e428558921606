# SPDX-License-Identifier: GPL-3.0-or-later
"""Write the generated docs: ``.venv/bin/python scripts/make_docs.py``."""

from __future__ import annotations

from pathlib import Path

from gi_addon.settings import markdown

DOCS = Path(__file__).resolve().parent.parent / "docs"
_HEAD = "# Settings\n\nGenerated from `gi_addon/settings.py` by `scripts/make_docs.py`.\n\n"


def settings_page() -> str:
    return _HEAD + markdown()


if __name__ == "__main__":
    (DOCS / "settings.md").write_text(settings_page())
