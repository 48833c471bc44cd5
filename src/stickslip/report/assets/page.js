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
