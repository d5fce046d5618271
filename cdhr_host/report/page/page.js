// Unpacks the data, and ties view and panel together.
class Trail {
  constructor(facts, bytes) {
    this.facts = facts;
    const count = facts.count;
    let at = 0;
    const column = (Kind) => {
      const values = new Kind(bytes.buffer, at, count);
      at += values.byteLength;
      for (let i = 1; i < count; i++) values[i] += values[i - 1]; // differences; whole numbers wrap round
      return values;
    };
    this.t = column(Uint32Array);
    this.line = column(Uint32Array);
    const axes = [0, 1, 2].map(() => column(Uint16Array));
    this.xyz = new Uint16Array(3 * count);
    axes.forEach((axis, k) => axis.forEach((value, i) => { this.xyz[3 * i + k] = value; }));
    this.values = { speed: column(Uint16Array), margin: column(Uint16Array), pressure: column(Uint16Array) };
    this.flow = column(Uint8Array);
    this.scales = facts.scales;
    this.layers = facts.layers.length ? facts.layers : this.parts(60);
    this.bead = this.beadHeight();
    if (facts.layers.length) this.layerTimes();
  }

  place(i) {
    const { low, high } = this.facts.box;
    return low.map((each, k) => each + ((high[k] - each) * this.xyz[3 * i + k]) / 65535);
  }

  value(name, i) {
    const { low, high } = this.facts.scales[name];
    return low + ((high - low) * this.values[name][i]) / 65535;
  }

  // without layers: equal parts of the time
  parts(count) {
    const end = this.t.length ? this.t[this.t.length - 1] : 0;
    return [...Array(count).keys()].map((k) => {
      const from = (end * k) / count;
      return { first: k ? this.firstAt(this.t, from) : 0, begin: clockText(from / 1000), seconds: end / count / 1000 };
    });
  }

  firstAt(sorted, value) {
    let [low, high] = [0, sorted.length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (sorted[middle] < value) low = middle + 1; else high = middle;
    }
    return Math.min(low, Math.max(sorted.length - 1, 0));
  }

  // ribbons as high as a layer make a wall look like one
  beadHeight() {
    const heights = this.facts.layers.map((layer) => layer.height).filter((each) => each !== null);
    const steps = heights.slice(1).map((each, k) => each - heights[k]).filter((each) => each > 0.05).sort((a, b) => a - b);
    return Math.min(steps.length ? steps[steps.length >> 1] : Infinity, this.facts.bead);
  }

  layerTimes() {
    const seconds = this.layers.map((layer) => layer.seconds), high = Math.max(...seconds), low = Math.min(...seconds);
    const span = high > low ? high - low : 1, values = new Uint16Array(this.t.length);
    const [least, most] = usual(this.layers);
    this.layers.forEach((layer, k) => values.fill(Math.round((65535 * (seconds[k] - low)) / span), layer.first, this.end(k)));
    this.values.layer = values;
    this.scales.layer = { words: "layer time", unit: "s", low, high: low + span, laid: [least, most > least ? most : least + span] };
  }

  end(k) {
    return k + 1 < this.layers.length ? this.layers[k + 1].first : this.t.length;
  }
}

class View {
  constructor(trail) {
    this.trail = trail;
    this.camera = new Camera(trail.facts.box);
    this.travel = true;
    this.last = trail.layers.length - 1;
    this.alone = false;
    this.scene = this.opened();
    this.fit();
  }

  opened() {
    try {
      return new Scene(byId("scene"), this.trail);
    } catch (error) {
      const canvas = byId("scene"), fresh = canvas.cloneNode(true);
      canvas.replaceWith(fresh);
      byId("message").textContent = `No view in three dimensions here (${error.message}); this one is drawn coarsely. All numbers are complete.`;
      byId("message").hidden = false;
      return new FlatScene(fresh, this.trail);
    }
  }

