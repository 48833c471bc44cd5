const choose = (section, chosen) => {
  section.querySelectorAll("div[data-case], span[data-case]").forEach(part => { part.hidden = part.dataset.case !== chosen; });
  section.querySelectorAll("div[data-case]:not([hidden]) .js-plotly-plot").forEach(plot => Plotly.Plots.resize(plot));
  section.querySelectorAll("figure.by-case .js-plotly-plot").forEach(plot => {
    Plotly.restyle(plot, {visible: plot.data.map(t => t.meta === undefined || String(t.meta) === chosen)});
  });
};
document.querySelectorAll(".chooser button").forEach(button => button.addEventListener("click", () => {
  const section = button.closest("section, .first");
  section.querySelectorAll(".chooser button").forEach(
    other => other.setAttribute("aria-pressed", String(other === button)));
  choose(section, button.dataset.case);
}));
document.querySelectorAll(".chooser select").forEach(list => list.addEventListener(
  "change", () => choose(list.closest("section, .first"), list.value)));
// on a narrow screen numbers along an axis stay upright, and as many as there is room for
if (innerWidth < 800) document.querySelectorAll(".js-plotly-plot").forEach(plot => {
  const all = plot._fullLayout || {}, change = {};
  Object.keys(all).filter(name => /^xaxis\d*$/.test(name) && all[name].type === "linear" && all[name].tickmode !== "array").forEach(name => {
    const {range, dtick, tickmode, _length} = all[name], most = Math.max(2, _length / 24), span = Math.abs(range[1] - range[0]);
    change[`${name}.tickangle`] = 0;
    if (tickmode === "linear") change[`${name}.dtick`] = [1, 2, 5, 10, 20, 50].map(k => k * dtick).find(step => span / step < most) || dtick;
  });
  if (Object.keys(change).length) Plotly.relayout(plot, change);
});
// on a narrow screen a legend beside the panel would leave it half the width: it stands below, and the figure grows by its height
if (innerWidth < 800) document.querySelectorAll(".js-plotly-plot").forEach(plot => {
  const whole = plot._fullLayout || {}, legend = whole.legend || {}; // what a template says stands nowhere else
  if (!(legend.x > 1)) return;
  const below = {orientation: "h", x: 0, xref: "container", y: 0, yref: "container", yanchor: "bottom"};
  const change = Object.fromEntries(Object.entries(below).map(([name, value]) => ["legend." + name, value]));
  Plotly.relayout(plot, change).then(() => {
    const drawn = plot.querySelector(".legend");
    const more = drawn ? drawn.getBoundingClientRect().height + 12 : 0;
    [plot, plot.parentElement].forEach(own => { own.style.height = `${whole.height + more}px`; });
    Plotly.relayout(plot, {height: whole.height + more, "margin.b": whole.margin.b + more});
  });
});
// a picture in space fills the height of its panel: in a narrow panel it is drawn smaller, so that nothing is cut at the sides
const fit = (plot, name) => {
  const {_size, [name]: {domain: {x, y}}} = plot._fullLayout;
  return Math.min(1, 0.9 * _size.w * (x[1] - x[0]) / (_size.h * (y[1] - y[0])));
};
const scaled = (ratio, by) => ({x: by * ratio.x, y: by * ratio.y, z: by * ratio.z});
const wide = new WeakMap(); // shapes of the scenes where there is room
const fitted = plot => {
  const own = (plot._fullLayout || {})._subplots, change = {}, figure = plot.closest("figure");
  if (!own || !plot.offsetParent || figure && figure.querySelector('form.shapes[data-of="modes"]')) return; // those fit themselves
  if (!wide.has(plot)) wide.set(plot, Object.fromEntries((own.gl3d || []).map(name => [name, plot._fullLayout[name].aspectratio])));
  Object.entries(wide.get(plot)).forEach(([name, ratio]) => { change[`${name}.aspectratio`] = scaled(ratio, fit(plot, name)); });
  if (Object.keys(change).length) Plotly.relayout(plot, change);
};
document.querySelectorAll(".js-plotly-plot").forEach(fitted);
// a figure in what was folded away has no width until it is opened
document.querySelectorAll("details").forEach(folded => folded.addEventListener("toggle", () => {
  if (folded.open) folded.querySelectorAll(".js-plotly-plot").forEach(plot => Plotly.Plots.resize(plot).then(() => fitted(plot)));
}));
document.querySelectorAll("button.rest").forEach(button => button.addEventListener("click", () => {
  button.closest(".table").querySelectorAll("tr[hidden]").forEach(row => { row.hidden = false; });
  button.remove();
}));
// plain numbers for a spreadsheet: no narrow spaces between thousands, no typographic minus
const cell = own => `"${own.innerText.replace(/\u202f/g, "").replace(/\u2212/g, "-").replace(/"/g, '""').replace(/\n/g, "; ")}"`;
document.querySelectorAll("button.csv").forEach(button => button.addEventListener("click", () => {
  const rows = [...button.closest(".table").querySelectorAll("tr")];
  const text = rows.map(row => [...row.cells].map(cell).join(",")).join("\r\n");
  const link = document.createElement("a"), section = button.closest("section, .first");
  const number = [...section.querySelectorAll("button.csv")].indexOf(button) + 1;
  link.href = URL.createObjectURL(new Blob(["\ufeff", text], {type: "text/csv"}));
  link.download = `${section.id || "answer"}_${number}.csv`;
  link.click();
}));
// paper shows what is folded away
addEventListener("beforeprint", () => document.querySelectorAll("details:not([open])").forEach(folded => {
  folded.open = true;
  addEventListener("afterprint", () => { folded.open = false; }, {once: true});
}));
// many verdicts, all open, would stand before the answer on paper: the first line stays, the list follows the numbers
addEventListener("beforeprint", () => {
  const box = document.querySelector("main > details.box"), numbers = document.querySelector("main > .cards") || document.querySelector("main > section");
  if (!box || !numbers || box.querySelectorAll("li").length <= 8) return;
  const line = document.createElement("p");
  line.className = box.className;
  line.append(Object.assign(document.createElement("b"), {textContent: box.querySelector("summary").textContent}));
  box.replaceWith(line);
  numbers[numbers.matches("section") ? "before" : "after"](box);
  addEventListener("afterprint", () => line.replaceWith(box), {once: true});
});
// lines of sentences do not break between a number and its unit, or before the value of a key
document.querySelectorAll(".card, figcaption, main p, main li").forEach(told => {
  const texts = document.createTreeWalker(told, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) {
    const own = texts.currentNode;
    own.data = own.data.replace(/(\d) (?=(?:%|dB|rpm|°|[kMµmnp]?(?:Hz|m|N|J|g|s|Pa|rad)\b))/g, "$1\u00a0").replace(/ = /g, " =\u00a0");
  }
});
