# SPDX-License-Identifier: GPL-3.0-or-later
"""The stability suite as a page: a matrix of verdicts, then every test with values, limits, plots and pictures."""

from __future__ import annotations

import math

from .page import chart, data_uri, document, esc, number, picture, table
from .stability import ERROR, FAIL, KNOWN, NATURE, NOT_APPLICABLE, PASS, REPORTED, TESTS, Curve, Finding

_CLASS = {PASS: "pass", FAIL: "fail", NATURE: "nature", NOT_APPLICABLE: "na", REPORTED: "reported", ERROR: "error"}


def _figure(curve: Curve):
    import plotly.graph_objects as go

    figure = go.Figure([go.Scatter(x=curve.x, y=y, name=name, mode="lines+markers") for name, y in curve.lines.items()])
    # A line on a logarithmic axis stands at its value, a text at its logarithm.
    for name, level in curve.limits.items():
        figure.add_hline(y=level, line={"color": "#d0453a", "dash": "dash", "width": 1})
        y = math.log10(level) if curve.log_y else level
        figure.add_annotation(x=1, xref="paper", xanchor="right", y=y, yanchor="bottom", text=name, showarrow=False)
    for name, place in curve.marks.items():
        figure.add_vline(x=place, line={"color": "#888", "dash": "dot", "width": 1})
        x = math.log10(place) if curve.log_x else place
        figure.add_annotation(x=x, xanchor="left", y=1, yref="paper", yanchor="top", text=name, showarrow=False)
    figure.update_layout(
        template="simple_white",
        height=280,
        margin={"l": 60, "r": 36, "t": 40, "b": 44},
        legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1.0, "yanchor": "bottom"},
        title={"text": curve.title, "font": {"size": 14}},
        xaxis={"title": curve.x_title, "type": "log" if curve.log_x else "linear"},
        yaxis={"title": curve.y_title, "type": "log" if curve.log_y else "linear"},
    )
    return figure


def _badge(finding: Finding) -> str:
    return f'<span class="{_CLASS[finding.verdict]}">{esc(finding.verdict)}</span>'


def page(results: dict[str, dict[str, Finding]], data: dict) -> str:
    """The whole HTML text."""
    techniques = list(results)
    keys = list(dict.fromkeys(k for findings in results.values() for k in findings))
    count = {v: sum(f.verdict == v for fs in results.values() for f in fs.values()) for v in _CLASS}
    summary = ", ".join(f"{n} {v}" for v, n in count.items() if n)
    parts = [
        "<h1>Where methods fail: the stability suite</h1>",
        f"<p class=lead>Quartet {esc(data['version'])} on {esc(data['driver'])}; "
        f"{'full' if data['full'] else 'quick'} sweep. {summary}.</p>",
        "<h2>Verdicts</h2>",
        table(
            ["test", "what is measured", *techniques],
            [
                [
                    f'<a href="#t{k}">{k} {esc(TESTS[k].title)}</a>',
                    f"<td class=text>{esc(TESTS[k].formula)}</td>",
                    *(_badge(results[t][k]) if k in results[t] else "" for t in techniques),
                ]
                for k in keys
            ],
        ),
    ]
    for key in keys:
        parts.append(f'<h2 id="t{key}">{key} · {esc(TESTS[key].title)}</h2><p class=quiet>{esc(TESTS[key].formula)}</p>')
        for technique in techniques:
            finding = results[technique].get(key)
            if finding is None:
                continue
            parts.append(f"<h3>{technique}: {_badge(finding)}</h3>")
            notes = [
                f"Why it cannot pass: {finding.nature}." if finding.verdict == NATURE else "",
                finding.note,
                f"Known: {KNOWN[technique, key]}." if finding.verdict == FAIL and (technique, key) in KNOWN else "",
            ]
            parts.append("".join(f"<p class=quiet>{esc(n)}</p>" for n in notes if n))
            if finding.quantities:
                parts.append(
                    table(
                        ["quantity", "value", "limit", ""],
                        [
                            [
                                q.name,
                                number(q.value, 4),
                                q.limit,
                                ""
                                if not q.limited
                                else "<span class=pass>holds</span>"
                                if q.holds
                                else "<span class=fail>misses</span>",
                            ]
                            for q in finding.quantities
                        ],
                    )
                )
            if finding.curves:
                parts.append("<div class=cols>")
                parts += [f"<div>{chart(_figure(c), f'c-{technique}-{key}-{i}')}</div>" for i, c in enumerate(finding.curves)]
                parts.append("</div>")
            parts += [picture(data_uri(image, enlarge=3), name) for name, image in finding.pictures.items()]
    return document("Quartet stability", "".join(parts), charts=True)