  fit() {
    const { clientWidth, clientHeight } = byId("scene");
    this.camera.aspect = clientWidth / Math.max(clientHeight, 1);
  }

  // what the layer slider leaves to be seen: [first, last] vertex
  range() {
    const first = this.alone ? this.trail.layers[this.last].first : 0;
    return [Math.max(first - 1, 0), Math.max(this.trail.end(this.last) - 1, 0)];
  }

  colour(name) {
    this.quantity = name;
    const scale = this.trail.scales[name], marks = name === "margin" && scale.low < 0;
    const low = marks ? 0 : scale.laid[0], high = Math.max(scale.laid[1], low + 1e-9);
    const share = (value) => (value - scale.low) / (scale.high - scale.low);
    this.scene.colour(name, this.trail.values[name], [share(low), share(high)], marks);
    showLegend({ ...scale, shown: [low, high], marks }, name);
    this.draw(true);
  }

  // quick while something moves; whole as soon as it rests
  draw(quick = false) {
    this.quick = quick;
    clearTimeout(this.rest);
    this.asked ??= requestAnimationFrame((now) => {
      this.asked = undefined;
      this.fit();
      const { clientWidth: width, clientHeight: height } = byId("scene");
      this.matrix = this.camera.matrix(width / Math.max(height, 1));
      this.scene.draw(this.matrix, this.range(), { ...this.inks(), travel: this.travel, quick: this.quick });
      this.pins?.forEach((pin) => this.pin(pin, width, height));
      if (this.quick) requestAnimationFrame((next) => this.shown(next - now));
      document.documentElement.dataset.frames = String(Number(document.documentElement.dataset.frames || 0) + 1);
    });
  }

  // a quick frame is on the screen; if nothing else moves, a whole one follows
  shown(took) {
    this.scene.pace?.(took);
    clearTimeout(this.rest);
    if (!this.asked) this.rest = setTimeout(() => this.draw(), 160);
  }

  inks() {
    const ink = (name) => {
      const hex = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
      return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
    };
    const [back, soft] = [ink("--view"), ink("--soft")];
    return { back, faint: back.map((each, k) => 0.45 * each + 0.55 * soft[k]) };
  }

