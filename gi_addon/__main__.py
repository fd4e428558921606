# SPDX-License-Identifier: GPL-3.0-or-later
"""``python -m gi_addon`` is the ``quartet`` command."""

from gi_addon.cli import main

main(prog_name="quartet")
