# SPDX-License-Identifier: GPL-3.0-or-later
"""The commands that measure: ``quartet stability``, ``quartet bench`` and the report of ``quartet compare``."""

from __future__ import annotations

import datetime
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from .gl import GLError
from .scene import Scene
from .settings import Settings

console = Console(stderr=True)


def technique_names(text: str | None) -> list[str]:
    """'RSM,LPV' as names that exist; all of them for None."""
    from .engines import TECHNIQUES

    if not text or text.lower() == "all":
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
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("quartet-stability"),
    show_default=True,
    help="Folder for stability.html and stability.json.",
)
def stability_command(techniques, tests, full, strict, output) -> None:
    """Run the stability suite: value, limit and verdict of every test for every technique.

    An interrupted run goes on where it stopped.
    """
    from .compare import stability, stability_checks  # noqa: F401 — the second fills the registry

    names = technique_names(techniques)
    keys = [k.strip() for k in tests.split(",")] if tests else list(stability.TESTS)
    unknown = [k for k in keys if k not in stability.TESTS]
    if unknown:
        raise click.UsageError(f"no test {', '.join(unknown)}; there are {', '.join(stability.TESTS)}")

    def said(technique: str, test: stability.Test, finding: stability.Finding) -> None:
        missed = next((q for q in finding.quantities if q.limited and not q.holds), None)
        detail = f"{missed.name} = {missed.value:.4g}, limit {missed.limit}" if missed else finding.note
        head = f"{technique:5s} {test.key:>3s} {test.title:26s} {finding.verdict:14s} {finding.seconds:5.0f} s"
        console.print(f"{head}  {detail}", highlight=False)

    results = stability.run(names, keys, full=full, cache=output / "findings", progress=said)
    table = Table("test", *names)
    for key in keys:
        table.add_row(f"{key} {stability.TESTS[key].title}", *(results[t][key].verdict for t in names))
    Console().print(table)
    for path in stability.write(results, output, full=full):
        console.print(f"wrote {path}")
    bad = [f"{t} {k}" for t, fs in results.items() for k, f in fs.items() if f.verdict in (stability.FAIL, stability.ERROR)]
    if strict and bad:
        raise click.ClickException(f"{len(bad)} failed: {', '.join(bad)}")