  pin({ element, at }, width, height) {
    const [x, y, w] = projected(this.matrix, at, width, height);
    const edge = element.className === "axis" ? 36 : -20;
    element.style.display = w > 0 && x > edge && x < width - edge && y > edge && y < height - edge ? "" : "none";
    element.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px) translate(-50%, -50%)`;
  }

  // the camera flies to a place
  goTo(at) {
    const from = [...this.camera.target], start = performance.now(), far = this.camera.distance;
    const near = Math.min(far, this.camera.fitted(Math.max(this.camera.radius / 4, 10)));
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    const fly = (now) => {
      const share = still ? 1 : Math.min((now - start) / 350, 1), ease = share * share * (3 - 2 * share);
      this.camera.target = from.map((each, k) => each + ease * (at[k] - each));
      this.camera.distance = far + ease * (near - far);
      this.draw(share < 1);
      if (share < 1) requestAnimationFrame(fly);
    };
    requestAnimationFrame(fly);
  }

  // where the path passes a place on the screen, within 14 pixels: the vertex it comes from, and how far on; or null
  pick(x, y) {
    const { clientWidth: width, clientHeight: height } = byId("scene"), [first, last] = this.range();
    let [nearest, found, depth] = [14 ** 2, null, Infinity], before = null;
    for (let i = first; i <= last; i++) {
      const here = projected(this.matrix, this.trail.place(i), width, height), w = here[2];
      if (before && w > 0 && before[2] > 0 && (this.travel || this.trail.flow[i])) {
        const [dx, dy] = [here[0] - before[0], here[1] - before[1]], square = dx * dx + dy * dy;
        const along = square ? Math.min(Math.max(((x - before[0]) * dx + (y - before[1]) * dy) / square, 0), 1) : 0;
        const away = (before[0] + along * dx - x) ** 2 + (before[1] + along * dy - y) ** 2;
        if (away < nearest && (away < nearest - 16 || w < depth)) [nearest, found, depth] = [away, { i: i - 1, along }, w];
      }
      before = here;
    }
    return found;
  }

  // numbers part of the way from a vertex to the next
  read(i, along = 0) {
    const { trail } = this, next = Math.min(i + 1, trail.t.length - 1);
    const between = (number) => (1 - along) * number(i) + along * number(next);
    const [x, y, z] = [0, 1, 2].map((axis) => between((k) => trail.place(k)[axis]).toFixed(2));
    const shown = (name, digits) => between((k) => trail.value(name, k)).toFixed(digits);
    byId("readout").textContent = `line ${trail.line[along > 0 ? next : i]}  at ${clockText(between((k) => trail.t[k]) / 1000)}\n`
      + `x ${x}  y ${y}  z ${z} mm\n${shown("speed", 1)} mm/s  margin ${shown("margin", 2)}  ${shown("pressure", 1)} kPa`;
    byId("readout").hidden = false;
  }
}

function listen(view) {
  const canvas = byId("scene"), fingers = new Map();
  let moved = 0, apart = 0;
  const size = () => Math.max(canvas.clientHeight, 1);
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, event);
    [moved, apart] = [0, 0];
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    fingers.set(event.pointerId, event);
    moved += Math.abs(dx) + Math.abs(dy);
    if (fingers.size > 1) {
      const [a, b] = [...fingers.values()], gap = Math.hypot(a.clientX - b.clientX, a.clientY - b.clientY);
      if (apart && gap) view.camera.zoom(apart / gap);
      apart = gap;
      view.camera.pan(dx / 2 / size(), -dy / 2 / size());
    } else if (event.shiftKey || event.buttons & 6) view.camera.pan(dx / size(), -dy / size());
    else view.camera.turn((dx * 4) / size(), (dy * 4) / size());
    view.draw(true);
  });
  const lift = (event) => {
    if (fingers.delete(event.pointerId) && event.type === "pointerup" && moved < 5 && !fingers.size) {
      const edge = canvas.getBoundingClientRect();
      const found = view.pick(event.clientX - edge.left, event.clientY - edge.top);
      if (found) view.read(found.i, found.along);
      else byId("readout").hidden = true;
    }
  };
  canvas.addEventListener("pointerup", lift);
  canvas.addEventListener("pointercancel", lift);
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    view.camera.zoom(Math.exp(Math.sign(event.deltaY) * Math.min(Math.abs(event.deltaY), 120) / 600));
    view.draw(true);
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => press(view, event));
  canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => {
    view.scene = view.opened();
    view.colour(view.quantity);
  });
  new ResizeObserver(() => view.draw()).observe(canvas);
}

function press(view, event) {
  const { camera } = view, shift = event.shiftKey;
  const arrow = (right, up) => (shift ? camera.pan(right * 0.05, up * 0.05) : camera.turn(right * 0.1, up * 0.1));
  const keys = {
    ArrowLeft: () => arrow(-1, 0), ArrowRight: () => arrow(1, 0), ArrowUp: () => arrow(0, 1), ArrowDown: () => arrow(0, -1),
    "+": () => camera.zoom(0.85), "=": () => camera.zoom(0.85), "-": () => camera.zoom(1 / 0.85),
    t: () => camera.top(), f: () => camera.front(), Home: () => camera.home(),
    "[": () => step(view, -1), "]": () => step(view, 1),
  };
  if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  keys[event.key]();
  view.draw(true);
}

function step(view, by) {
  showUpTo(view, Math.min(Math.max(view.last + by, 0), view.trail.layers.length - 1));
}

function showUpTo(view, k) {
  view.last = k;
  byId("slider").value = k;
  const layer = view.trail.layers[k], named = view.trail.facts.layers.length > 0;
  const height = layer.height === null || layer.height === undefined ? "" : `, z ${layer.height.toFixed(2)} mm`;
  const end = layer.seconds * (k + 1);
  byId("slider-text").textContent = named ? `layer ${layer.name}${height}, begins at ${layer.begin}` : `up to ${clockText(end)}`;
  document.querySelectorAll("#times tbody tr").forEach((line, i) => line.classList.toggle("shown", i === k));
  view.draw(true);
}

function controls(view, facts) {
  const slider = byId("slider"), words = { speed: "speed", margin: "force margin", pressure: "pressure", layer: "layer time" };
  slider.max = view.trail.layers.length - 1;
  if (!facts.layers.length) byId("slider-words").textContent = "Time";
  slider.oninput = () => showUpTo(view, Number(slider.value));
  byId("alone").onchange = (event) => { view.alone = event.target.checked; view.draw(); };
  byId("travel").onchange = (event) => { view.travel = event.target.checked; view.draw(); };
  for (const name of Object.keys(words).filter((each) => view.trail.values[each])) {
    const label = made("label", words[name]), input = made("input", undefined, { type: "radio", name: "colour", value: name });
    input.checked = name === "speed";
    input.onchange = () => view.colour(name);
    label.prepend(input);
    byId("colours").append(label);
  }
  document.querySelectorAll("[data-view]").forEach((button) => {
    button.onclick = () => { view.camera[button.dataset.view](); view.draw(); };
  });
  byId("theme").onclick = () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark", view);
}

function setTheme(theme, view) {
  document.documentElement.dataset.theme = theme;
  view?.draw();
}

function marks(view, facts) {
  const choose = (k) => {
    document.querySelectorAll("#problems li button, .pin").forEach((each) => each.classList.toggle("chosen", each.dataset.k === String(k)));
    view.goTo(all[k].at);
  };
  const all = showProblems(facts, choose);
  document.querySelectorAll("#problems li button").forEach((button, k) => { button.dataset.k = k; });
  view.pins = all.map((problem, k) => ({ ...problem, k })).filter((problem) => problem.at).map((problem) => {
    const element = made("button", String(problem.k + 1), { className: `pin ${problem.css}`, title: problem.message, onclick: () => choose(problem.k) });
    element.dataset.k = problem.k;
    return { element, at: problem.at };
  });
  const radius = facts.bed.radius;
  for (const [name, at] of [["x", [radius, 0, 0]], ["y", [0, radius, 0]]])
    view.pins.push({ element: made("span", `${name} ${numberText(radius)} mm`, { className: "axis" }), at });
  byId("pins").append(...view.pins.map((pin) => pin.element));
}

function nothing() {
  Object.assign(byId("message"), { textContent: "Nothing of this program moves.", hidden: false });
  for (const each of [byId("legend"), ...document.querySelectorAll("fieldset"), byId("times"), byId("extremes")]) each.hidden = true;
}

async function unpacked(text) {
  const packed = Uint8Array.from(atob(text.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function open() {
  const facts = JSON.parse(byId("facts-data").textContent);
  setTheme(matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
  showSummary(facts);
  const trail = new Trail(facts, await unpacked(byId("vertices-data").textContent));
  const view = new View(trail);
  controls(view, facts);
  marks(view, facts);
  showTimes(facts, (k) => showUpTo(view, k));
  showExtremes(facts, (line) => {
    const i = trail.firstAt(trail.line, line);
    view.read(i);
    view.goTo(trail.place(i));
  });
  listen(view);
  showUpTo(view, view.last);
  view.colour("speed");
  if (!facts.count) nothing();
  window.cdhr = view; // for the browser's own console
  document.documentElement.dataset.ready = "yes";
}

open().catch((error) => {
  byId("message").textContent = `This page could not be drawn: ${error.message}`;
  byId("message").hidden = false;
  throw error;
});
