// SPDX-License-Identifier: GPL-3.0-or-later
// Charts in the page's own colours, light or dark; they follow when the reader changes over.
const CHARTS = {}, INK = '#222';
const themed = figure => {
  const style = getComputedStyle(document.documentElement), color = name => style.getPropertyValue(name).trim();
  const f = structuredClone(figure);
  Object.assign(f.layout, { paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)' });
  f.layout.modebar = { bgcolor: 'rgba(0,0,0,0)', color: color('--quiet'), activecolor: color('--ink'), orientation: 'v' };
  f.layout.font = { ...f.layout.font, color: color('--ink') };
  Object.keys(f.layout).filter(k => /^[xy]axis/.test(k)).forEach(k => Object.assign(f.layout[k],
    { color: color('--ink'), gridcolor: color('--line'), linecolor: color('--ink'), zerolinecolor: color('--line') }));
  f.data.forEach(t => [t.line, t.marker && t.marker.line].forEach(l => { if (l && l.color === INK) l.color = color('--ink'); }));
  return f;
};
const drawChart = (name, figure) => {
  CHARTS[name] = figure;
  const f = themed(figure);
  return Plotly.newPlot(name, f.data, f.layout, { responsive: true, displaylogo: false, modeBarButtonsToRemove: ['select2d', 'lasso2d'] })
    .then(() => { document.body.dataset.charts = +(document.body.dataset.charts || 0) + 1; });
};
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => Object.entries(CHARTS).forEach(([name, figure]) => {
  const f = themed(figure);
  Plotly.react(name, f.data, f.layout);
}));