@click.command("bench")
@click.argument("scene", type=click.Path(path_type=Path), required=False)
@click.option("--techniques", help="Techniques separated by commas; all by default.")
@click.option(
    "--scale", type=click.FloatRange(0.01, 4.0), help="Share of the paper's picture size; 1 on a GPU, 0.1 on a software driver."
)
@click.option("--frames", type=click.IntRange(1), help="Frames of each kind per row; 50 on a GPU, 5 on a software driver.")
@click.option("--rows", help="Only rows whose name holds this text, e.g. '512²' or '1280x720'.")
@click.option("--limit", type=float, default=60.0, show_default=True, help="Skip a row whose first frame takes longer, s.")
@click.option(
    "--budget",
    type=click.FloatRange(0.0),
    default=60.0,
    show_default=True,
    help="Seconds of timed frames per row, there and back each: slow rows get fewer frames, as the table says.",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    default=Path("quartet-bench"),
    show_default=True,
    help="Folder for bench.html, bench.json and bench.csv.",
)
def bench_command(scene, techniques, scale, frames, rows, limit, budget, output) -> None:
    """The paper's Table 2 on this machine: frame rates of SCENE (Sponza, as there; a Cornell box if none is given).

    An interrupted bench goes on where it stopped.
    """
    from .compare import bench, scenes
    from .compare.paper import TABLE_2
    from .gl import shared
    from .scene import Scene

    names = technique_names(techniques)
    chosen = [r for r in TABLE_2 if r.technique in names and (not rows or rows.lower() in r.key.lower())]
    if not chosen:
        raise click.UsageError(f"no row of the table matches {rows!r} for {', '.join(names)}")
    if scene is None:
        plain, label = scenes.cornell(light="sun"), "Cornell box"
    elif scene.suffix.lower() == ".npz":
        plain, label = Scene.load(scene), scene.name
    else:
        from .cli import _blender

        with _blender(scene, None, None, (1280, 720), None, ()) as bscene:
            from .host import embedded

            (plain, _), label = embedded.plain(bscene), scene.name
    scale = scale or (0.1 if shared().call(lambda gl: gl.software) else 1.0)
    calibration, timings = bench.bench(
        plain,
        techniques=names,
        scale=scale,
        frames=frames,
        rows=chosen,
        limit_s=limit,
        budget_s=budget,
        cache=output / "rows",
        progress=lambda text: console.print(text, style="dim", highlight=False),
    )
    table = Table(
        *("technique", "setting", "paper", "paper fps", "here"),
        *("ms moving", "frames", "ms still", "fps", "× paper", "per hardware", "MiB"),
    )
    for r in bench.records(calibration, timings):
        paper_fps = "–" if r["paper_fps"] is None else f"{r['paper_fps']:g}{'?' if r['paper_doubtful'] else ''}"
        numbers = (
            [r["problem"], *[""] * 6]
            if r["problem"]
            else [
                f"{r['ms']:.2f} ± {r['mad']:.2f}",
                str(r["frames"]),
                f"{r['still_ms']:.2f}",
                f"{r['fps']:.1f}",
                f"{r['ratio']:.3g}" if r["ratio"] else "–",
                f"{r['ratio_per_hardware']:.3g}" if r["ratio"] else "–",
                f"{r['planned_mib']:.1f}",
            ]
        )
        table.add_row(r["technique"], r["setting"], r["paper_resolution"], paper_fps, r["resolution"], *numbers)
    Console().print(table)
    console.print(bench.hardware_text(calibration), highlight=False)
    for path in bench.write(output, label, scale, calibration, timings):
        console.print(f"wrote {path}")


