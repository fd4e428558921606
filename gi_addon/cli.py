# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line: ``quartet render|compare|bench|stability|inspect|snapshot …``."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from . import __version__
from .cli_measure import bench_command, certify_command, report_command, stability_command, unseen_command
from .gl import GLError
from .outputs import OUTPUTS
from .renderer import RenderError, inspect, render
from .scene import Scene, SnapshotError
from .settings import SettingError, Settings, walk

console = Console(stderr=True)


class _Errors(click.Group):
    """Turns the project's own errors into one line and exit code 1."""

    def invoke(self, ctx):
        try:
            return super().invoke(ctx)
        except (RenderError, GLError, SnapshotError, SettingError) as error:
            raise click.ClickException(str(error)) from error


class _Resolution(click.ParamType):
    name = "WxH"

    def convert(self, value, param, ctx):
        if isinstance(value, tuple):
            return value
        try:
            width, height = (int(v) for v in value.lower().split("x"))
        except ValueError:
            self.fail(f"{value!r} is not WIDTHxHEIGHT", param, ctx)
        if width < 1 or height < 1:
            self.fail(f"{value!r} has no pixels", param, ctx)
        return width, height


def _scene_options(function):
    for option in reversed((
        click.option("--technique", type=str, help="Technique: rsm, lpv, vct or ssdo."),
        click.option("--samples", type=int, help="Sub-frames averaged."),
        click.option("--resolution", type=_Resolution(), help="Picture size, e.g. 640x360."),
        click.option("--frame", type=int, help="Animation frame."),
        click.option("--set", "assignments", multiple=True, metavar="NAME=VALUE",
                     help="Any setting, e.g. rsm.samples=200; repeatable."),
    )):  # fmt: skip
        function = option(function)
    return function


@click.group(cls=_Errors)
@click.version_option(__version__, prog_name="quartet")
def main() -> None:
    """Quartet GI: real-time global illumination for Blender scenes, measured against Cycles."""


@main.command("render")
@click.argument("scene", type=click.Path(path_type=Path))
@_scene_options
@click.option("--passes", default="Combined", help="'all', or pass names separated by commas (EXR only).")
@click.option("-o", "--output", required=True, type=click.Path(path_type=Path), help="OUT.exr or OUT.png.")
def render_command(scene, technique, samples, resolution, frame, assignments, passes, output) -> None:
    """Render SCENE (.blend, .glb, .gltf, .obj … or a snapshot .npz) to a file."""
    names = _pass_names(passes)
    if output.suffix.lower() not in (".exr", ".png"):
        raise click.UsageError(f"{output}: the output is .exr or .png")
    if not output.resolve().parent.is_dir():
        raise click.UsageError(f"{output}: the folder {output.resolve().parent} is not there")
    if scene.suffix.lower() == ".npz":
        plain = Scene.load(scene)
        settings = _settings(Settings(), technique, samples, assignments)
        resolution = resolution or (960, 540)
        with _progress("Rendering") as progress:
            result = render(plain, settings, names, resolution=resolution, progress=progress)
        _notes(result.notes)
        written = result.passes
    else:
        with _blender(scene, technique, samples, resolution, frame, assignments) as bscene:
            from .host import cycles, embedded, engine

            bscene.render.engine = "QUARTET"
            with _progress("Rendering") as progress:
                engine.listeners.append(progress)
                try:
                    if output.suffix.lower() == ".png":
                        embedded.render_png(bscene, output)
                        console.print(f"wrote {output}")
                        return
                    written = cycles.render_passes(bscene, names)
                finally:
                    engine.listeners.remove(progress)
    if output.suffix.lower() == ".png":
        from .compare import sheet

        sheet.write_png(output, written["Combined"])
    else:
        from .compare import exr

        exr.write(output, {name: written[name] for name in names if name in written})
    console.print(f"wrote {output}")


@main.command("snapshot")
@click.argument("scene", type=click.Path(path_type=Path))
@click.option("--frame", type=int, help="Animation frame.")
@click.option("--resolution", type=_Resolution(), help="Picture size that the camera is fitted to.")
@click.option("-o", "--output", type=click.Path(path_type=Path), help="OUT.npz; beside the scene by default.")
def snapshot_command(scene, frame, resolution, output) -> None:
    """Write what Quartet sees of SCENE as a .npz that renders identically without Blender."""
    output = output or scene.with_suffix(".npz")
    with _blender(scene, None, None, resolution, frame, ()) as bscene:
        from .host import embedded

        plain, resolution = embedded.plain(bscene)
        plain.save(output)
    console.print(f"wrote {output}: {plain.triangle_count()} triangles, for {resolution[0]}x{resolution[1]}")


