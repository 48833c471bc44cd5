"""Style sheet of the page, and the script behind its buttons."""

STYLE = """
:root { --ink: #1c2530; --muted: #5b6673; --rule: #d9dfe6; --soft: #f5f7f9; --accent: #1f4e79; }
* { box-sizing: border-box; }
body { margin: 0; background: white; color: var(--ink);
  font: 16px/1.55 Inter, "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 40px 28px 80px; }
header { border-bottom: 3px solid var(--accent); padding-bottom: 12px; }
h1 { font-size: 32px; line-height: 1.2; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 23px; margin: 56px 0 12px; padding-bottom: 6px; border-bottom: 1px solid var(--rule); }
h3 { font-size: 17px; margin: 28px 0 6px; }
p { max-width: 78ch; margin: 8px 0; }
.made { color: var(--muted); font-size: 14px; margin: 0; }
.cards { display: grid; grid-template-columns: repeat(auto-fit, minmax(230px, 1fr)); gap: 14px; margin: 24px 0; }
.card { border: 1px solid var(--rule); border-top: 3px solid var(--accent); padding: 14px 16px; }
.card b { display: block; font-size: 25px; line-height: 1.25; font-weight: 650; white-space: nowrap; }
.card span { display: block; font-weight: 600; font-size: 14px; }
.card small { display: block; color: var(--muted); font-size: 13px; line-height: 1.4; margin-top: 4px; }
sub { font-size: 0.68em; line-height: 0; }
sup { font-size: 0.7em; line-height: 0; }
.box { border-left: 5px solid; padding: 10px 16px; margin: 16px 0; font-size: 15px; }
.box ul { margin: 4px 0; padding-left: 20px; }
.good { border-color: #2c7a4b; background: #eff8f2; }
.bad { border-color: #c0262d; background: #fdf2f2; }
figure { margin: 26px 0 34px; break-inside: avoid; }
figcaption { color: var(--ink); font-size: 14.5px; line-height: 1.5; max-width: 96ch; margin-top: 6px; }
.chooser { position: sticky; top: 0; z-index: 5; background: white; padding: 10px 0; display: flex; flex-wrap: wrap;
  gap: 6px; align-items: center; border-bottom: 1px solid var(--rule); font-size: 14px; }
.chooser span { margin-right: 6px; font-weight: 600; }
.chooser button { font: inherit; color: var(--ink); background: white; border: 1px solid var(--rule); border-radius: 4px;
  padding: 4px 11px; cursor: pointer; }
.chooser button[aria-pressed="true"] { background: var(--accent); border-color: var(--accent); color: white; }
.chooser i { display: inline-block; width: 10px; height: 10px; border-radius: 5px; margin-right: 7px;
  border: 1px solid white; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 14px; margin: 12px 0; font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; border-bottom: 2px solid var(--ink); padding: 5px 12px 5px 0;
  vertical-align: bottom; }
td { border-bottom: 1px solid var(--rule); padding: 5px 16px 5px 0; vertical-align: top; }
.numeric th:not(:first-child), .numeric td:not(:first-child) { text-align: right; padding: 5px 0 5px 22px; }
.numeric td { white-space: nowrap; }
pre { background: var(--soft); border: 1px solid var(--rule); padding: 14px; font-size: 13px; line-height: 1.45;
  overflow-x: auto; }
details { margin: 14px 0; }
summary { cursor: pointer; font-weight: 600; }
@media print {
  main { max-width: none; padding: 0; }
  .chooser { position: static; }
  .chooser button:not([aria-pressed="true"]), .modebar { display: none; }
}
"""

SCRIPT = """
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
"""
