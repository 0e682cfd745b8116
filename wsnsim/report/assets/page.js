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

  function plot(chart, legend) {
    const figure = JSON.parse(document.getElementById(chart.id + "-data").textContent);
    const layout = theme(figure.layout);
    const width = chart.clientWidth;
    // The buttons below a map take a line of their own.
    const buttons = layout.updatemenus ? 20 : 0;
    const height = chart.dataset.aspect
      ? Math.min(Math.max((width - 60) * Number(chart.dataset.aspect) + 70, 260), 700) + buttons
      : layout.height || 360;
    layout.height = height + legend;
    return Plotly.react(chart, figure.data, layout, { responsive: true, displayModeBar: false });
  }

  // A legend pushes the figure down by as much as it takes, which only plotly knows.
  async function draw(chart) {
    await plot(chart, 300);
    const legend = chart.querySelector(".legend .bg");
    await plot(chart, legend ? Number(legend.getAttribute("height")) : 0);
  }

  charts.forEach(draw);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => charts.forEach(draw));
})();