@main.command("inspect")
@click.argument("scene", type=click.Path(path_type=Path))
@_scene_options
@click.option("--passes", default="Combined", help="'all', or pass names separated by commas.")
@click.option("--dot", is_flag=True, help="Print the graph as Graphviz dot instead.")
@click.option("--certify", is_flag=True, help="Measure against Cycles: error, dearer settings, ablation, predicted failures.")
@click.option("--reference-samples", default=256, show_default=True, help="Cycles samples per half, for --certify.")
def inspect_command(
    scene, technique, samples, resolution, frame, assignments, passes, dot, certify, reference_samples
) -> None:
    """Print which passes SCENE needs and which are left out, why, and their sizes."""
    names = _pass_names(passes)
    if certify:
        if scene.suffix.lower() == ".npz":
            raise click.UsageError("a snapshot has no Cycles reference: give the scene file itself")
        with _blender(scene, technique, samples, resolution or (128, 72), frame, assignments) as bscene:
            certify_command(scene, bscene, reference_samples)
        return
    if scene.suffix.lower() == ".npz":
        plain, resolution = Scene.load(scene), resolution or (960, 540)
        settings = _settings(Settings(), technique, samples, assignments)
    else:
        with _blender(scene, technique, samples, resolution, frame, assignments) as bscene:
            from .host import embedded, properties

            plain, resolution = embedded.plain(bscene)
            settings = properties.read(bscene)
    plan = inspect(plain, settings, names, resolution=resolution)
    click.echo(plan.graph_text() if dot else plan.text())
    if not dot and settings.technique == "SSDO" and settings.use_indirect_diffuse:
        unseen_command(plain, settings)
    _notes(plain.notes)


@main.command("compare")
@click.argument("scenes", nargs=-1, type=click.Path(path_type=Path))
@_scene_options
@click.option("--techniques", help="Techniques separated by commas, or 'all'.")
@click.option("--sweep", type=click.Choice(("none", "presets", "samples", "quick", "full")),
              help="How many settings of each technique to try.")
@click.option("--peers", default="", help="Rivals in the same run: cycles, eevee, or both separated by a comma.")
@click.option("--blender", metavar="PROGRAM",
              help="The Blender that EEVEE runs in; $QUARTET_BLENDER or 'blender' on the path if none is given.")
@click.option("--effects", is_flag=True, help="The paper's Table 1 with numbers, on scenes made for each effect.")
@click.option("--references", "references_folder", type=click.Path(path_type=Path, exists=True, file_okay=False),
              help="Folder of ready references, SCENE.npz; scenes that it lacks are rendered with Cycles.")
@click.option("--reference-samples", default=256, show_default=True, help="Cycles samples per half.")
@click.option("--visits", type=click.IntRange(1, 2), default=2, show_default=True,
              help="1 measures each candidate once; 2 goes there and back, so that a machine's drift shows.")
@click.option("--budget", type=click.FloatRange(0.0), default=60.0, show_default=True,
              help="Seconds of timed frames per candidate and visit: slow ones get fewer frames, as the report says.")
@click.option("-o", "--output", type=click.Path(path_type=Path), default=Path("quartet-compare"), show_default=True,
              help="Folder for the report, sheets and results.json.")
def compare_command(
    scenes, techniques, sweep, peers, blender, effects, references_folder, reference_samples, visits, budget, output, **options
) -> None:
    """Render SCENES with Quartet and with unbiased Cycles (R1 and R∞, cached) and state the error per pass.

    SCENES are files, or builtin:NAME. One scene alone gives a sheet; more scenes, --techniques, --sweep or --peers give
    report.html with the chart of speed against accuracy. An interrupted sweep goes on where it stopped.
    """
    if not scenes and not effects:
        raise click.UsageError("name a scene file, builtin:NAME, or --effects")
    if effects or len(scenes) > 1 or techniques or sweep or peers or references_folder:
        report_command(
            scenes, techniques, sweep or "none", peers, blender, effects, references_folder, reference_samples, visits, budget,
            output, options,
        )
    else:
        _sheet(scenes[0], reference_samples=reference_samples, output=output, **options)


