# SPDX-License-Identifier: GPL-3.0-or-later
"""Self-contained HTML pages: everything they show is in the file, nothing is fetched."""

from __future__ import annotations

import base64
import html
import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .sheet import png, srgb

# What is drawn in the text's colour, dark or light: the page puts that in its place.
INK = "#222"
# Okabe and Ito's colours, told apart with any colour vision.
COLORS = {
    "RSM": "#0072B2",
    "LPV": "#009E73",
    "VCT": "#D55E00",
    "SSDO": "#CC79A7",
    "HYBRID": "#E69F00",
    "AUTO": "#56B4E9",
    "Cycles": "#777777",
    "Cycles + OIDN": "#aaaaaa",
    "EEVEE": "#F0E442",
}

_HERE = Path(__file__).parent


def esc(text: Any) -> str:
    return html.escape(str(text))


def number(value: float | None, digits: int = 3) -> str:
    """A number for people: significant digits, no exponent where it is readable without."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value == 0:
        return "0"
    if 1e-4 <= abs(value) < 1e5:
        places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
        return f"{value:.{places}f}"
    return f"{value:.{digits - 1}e}"


def finite(value: Any) -> Any:
    """``value`` as JSON can hold it: numbers that are not finite become None, arrays lists."""
    if isinstance(value, dict):
        return {str(k): finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(v) for v in value]
    if isinstance(value, np.ndarray):
        return finite(value.tolist())
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, np.integer):
        return int(value)
    return value


def dump(value: Any) -> str:
    """Strict JSON text."""
    return json.dumps(finite(value), indent=1, ensure_ascii=False, allow_nan=False)


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """An HTML table; cells are text, or ready HTML where they start with ``<``."""

    def cell(value: Any) -> str:
        text = number(value) if value is None or isinstance(value, float) else str(value)
        inner = text if text.startswith("<") else esc(text)
        return inner if text.startswith("<td") else f"<td>{inner}</td>"

    lines = ["<div class=scroll><table><thead><tr>", *(f"<th>{esc(h)}</th>" for h in head), "</tr></thead><tbody>"]
    lines += ["<tr>" + "".join(cell(v) for v in row) + "</tr>" for row in rows]
    return "".join([*lines, "</tbody></table></div>"])


def data_uri(linear: np.ndarray, *, scale: float = 1.0, enlarge: int = 1) -> str:
    """(H, W, 3) linear, row 0 at the bottom, as an sRGB PNG in a data URI."""
    return bytes_uri(srgb(linear[::-1, :, :3] * scale), enlarge=enlarge)


def bytes_uri(rgb: np.ndarray, *, enlarge: int = 1) -> str:
    """(H, W, 3) uint8, row 0 at the top, as a PNG in a data URI."""
    data = png(np.repeat(np.repeat(rgb, enlarge, axis=0), enlarge, axis=1))
    return "data:image/png;base64," + base64.b64encode(data).decode()


def picture(uri: str, caption: str, width: int | None = None) -> str:
    size = f" width={width}" if width else ""
    return f'<figure><img src="{uri}" alt="{esc(caption)}"{size}><figcaption>{esc(caption)}</figcaption></figure>'


def wall(index: int, size: Sequence[int], heat_map: str) -> str:
    """An image wall's HTML: any two pictures of ``size`` (width, height), one wiped over the other. ``index`` is its place in
    what :func:`wall_script` is given; ``heat_map`` is HTML that says what the heat maps show."""
    width, height = size
    return (
        f'<div class=wall data-scene="{index}"><p>Pass <select class=pass></select> left <select class=left></select> '
        f"right <select class=right></select> <label><input type=checkbox class=heat> error of the left picture as a heat map"
        f'</label></p><div class=wipe style="aspect-ratio:{width}/{height}"><img class=base alt=right>'
        f'<img class=top alt=left><div class=bar></div><span class="tag l"></span><span class="tag r"></span></div>'
        f"<p class=quiet>Drag to wipe. Heat map: {heat_map}.</p></div>"
    )


def wall_script(walls: Sequence[dict[str, dict[str, dict[str, str]]]]) -> str:
    """The script of a page's image walls. Per wall: pass -> name -> ``image`` and perhaps ``heat``, data URIs. The third
    picture shows on the left at first, the first on the right."""
    data = dump(list(walls)).replace("</", "<\\/")
    return f"const WALLS = {data};\n{(_HERE / 'wall.js').read_text()}"


# Anchors of the magma colour map (S. van der Walt and N. Smith, CC0), evenly spaced; linear between them.
_MAGMA = np.array(
    [
        (0, 0, 4),
        (20, 14, 54),
        (59, 15, 112),
        (100, 26, 128),
        (140, 41, 129),
        (183, 55, 121),
        (222, 73, 104),
        (247, 112, 92),
        (254, 159, 109),
        (254, 207, 146),
        (252, 253, 191),
    ],
    float,
)


def heat(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """A map (H, W) on a logarithmic scale as (H, W, 3) uint8, row order kept."""
    return magma((np.log10(np.maximum(values, 1e-12)) - math.log10(low)) / (math.log10(high) - math.log10(low)))


def magma(values: np.ndarray) -> np.ndarray:
    """A map (H, W) of values from 0 to 1 in the colours of magma, (H, W, 3) uint8, row order kept."""
    t = np.clip(np.nan_to_num(values), 0.0, 1.0) * (len(_MAGMA) - 1)
    i = np.minimum(t.astype(int), len(_MAGMA) - 2)
    f = (t - i)[..., None]
    return (_MAGMA[i] * (1 - f) + _MAGMA[i + 1] * f + 0.5).astype(np.uint8)


def plotly_source() -> str:
    """plotly.js, to embed. Raises RuntimeError with what to install."""
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as error:
        raise RuntimeError("charts need the plotly package: pip install 'quartet-gi[report]'") from error
    return get_plotlyjs()


def chart(figure: Any, name: str) -> str:
    """A plotly figure as a div and the script that draws it; the page must hold plotly.js."""
    body = figure.to_json().replace("</", "<\\/")
    return f'<div class=chart id="{name}" style="width:100%"></div><script>drawChart("{name}",{body})</script>'


def document(title: str, body: str, *, charts: bool, scripts: str = "") -> str:
    """A whole page."""
    source = f"<script>{plotly_source()}</script><script>{(_HERE / 'charts.js').read_text()}</script>" if charts else ""
    css = (_HERE / "page.css").read_text()
    return (
        f'<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content="width=device-width">'
        f"<title>{esc(title)}</title><style>{css}</style>{source}</head><body>{body}<script>{scripts}</script></body></html>"
    )