def report_command(
    scenes, techniques, sweep, peers, blender, effects, references_folder, reference_samples, visits, budget, output, options
) -> None:
    """Measure scenes with all candidates and write the report. ``options`` are the scene options of the command line."""
    from .cli import _blender
    from .compare import bench, report, study
    from .compare.references import BOUNCES, ready, reference
    from .compare.sweeps import peer_sweep, technique_sweep
    from .gl import driver, shared

    names = technique_names(techniques) if techniques or not options["technique"] else technique_names(options["technique"])
    rivals = [p.strip().lower() for p in peers.split(",") if p.strip()]
    if set(rivals) - {"cycles", "eevee"}:
        raise click.UsageError(f"--peers {peers}: there are cycles and eevee")
    if any(str(s).lower().endswith(".npz") for s in scenes):
        raise click.UsageError("a snapshot has no Cycles reference: give the scene file itself")
    candidates = [c for t in names for c in technique_sweep(t, sweep)] + [c for p in rivals for c in peer_sweep(p, sweep)]
    size = options["resolution"] or (128, 72)
    measured: list[report.Measured] = []
    calibration = shared().call(bench.calibrate)
    console.print(bench.hardware_text(calibration), highlight=False)
    frames = shared().call(bench.frames_asked)
    head = {"version": study.source_version(), "driver": driver(), "date": datetime.date.today().isoformat(), "sweep": sweep}
    head["calibration"] = bench.hardware_text(calibration)
    for scene in scenes:
        arguments = (None, options["samples"], size, options["frame"], options["assignments"])
        with _blender(scene, *arguments) as bscene:
            from .host import cycles, eevee, embedded, properties
            from .host import peers as host_peers

            plain, size = embedded.plain(bscene)
            key, base = plain.digest(), properties.read(bscene)
            label = scene.name

            def run_cycles(bounces: int, count: int, seed: int, bscene=bscene):
                with console.status(f"Cycles, {bounces} bounce{'s' * (bounces > 1)}, {count} samples, seed {seed}"):
                    cycles.set_up(bscene, cycles.Reference(bounces, count, seed))
                    return {n: p[..., :3] for n, p in cycles.render_passes(bscene, study.COMPARED).items()}

            console.print(f"{label}: references")
            try:
                found = ready(references_folder / f"{scene.stem}.npz", size, study.COMPARED) if references_folder else None
            except ValueError as error:
                raise click.UsageError(str(error)) from error
            samples = None if found else reference_samples
            references = found or {k: reference(k, key, size, samples, study.COMPARED, run_cycles) for k in BOUNCES}

            def run_peer(candidate, passes, bscene=bscene):
                if candidate.method == "EEVEE":
                    return other.render(candidate, passes)
                return host_peers.render(bscene, candidate, passes)

            try:
                program = eevee.program(blender) if "eevee" in rivals else None
            except RuntimeError as error:
                raise click.UsageError(f"--blender: {error}") from error
            with eevee.Eevee(bscene, program) as other:
                versions = dict.fromkeys(("Cycles", "Cycles + OIDN"), host_peers.VERSION)
                if "eevee" in rivals:
                    versions["EEVEE"] = other.version
                runs = study.measure(
                    plain,
                    key,
                    size,
                    candidates,
                    base=base,
                    driver=driver(),
                    cache=output / "runs",
                    peer=run_peer,
                    peer_versions=versions,
                    visits=visits,
                    repeats=-(-frames // visits),
                    budget_s=budget,
                    progress=lambda text, label=label: console.print(f"{label}: {text}", style="dim", highlight=False),
                )
        console.print(f"{label}: scores")
        record = study.scene_record(label, key, size, samples, runs, references, plain.triangle_count(), base)
        record["peers"] = {m: v for m, v in versions.items() if any(r.candidate.method == m for r in runs)}
        measured.append(report.Measured(record, runs, references))
        if scene != scenes[-1]:  # what is measured can be looked at while the others are
            study.write_results(output, head, [m.record for m in measured])
            report.write(output, head, measured, images=False)
    extra = ""
    if effects:
        from .compare import effects as table_1

        extra = table_1.command(names, size, reference_samples, output, console)
    files = study.write_results(output, head, [m.record for m in measured]) if measured else []
    written, notes = report.write(output, head, measured, extra)
    for m in measured:
        for line in report.verdict_lines(m.record):
            Console().print(f"{m.record['scene']}: {line}", highlight=False)
    for note in notes:
        console.print(f"note: {note}", style="yellow", highlight=False)
    for path in [*files, written[0]]:
        console.print(f"wrote {path}")
    if len(written) > 1:
        console.print(f"wrote {len(written) - 1} chart pictures in {output / 'charts'}")


def certify_command(scene: Path, bscene, reference_samples: int) -> None:
    """Print the certificate of a scene that is open in Blender."""
    from .compare.certificate import certify
    from .compare.references import reference
    from .host import cycles, embedded, properties

    plain, size = embedded.plain(bscene)
    settings = properties.read(bscene)
    kind = "R1" if settings.bounces <= 1 else "Rinf"

    def run_cycles(bounces: int, count: int, seed: int):
        cycles.set_up(bscene, cycles.Reference(bounces, count, seed))
        return {n: p[..., :3] for n, p in cycles.render_passes(bscene, ("Combined",)).items()}

    with console.status(f"{scene.name}: Cycles reference"):
        halves = reference(kind, plain.digest(), size, reference_samples, ("Combined",), run_cycles)
    with console.status("certifying") as status:
        result = certify(plain, settings, size, {kind: halves}, progress=status.update)
    click.echo(f"{scene.name}, {size[0]} × {size[1]} pixels, {plain.triangle_count()} triangles")
    click.echo(result.text())


def unseen_command(scene: Scene, settings: Settings) -> None:
    """Print how much of the bounced light the screen does not know; a line instead where there is no OpenGL to look with."""
    from .compare.visible_light import light_unseen

    click.echo("")
    try:
        click.echo("\n".join(light_unseen(scene, settings)))
    except GLError as error:
        click.echo(f"lit surfaces off screen: not measured ({error})")
