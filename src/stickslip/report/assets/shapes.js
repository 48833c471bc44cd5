// moves mode shapes and the motion at the peak in the page; needs plotly.js and nothing else
const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const player = (form, draw) => { // draws at the phase of a form, which its button lets run
  let playing = false;
  const step = () => {
    if (!playing) return;
    const phase = form.elements.phase;
    phase.value = (Number(phase.value) + 10) % 360;
    Promise.resolve(draw()).then(() => requestAnimationFrame(step));
  };
  form.addEventListener("input", () => { draw(); });
  form.addEventListener("submit", event => event.preventDefault());
  form.elements.play.addEventListener("click", () => {
    playing = !playing;
    form.elements.play.textContent = playing ? "stop" : "play";
    if (playing) step();
  });
  draw();
};
document.querySelectorAll('form.shapes[data-of="modes"]').forEach(form => {
  const figure = form.closest("figure"), holder = figure.querySelector('script[type="application/json"]');
  const plot = figure.querySelector(".js-plotly-plot");
  const data = JSON.parse(holder.textContent);
  const points = new Float32Array(bytes(data.points)), faces = new Int32Array(bytes(data.faces));
  const wheelPoints = new Int32Array(bytes(data.wheelPoints)), wheelFaces = new Int32Array(bytes(data.wheelFaces));
  const all = Int32Array.from({length: points.length / 3}, (_, n) => n);
  const cache = new Map();
  const shape = (wave, mode) => {
    const key = wave + "/" + mode;
    if (!cache.has(key)) cache.set(key, new Int16Array(bytes(data.shapes[wave][mode])));
    return cache.get(key);
  };
  const turn = angle => {  // Rodrigues' rotation about the axis
    const [a, b, c] = data.axis, co = Math.cos(angle), si = Math.sin(angle), v = 1 - co;
    return [co + a * a * v, a * b * v - c * si, a * c * v + b * si,
            b * a * v + c * si, co + b * b * v, b * c * v - a * si,
            c * a * v - b * si, c * b * v + a * si, co + c * c * v];
  };
  const column = (rows, part) => Int32Array.from({length: rows.length / 3}, (_, n) => rows[3 * n + part]);
  const build = whole => {  // nodes, triangles and places at rest of a view
    const nodes = whole ? wheelPoints : all, rows = whole ? wheelFaces : faces, copies = whole ? data.sectors : 1;
    const many = new Int32Array(rows.length * copies), rest = new Float32Array(3 * nodes.length * copies);
    for (let s = 0; s < copies; s++) {
      const r = turn(2 * Math.PI * s / data.sectors);
      for (let n = 0; n < rows.length; n++) many[s * rows.length + n] = rows[n] + s * nodes.length;
      for (let n = 0; n < nodes.length; n++) {
        const p = [0, 1, 2].map(d => points[3 * nodes[n] + d] - data.origin[d]);
        for (let d = 0; d < 3; d++) {
          rest[3 * (s * nodes.length + n) + d] =
            data.origin[d] + r[3 * d] * p[0] + r[3 * d + 1] * p[1] + r[3 * d + 2] * p[2];
        }
      }
    }
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let n = 0; n < rest.length; n++) {
      low[n % 3] = Math.min(low[n % 3], rest[n]); high[n % 3] = Math.max(high[n % 3], rest[n]);
    }
    const span = Math.max(...high.map((h, d) => h - low[d]));
    return {nodes, copies, rest, low, high, span, i: column(many, 0), j: column(many, 1), k: column(many, 2)};
  };
  const views = {}, view = name => views[name] ??= build(name === "wheel");
  const moved = (v, wave, mode, phase, size) => {
    const u = shape(wave, mode), n = v.nodes.length, total = n * v.copies;
    const out = [0, 1, 2].map(() => new Float32Array(total)), intensity = new Float32Array(total);
    const theta = 2 * Math.PI * data.waveNumbers[wave] / data.sectors, scale = size * v.span;
    let largest = 0;  // of the length of the displacement over all phases, on the view's points
    for (let p = 0; p < n; p++) {
      let sum = 0;
      for (let d = 0; d < 6; d++) sum += u[6 * v.nodes[p] + d] ** 2;
      largest = Math.max(largest, sum);
    }
    largest = Math.sqrt(largest) || 1;
    for (let s = 0; s < v.copies; s++) {
      const r = turn(2 * Math.PI * s / data.sectors), co = Math.cos(phase + s * theta), si = Math.sin(phase + s * theta);
      for (let p = 0; p < n; p++) {
        const at = 6 * v.nodes[p], to = s * n + p;
        const q = [0, 2, 4].map(d => (u[at + d] * co - u[at + d + 1] * si) / largest);
        intensity[to] = Math.hypot(q[0], q[1], q[2]);
        for (let d = 0; d < 3; d++) {
          out[d][to] = v.rest[3 * to + d] + scale * (r[3 * d] * q[0] + r[3 * d + 1] * q[1] + r[3 * d + 2] * q[2]);
        }
      }
    }
    return [...out, intensity];
  };
  let shown = "", fitted = 1; // of the width that the wheel needs at full size
  const draw = () => {
    const get = name => form.elements[name].value, name = get("view"), v = view(name);
    const wave = Number(get("wave")), mode = Number(get("mode"));
    const [x, y, z, intensity] =
      moved(v, wave, mode, Number(get("phase")) * Math.PI / 180, Number(get("size")) / 100);
    const title = `${data.waves[wave]}, mode ${mode + 1}: ${data.hertz[wave][mode]} Hz`;
    const change = {x: [x], y: [y], z: [z], intensity: [intensity]}, layout = {};
    if (plot.layout.title.text !== title) layout["title.text"] = title;
    const {_size, scene} = plot._fullLayout, fit = Math.min(1, _size.w / (_size.h * (scene.domain.y[1] - scene.domain.y[0])));
    if (shown !== name || fitted !== fit) {
      Object.assign(change, {i: [v.i], j: [v.j], k: [v.k]});
      const size = {}, margin = 0.1 * v.span, longest = v.span + 2 * margin;
      ["x", "y", "z"].forEach((a, d) => {
        layout[`scene.${a}axis.range`] = [v.low[d] - margin, v.high[d] + margin];
        size[a] = 2.2 * fit * (v.high[d] - v.low[d] + 2 * margin) / longest;
      });
      layout["scene.aspectratio"] = size;
      const [a, b, c] = data.axis;  // look along the wheel's axis at a slant, on the sector from the side
      const eye = name === "wheel" ? [a + 0.5, b - 0.45, c + 0.4] : [1.1, -1.3, 0.8];
      const up = Math.abs(c) > 0.7 && name === "wheel" ? [0, 1, 0] : [0, 0, 1];
      const xyz = v3 => ({x: v3[0], y: v3[1], z: v3[2]});
      layout["scene.camera.eye"] = xyz(eye);
      layout["scene.camera.up"] = xyz(up);
      [shown, fitted] = [name, fit];
      document.body.dataset.shapes = `${name} ${v.nodes.length * v.copies}`;
      Plotly.restyle(plot, {visible: name === "sector"}, [1]);
    }
    const done = Plotly.restyle(plot, change, [0]);
    return Object.keys(layout).length ? done.then(() => Plotly.relayout(plot, layout)) : done;
  };
  [form.elements.wave.value, form.elements.mode.value] = data.shown;
  // on a narrow screen the colour bar lies below the wheel, inside the plot: beside it, it would take a third
  const width = plot.clientWidth, bar = 74, high = width + 44 + bar;
  if (width < 560) {
    plot.style.height = plot.parentElement.style.height = `${high}px`;
    // plotly draws a turned colour bar over the old one unless that is taken away first
    const turned = {
      "colorbar.orientation": "h", "colorbar.len": 0.8, "colorbar.x": 0.5, "colorbar.xanchor": "center", "colorbar.y": 0,
      "colorbar.yanchor": "bottom", "colorbar.title.text": "displacement / largest", "colorbar.title.side": "top", showscale: true,
    };
    Plotly.restyle(plot, {showscale: false}, [0])
      .then(() => Plotly.update(plot, turned, {height: high, "scene.domain.y": [bar / (width + bar), 1]}, [0]))
      .then(() => player(form, draw));
  } else player(form, draw);
});
document.querySelectorAll('form.shapes[data-of="motion"]').forEach(form => {
  const figure = form.closest("figure"), plot = figure.querySelector(".js-plotly-plot");
  const data = JSON.parse(figure.querySelector('script[type="application/json"]').textContent);
  const rest = Float32Array.from([...new Float32Array(bytes(data.points)), ...new Float32Array(bytes(data.contacts))]);
  const edges = new Int32Array(bytes(data.edges)), frames = new Float32Array(bytes(data.frames));
  const all = rest.length / 3, drawn = bytes(data.points).byteLength / 12, touching = all - drawn;
  const cache = new Map();
  const known = name => { // motion and states of a case; none where the page does not hold it
    if (!cache.has(name) && data.cases[name]) {
      const own = data.cases[name];
      cache.set(name, {...own, motion: new Int16Array(bytes(own.motion)), states: new Int8Array(bytes(own.states))});
    }
    return cache.get(name);
  };
  let chosen = String(data.chosen);
  const draw = () => {
    const own = known(chosen), phase = Number(form.elements.phase.value) * Math.PI / 180;
    const now = rest.slice(), size = Number(form.elements.size.value) / 100;
    if (own && own.largest) {
      const scale = size * data.span / own.largest * own.unit;
      for (let h = 0; h < own.harmonics; h++) {
        const co = scale * Math.cos((h + 1) * phase), si = scale * Math.sin((h + 1) * phase), first = 6 * all * h;
        for (let n = 0; n < 3 * all; n++) now[n] += own.motion[first + 2 * n] * co - own.motion[first + 2 * n + 1] * si;
      }
    }
    const axis = (from, count, d) => Float32Array.from({length: count}, (_, n) => now[3 * (from + n) + d]);
    const lines = (count, at) => [0, 1, 2].map(d => Float32Array.from({length: 3 * count}, (_, n) => n % 3 === 2 ? NaN : at(Math.floor(n / 3), n % 3, d)));
    const skin = [0, 1, 2].map(d => axis(0, drawn, d)), spots = [0, 1, 2].map(d => axis(drawn, touching, d));
    const rims = lines(edges.length / 2, (k, end, d) => now[3 * edges[2 * k + end] + d]);
    const traces = [0, 1, 2, 3], places = [skin, skin, rims, spots], shown = form.elements.frames && form.elements.frames.checked;
    if (shown) [0, 1, 2].forEach(k => {
      traces.push(4 + k);
      places.push(lines(touching, (c, end, d) => now[3 * (drawn + c) + d] + end * data.frameLength * frames[9 * c + 3 * d + k]));
    });
    const change = {};
    ["x", "y", "z"].forEach((name, d) => { change[name] = places.map(own => own[d]); });
    const at = own ? Math.floor(phase / (2 * Math.PI) * own.states.length / touching) % (own.states.length / touching) : 0;
    const states = own ? Int8Array.from({length: touching}, (_, c) => own.states[c * own.states.length / touching + at]) : new Int8Array(touching);
    return Plotly.restyle(plot, change, traces)
      .then(() => Plotly.restyle(plot, {"marker.color": [states]}, [3]))
      .then(() => Plotly.restyle(plot, {visible: Boolean(shown)}, [4, 5, 6]));
  };
  if (form.elements.view) form.elements.view.addEventListener("change", () => {
    const view = data.views[form.elements.view.value];
    Plotly.relayout(plot, {...view, "scene.aspectratio": scaled(view["scene.aspectratio"], fit(plot, "scene"))});
  });
  const section = form.closest("section");
  if (section) section.querySelectorAll(".chooser button").forEach(button => button.addEventListener("click", () => {
    chosen = button.dataset.case;
    draw();
  }));
  player(form, draw);
});
