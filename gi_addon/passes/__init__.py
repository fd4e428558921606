# SPDX-License-Identifier: GPL-3.0-or-later
"""Passes that several techniques share. A technique's own passes stand in its file below ``engines/``."""
