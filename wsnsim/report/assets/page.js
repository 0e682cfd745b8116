"use strict";
(() => {
  const charts = [...document.querySelectorAll(".chart")];
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

  function theme(layout) {
    const ink = colour("--ink"), line = colour("--line"), soft = colour("--soft");
    const dressed = { ...layout, paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)" };
    dressed.font = { color: ink, family: getComputedStyle(document.body).fontFamily, size: 13 };
    dressed.hoverlabel = { bgcolor: colour("--panel"), bordercolor: line, font: { color: ink } };
    for (const key of Object.keys(dressed)) {
      if (/^[xy]axis\d*$/.test(key)) {
        dressed[key] = { ...dressed[key], gridcolor: line, linecolor: line, tickfont: { color: soft } };
      }
    }
    return dressed;
  }

  function draw(chart) {
    const figure = JSON.parse(document.getElementById(chart.id + "-data").textContent);
    const layout = theme(figure.layout);
    const width = chart.clientWidth;
    // A legend takes one line on a wide page and about a line for two entries on a phone.
    const shown = figure.data.filter((trace) => trace.showlegend !== false).length;
    const legend = width < 600 ? 20 * shown : 24 * Math.ceil(shown / 8);
    if (chart.dataset.aspect) {
      layout.height = Math.min(Math.max((width - 60) * Number(chart.dataset.aspect) + 70, 260), 700) + legend;
    } else {
      layout.height = (layout.height || 360) + legend;
    }
    return Plotly.react(chart, figure.data, layout, { responsive: true, displayModeBar: false });
  }

  charts.forEach(draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(draw));
})();
