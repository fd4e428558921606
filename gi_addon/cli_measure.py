# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands that measure: ``quartet stability`` and ``quartet bench``."""

from __future__ import annotations

from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

console = Console(stderr=True)


def technique_names(text: str | None) -> list[str]:
    """'RSM,LPV' as names that exist; all of them for None."""
    from .engines import TECHNIQUES

    if not text:
        return list(TECHNIQUES)
    names = [part.strip().upper() for part in text.split(",") if part.strip()]
    unknown = [name for name in names if name not in TECHNIQUES]
    if unknown or not names:
        raise click.UsageError(f"no technique {', '.join(unknown) or 'given'}; there are {', '.join(TECHNIQUES)}")
    return names


@click.command("stability")
@click.option("--techniques", help="Techniques separated by commas; all by default.")
@click.option("--tests", help="Test numbers separated by commas, e.g. 1,5,11; all by default.")
@click.option("--full", is_flag=True, help="Sweep everything the protocol lists, with default structure sizes.")
@click.option("--strict", is_flag=True, help="Exit with 1 if a test fails that the technique could pass.")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("quartet-stability"), show_default=True,
              help="Folder for stability.html and stability.json.")
def stability_command(techniques, tests, full, strict, output) -> None:
    """Run the stability suite: value, limit and verdict of every test for every technique."""
    from .compare import stability, stability_checks  # noqa: F401 — the second fills the registry

    names = technique_names(techniques)
    keys = [k.strip() for k in tests.split(",")] if tests else list(stability.TESTS)
    unknown = [k for k in keys if k not in stability.TESTS]
    if unknown:
        raise click.UsageError(f"no test {', '.join(unknown)}; there are {', '.join(stability.TESTS)}")

    def said(technique: str, test: stability.Test, finding: stability.Finding) -> None:
        missed = next((q for q in finding.quantities if q.limited and not q.holds), None)
        detail = f"{missed.name} = {missed.value:.4g}, limit {missed.limit}" if missed else finding.note
        console.print(f"{technique:5s} {test.key:>3s} {test.title:26s} {finding.verdict:14s} {detail}", highlight=False)

    results = stability.run(names, keys, full=full, progress=said)
    table = Table("test", *names)
    for key in keys:
        table.add_row(f"{key} {stability.TESTS[key].title}", *(results[t][key].verdict for t in names))
    Console().print(table)
    for path in stability.write(results, output, full=full):
        console.print(f"wrote {path}")
    bad = [f"{t} {k}" for t, fs in results.items() for k, f in fs.items() if f.verdict in (stability.FAIL, stability.ERROR)]
    if strict and bad:
        raise click.ClickException(f"{len(bad)} failed: {', '.join(bad)}")