def _sheet(scene, technique, samples, resolution, frame, assignments, reference_samples, output) -> None:
    """One technique on one scene: a table, a sheet of pictures and a JSON file."""
    from .compare.metrics import score
    from .compare.references import BOUNCES, reference
    from .compare.sheet import comparison
    from .compare.study import COMPARED

    with _blender(scene, technique, samples, resolution or (320, 180), frame, assignments) as bscene:
        from .host import cycles, embedded, engine, properties

        plain, size = embedded.plain(bscene)
        key = plain.digest()

        def run_cycles(bounces: int, count: int, seed: int) -> dict[str, np.ndarray]:
            with console.status(f"Cycles, {bounces} bounce{'s' * (bounces > 1)}, {count} samples, seed {seed}"):
                cycles.set_up(bscene, cycles.Reference(bounces, count, seed))
                return {n: p[..., :3] for n, p in cycles.render_passes(bscene, COMPARED).items()}

        references = {
            kind: reference(kind, key, size, reference_samples, COMPARED, run_cycles) for kind in BOUNCES
        }
        bscene.render.engine = "QUARTET"
        settings = properties.read(bscene)
        with _progress("Quartet") as progress:
            engine.listeners.append(progress)
            try:
                passes = {n: p[..., :3] for n, p in cycles.render_passes(bscene, COMPARED).items()}
            finally:
                engine.listeners.remove(progress)
    output.mkdir(parents=True, exist_ok=True)
    results: dict = {"scene": str(scene), "technique": settings.technique, "settings": settings.as_dict(),
                     "resolution": size, "reference_samples": reference_samples, "passes": {}}  # fmt: skip
    for kind, halves in references.items():
        table = Table(title=f"{scene.name}: {settings.technique} against {'R∞' if kind == 'Rinf' else kind}")
        for title in ("pass", "gain", "relMSE", "shape", "FLIP", "black", "constant", "noise floor"):
            table.add_column(title, justify="left" if title == "pass" else "right")
        rows = []
        for name in COMPARED:
            a, b = halves.a[name], halves.b[name]
            if name not in passes or (a.max() <= 0 and passes[name].max() <= 0):
                continue
            s = score(passes[name], a, b, flip=True)
            results["passes"].setdefault(name, {})[kind] = vars(s)
            table.add_row(name, f"{s.gain:.3f}", f"{s.rel_mse:.4f}", f"{s.shape:.4f}", f"{s.flip:.3f}",
                          f"{s.black:.3f}", f"{s.constant:.4f}", f"{s.noise_floor:.5f}")  # fmt: skip
            rows.append((name, passes[name], halves.mean(name)))
        Console().print(table)
        path = output / f"{scene.stem}-{settings.technique.lower()}-{kind}.png"
        comparison(path, rows, (settings.technique, f"Cycles {'R∞' if kind == 'Rinf' else kind}"))
        console.print(f"wrote {path}")
    (output / f"{scene.stem}-{settings.technique.lower()}.json").write_text(json.dumps(results, indent=1, default=float))


@main.command("settings")
def settings_command() -> None:
    """List all settings with defaults, ranges and what they do."""
    table = Table("setting", "default", "what it does")
    for path, default, meta in walk():
        table.add_row(path, str(default), meta.text)
    Console().print(table)


# --- helpers ----------------------------------------------------------------------------------------------------------


def _pass_names(text: str) -> tuple[str, ...]:
    if text.strip().lower() == "all":
        return tuple(OUTPUTS)
    by_lower = {name.lower(): name for name in OUTPUTS}
    names = []
    for part in text.split(","):
        name = by_lower.get(part.strip().lower())
        if name is None:
            raise click.UsageError(f"no pass {part.strip()!r}; there are {', '.join(OUTPUTS)}")
        names.append(name)
    return tuple(names)


def _settings(settings: Settings, technique, samples, assignments) -> Settings:
    """Apply the command line's options to ``settings``."""
    if technique:
        settings.set("technique", technique.upper())
    if samples is not None:
        settings.set("samples", samples)
    for assignment in assignments:
        name, separator, value = assignment.partition("=")
        if not separator:
            raise SettingError(f"--set {assignment}: write NAME=VALUE")
        settings.set(name.strip(), value.strip())
    return settings


@contextlib.contextmanager
def _blender(scene: Path, technique, samples, resolution, frame, assignments) -> Iterator:
    """The scene file open in the embedded Blender, with the options applied."""
    try:
        from .host import embedded, properties
    except ImportError as error:
        raise click.ClickException(
            "this needs Blender as a Python module: pip install 'quartet-gi[bpy]', or give a snapshot (.npz)"
        ) from error
    bscene, notes = embedded.open_scene(scene, frame, resolution)
    properties.write(bscene, _settings(properties.read(bscene), technique, samples, assignments))
    _notes(notes)
    yield bscene


@contextlib.contextmanager
def _progress(title: str) -> Iterator:
    """A progress bar; yields ``update(share, text)``."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"),
               TimeElapsedColumn(), TextColumn("{task.fields[text]}"))  # fmt: skip
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(title, total=1.0, text="")
        yield lambda share, text="": bar.update(task, completed=share, text=text)


def _notes(notes) -> None:
    for note in notes:
        console.print(f"note: {note}", style="yellow", highlight=False)


main.add_command(bench_command)
main.add_command(stability_command)


if __name__ == "__main__":
    sys.exit(main())
