document.querySelectorAll(".chooser button").forEach(button => button.addEventListener("click", () => {
  const chosen = button.dataset.case, section = button.closest("section");
  section.querySelectorAll(".chooser button").forEach(
    other => other.setAttribute("aria-pressed", String(other === button)));
  section.querySelectorAll("div[data-case], span[data-case]").forEach(part => { part.hidden = part.dataset.case !== chosen; });
  section.querySelectorAll("div[data-case]:not([hidden]) .js-plotly-plot").forEach(plot => Plotly.Plots.resize(plot));
  section.querySelectorAll("figure.by-case .js-plotly-plot").forEach(plot => {
    Plotly.restyle(plot, {visible: plot.data.map(t => t.meta === undefined || String(t.meta) === chosen)});
  });
}));
// on a narrow screen a legend beside the panel would leave it half the width
if (innerWidth < 600) document.querySelectorAll(".js-plotly-plot").forEach(plot => {
  const legend = plot.layout.legend || {};
  if (plot.closest(".panels") || !(legend.x > 1)) return;
  Plotly.relayout(plot, {"legend.orientation": "h", "legend.x": 0, "legend.y": -0.16, "legend.yanchor": "top"});
});
