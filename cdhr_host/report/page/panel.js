// What stands beside the view: built from the facts, as text only.
const byId = (id) => document.getElementById(id);

function made(tag, text, settings = {}) {
  const element = Object.assign(document.createElement(tag), settings);
  if (text !== undefined) element.textContent = text;
  return element;
}

const numberText = (value) => (Math.abs(value) >= 1000 ? value.toFixed(0) : Number(value.toPrecision(4)).toString());

function clockText(seconds) {
  const whole = Math.round(seconds), two = (each) => String(each).padStart(2, "0");
  const [hours, minutes] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60];
  return hours ? `${hours}:${two(minutes)}:${two(whole % 60)}` : `${minutes}:${two(whole % 60)}`;
}

// s: the range that nine of ten layers keep to, so that a massive base does not hide the others
function usual(layers) {
  const seconds = layers.filter((layer) => layer.height !== null).map((layer) => layer.seconds).sort((a, b) => a - b);
  const at = (share) => seconds[Math.round(share * (seconds.length - 1))] ?? 0;
  return seconds.length > 10 ? [at(0.05), at(0.95)] : [at(0), at(1)];
}

function row(cells, tag = "td", numeric = []) {
  const line = made("tr");
  cells.forEach((cell, k) => {
    const place = made(tag, cell instanceof Node ? undefined : cell, { className: numeric.includes(k) ? "number" : "" });
    if (cell instanceof Node) place.append(cell);
    line.append(place);
  });
  return line;
}

function showSummary(facts) {
  const [name, ...folders] = facts.file.split("/").reverse(), head = document.querySelector("h1");
  head.textContent = name;
  if (folders.length) head.append(made("small", folders.reverse().join("/") + "/"));
  const verdict = byId("verdict");
  verdict.textContent = facts.verdict === "refused" ? "refused" : `${facts.verdict} on ${facts.profile}`;
  verdict.className = facts.verdict === "can be printed" ? "good" : "bad";
  for (const [name, text] of facts.facts) {
    const line = made("tr");
    line.append(made("th", name), made("td", text));
    byId("facts").append(line);
  }
  const drawn = `${facts.count.toLocaleString("en")} vertices, at most ${numberText(facts.tolerance)} mm off the planned path`;
  document.querySelector("footer").textContent = `cdhr ${facts.version}. ${drawn}. Drag turns, Shift or two fingers move, `
    + "wheel zooms; keys: arrows, + and −, T top, F front, Home all, [ and ] layers. Click the path for its numbers.";
}

function showProblems(facts, choose) {
  const list = document.querySelector("#problems ol"), count = facts.total, warned = facts.warnings.length;
  const words = [count ? `${count} problem${count > 1 ? "s" : ""}` : "No problems", warned ? `${warned} warning${warned > 1 ? "s" : ""}` : ""];
  document.querySelector("#problems summary").textContent = words.filter(Boolean).join(", ");
  const all = [...facts.problems.map((each) => ({ ...each, css: "" })), ...facts.warnings.map((each) => ({ ...each, css: "warning" }))];
  all.forEach((problem, k) => {
    const item = made("li", undefined, { className: problem.css });
    const place = problem.line === null ? "" : `line ${problem.line}: `;
    const button = made("button", `${k + 1}  ${place}${problem.message}`, { disabled: !problem.at, onclick: () => choose(k) });
    if (problem.hint) button.append(made("small", problem.hint));
    item.append(button);
    list.append(item);
  });
  if (count > facts.problems.length) list.append(made("li", `${count - facts.problems.length} more like these, not listed`));
  return all;
}

function showTimes(facts, choose) {
  const head = document.querySelector("#times thead"), body = document.querySelector("#times tbody");
  if (!facts.layers.length) {
    byId("times").querySelector("div").replaceChildren(made("p", "Neither comments nor heights tell layers in this program."));
    return;
  }
  head.append(row(["layer", "z, mm", "begins", "takes", ""], "th", [1, 2, 3]));
  const long = Math.max(1.25 * usual(facts.layers)[1], 1e-9);
  facts.layers.forEach((layer, k) => {
    const bar = made("div", undefined, { className: layer.seconds > long ? "bar over" : "bar" });
    bar.style.width = `${Math.min((100 * layer.seconds) / long, 100)}%`;
    const line = row([layer.name, layer.height === null ? "" : layer.height.toFixed(2), layer.begin, layer.text, bar], "td", [1, 2, 3]);
    line.onclick = () => choose(k);
    body.append(line);
  });
}

function showExtremes(facts, find) {
  document.querySelector("#extremes thead").append(row(["column", "least", "line", "greatest", "line"], "th", [1, 2, 3, 4]));
  const link = (line) => made("button", String(line), { onclick: () => find(line) });
  for (const [name, low, lowLine, high, highLine] of facts.extremes)
    document.querySelector("#extremes tbody").append(row([name, numberText(low), link(lowLine), numberText(high), link(highLine)], "td", [1, 2, 3, 4]));
}

function showLegend(scale, quantity) {
  byId("legend-words").textContent = scale.unit ? `${scale.words}, ${scale.unit}` : `${scale.words}: 1 mid-window, 0 at its end`;
  const [low, high] = scale.shown, digits = Math.max(0, 2 - Math.floor(Math.log10(high - low)));
  byId("legend-low").textContent = (low > scale.low && !scale.marks ? "≤ " : "") + low.toFixed(Math.min(digits, 6));
  byId("legend-high").textContent = (high < scale.high ? "≥ " : "") + high.toFixed(Math.min(digits, 6));
  byId("legend-outside").hidden = !scale.marks;
  byId("ramp").getContext("2d").putImageData(new ImageData(colourTable(mapOf(quantity)), 256, 1), 0, 0);
}
