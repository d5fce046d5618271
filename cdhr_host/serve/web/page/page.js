"use strict";
const by = (id) => document.getElementById(id);
const seen = {};
const WANTED = ["webhooks", "print_stats", "virtual_sdcard", "display_status", "gcode_move", "cables", "air", "workspace"];
let socket = null, calls = new Map(), number = 0, heard = 0, dragging = null;
const key = () => sessionStorage.getItem("key") || "";
const headers = () => (key() ? { "X-Api-Key": key() } : {});

function tell(text, when = Date.now() / 1000) {
  const item = document.createElement("li"), time = document.createElement("time");
  time.textContent = new Date(when * 1000).toLocaleTimeString() + " ";
  item.append(time, text);
  if (/^!!|refused|not |unknown/i.test(text)) item.className = "bad";
  const list = by("messages"), below = list.scrollTop + list.clientHeight >= list.scrollHeight - 8;
  list.append(item);
  while (list.children.length > 200) list.firstChild.remove();
  if (below) list.scrollTop = list.scrollHeight;
}

function call(method, params = {}) {
  return new Promise((done, failed) => {
    if (!socket || socket.readyState !== WebSocket.OPEN) return failed(new Error("not connected"));
    calls.set(++number, { done, failed });
    socket.send(JSON.stringify({ jsonrpc: "2.0", id: number, method, params }));
  });
}
const order = (method, params) => call(method, params).catch((error) => tell(error.message));
const script = (text) => order("printer.gcode.script", { script: text });

async function fetched(path, options = {}) {
  const answer = await fetch(path, { ...options, headers: { ...headers(), ...options.headers } });
  if (answer.status === 401) { await ask(); return fetched(path, options); }
  const body = await answer.json();
  if (!answer.ok) throw new Error(body.error ? body.error.message : answer.statusText);
  return body;
}

function ask() {
  const dialog = by("ask");
  if (!dialog.open) dialog.showModal();
  return new Promise((done) => dialog.addEventListener("close", () => {
    sessionStorage.setItem("key", by("key").value);
    done();
  }, { once: true }));
}

async function connect() {
  try {
    const { result: token } = await fetched("/access/oneshot_token");
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    socket = new WebSocket(`${scheme}://${location.host}/websocket?token=${token}`);
    socket.onmessage = (event) => received(JSON.parse(event.data));
    socket.onopen = opened;
    socket.onclose = () => { lost("connection lost"); setTimeout(connect, 2000); };
  } catch (error) { lost(error.message); setTimeout(connect, 2000); }
}

function lost(why) {
  by("state").textContent = why;
  for (const { failed } of calls.values()) failed(new Error(why));
  calls.clear();
}

async function opened() {
  heard = Date.now();
  await call("server.connection.identify", { client_name: "cdhr page", version: "1", type: "web", url: location.host });
  const stored = await call("server.gcode_store", { count: 100 });
  by("messages").replaceChildren();
  for (const each of stored.gcode_store) tell(each.message, each.time);
  const objects = Object.fromEntries(WANTED.map((name) => [name, null]));
  show((await call("printer.objects.subscribe", { objects })).status);
  listFiles();
}

function received(message) {
  heard = Date.now();
  for (const each of Array.isArray(message) ? message : [message]) {
    const waiting = calls.get(each.id);
    if (waiting) {
      calls.delete(each.id);
      if (each.error) waiting.failed(new Error(each.error.message)); else waiting.done(each.result);
    } else if (each.method === "notify_status_update") show(each.params[0]);
    else if (each.method === "notify_gcode_response") tell(each.params[0]);
    else if (each.method === "notify_filelist_changed") listFiles();
  }
}

function clock(seconds) {
  if (seconds == null) return "–";
  const s = Math.max(0, Math.round(seconds)), pad = (n) => String(n).padStart(2, "0");
  return `${Math.floor(s / 3600)}:${pad(Math.floor(s / 60) % 60)}:${pad(s % 60)}`;
}
const put = (id, text) => { const node = by(id); if (node.textContent !== text) node.textContent = text; };
const fixed = (value, digits = 1) => (value == null ? "–" : value.toFixed(digits));

function show(changed) {
  for (const [name, values] of Object.entries(changed)) seen[name] = { ...seen[name], ...values };
  if (WANTED.every((name) => seen[name])) { showJob(); showFactors(); showCables(); showAir(); showPlace(); }
}

function showJob() {
  const job = seen.workspace.job, stats = seen.print_stats, done = seen.virtual_sdcard.progress || 0;
  put("state", job + (stats.message ? `: ${stats.message}` : ""));
  document.title = stats.state === "printing" ? `${Math.floor(done * 100)} % ${stats.filename}` : "Clay printer";
  put("file", stats.filename || "no program");
  by("progress").value = done * 100;
  put("percent", stats.filename ? `${fixed(done * 100)} %` : "–");
  put("layer", stats.info.total_layer ? `${stats.info.current_layer} of ${stats.info.total_layer}` : "–");
  put("elapsed", stats.filename ? clock(stats.total_duration) : "–");
  put("left", stats.filename ? clock(seen.workspace.left_s) : "–");
  const active = ["printing", "resuming", "holding", "held"].includes(job), halted = seen.webhooks.state !== "ready";
  by("hold").disabled = !["printing", "resuming"].includes(job);
  by("resume").disabled = job !== "held";
  by("cancel").disabled = !active;
  by("acknowledge").hidden = !halted;
  by("taken").hidden = !["done", "stopped"].includes(job);
  by("halt").hidden = !halted;
  put("halt", halted ? `Halted: ${seen.webhooks.state_message}. Look at the machine before you acknowledge.` : "");
}

function showFactors() {
  for (const [id, name] of [["feed", "speed_factor"], ["flow", "extrude_factor"]]) {
    if (dragging === id) continue;
    const percent = Math.round(seen.gcode_move[name] * 100);
    by(id).value = percent;
    put(`${id}-shown`, `${percent} %`);
  }
}

function cableRow(name) {
  const row = document.createElement("li");
  row.innerHTML = '<span class="name"></span><div class="gauge" role="meter"><div class="band"></div><div class="bar"></div></div><span class="value"></span>';
  row.querySelector(".name").textContent = name;
  row.querySelector(".gauge").setAttribute("aria-label", `cable ${name}`);
  return row;
}

function showCables() {
  const { names, tension_n, window_n, force_n } = seen.cables, list = by("cables");
  if (list.children.length !== names.length) list.replaceChildren(...names.map(cableRow));
  const most = 1.15 * Math.max(...window_n.map((each) => each[1]));
  names.forEach((name, i) => {
    const row = list.children[i], gauge = row.querySelector(".gauge"), [low, high] = window_n[i], force = tension_n[i];
    const band = row.querySelector(".band").style, percent = (value) => `${(100 * value) / most}%`;
    band.left = percent(low);
    band.width = percent(high - low);
    row.querySelector(".bar").style.width = percent(Math.max(0, Math.min(force, most)));
    row.classList.toggle("out", force < low || force > high);
    row.querySelector(".value").textContent = `${fixed(force, 2)} N`;
    for (const [key, value] of [["valuenow", force], ["valuemin", 0], ["valuemax", fixed(most)], ["valuetext", `${fixed(force, 2)} newton, allowed ${fixed(low)} to ${fixed(high)}`]]) gauge.setAttribute(`aria-${key}`, value);
  });
  const known = force_n.some((force) => force != null);
  put("measured", known ? `Measured: ${force_n.map((force, i) => `pair ${i + 1} ${fixed(force, 2)} N`).join(", ")}.` : "No force sensors.");
}

function showAir() {
  const air = seen.air, percent = (value) => `${Math.min(100, (100 * (value || 0)) / air.max_kpa)}%`;
  by("air-bar").style.width = percent(air.pressure_kpa);
  by("air-mark").style.left = percent(air.command_kpa);
  put("pressure", `${fixed(air.pressure_kpa)} kPa`);
  put("command", `${fixed(air.command_kpa)} kPa`);
  put("flow-now", `${fixed(air.flow_mm3_s)} mm³/s`);
}

function showPlace() {
  const { nozzle_mm: [x, y, z], radius_mm, height_mm } = seen.workspace, scale = 100 / radius_mm;
  by("dot").setAttribute("cx", x * scale);
  by("dot").setAttribute("cy", -y * scale);
  const tall = Math.max(1, Math.min(200, (200 * z) / height_mm));
  by("height").setAttribute("height", tall);
  by("height").setAttribute("y", 100 - tall);
  put("place-text", `x ${fixed(x, 2)}  y ${fixed(y, 2)}  z ${fixed(z, 2)} mm of ±${fixed(radius_mm, 0)} and ${fixed(height_mm, 0)}`);
}

async function listFiles() {
  const files = await call("server.files.list").catch(() => []);
  by("files").replaceChildren(...files.sort((a, b) => b.modified - a.modified).slice(0, 50).map((file) => {
    const item = document.createElement("li"), name = document.createElement("span"), start = document.createElement("button");
    name.textContent = `${file.path} (${Math.ceil(file.size / 1024)} KiB)`;
    start.type = "button";
    start.textContent = "Print";
    start.setAttribute("aria-label", `Print ${file.path}`);
    start.onclick = () => order("printer.print.start", { filename: file.path });
    item.append(name, start);
    return item;
  }));
}

function stop() {
  call("printer.emergency_stop").catch(() => fetched("/printer/emergency_stop", { method: "POST" }))
    .catch((error) => tell(`the emergency stop did NOT get through: ${error.message}`));
}

function upload(form, print) {
  const told = by("upload-told"), bar = by("upload-progress"), body = new FormData();
  body.append("root", "gcodes");
  body.append("print", print);
  body.append("file", by("program").files[0]);
  const request = new XMLHttpRequest();
  request.open("POST", "/server/files/upload");
  for (const [name, value] of Object.entries(headers())) request.setRequestHeader(name, value);
  request.upload.onprogress = (event) => { bar.max = event.total; bar.value = event.loaded; };
  bar.hidden = false;
  told.textContent = "uploading";
  request.onloadend = () => {
    bar.hidden = true;
    let answer = {};
    try { answer = JSON.parse(request.responseText); } catch (error) { answer = { error: { message: "no answer" } }; }
    told.textContent = answer.error ? answer.error.message : print === "true" ? "uploaded; it is proven, then printed" : "uploaded";
    if (!answer.error) form.reset();
  };
  request.send(body);
}

by("stop").onclick = stop;
by("hold").onclick = () => order("printer.print.pause");
by("resume").onclick = () => order("printer.print.resume");
by("cancel").onclick = () => {
  const button = by("cancel"), sure = button.dataset.sure;
  button.dataset.sure = sure ? "" : "asked";
  button.textContent = sure ? "Cancel print" : "Really cancel?";
  if (sure) order("printer.print.cancel");
  else setTimeout(() => { button.dataset.sure = ""; button.textContent = "Cancel print"; }, 4000);
};
by("taken").onclick = () => script("SDCARD_RESET_FILE");
by("acknowledge").onclick = () => order("printer.firmware_restart");
for (const [id, word] of [["feed", "M220"], ["flow", "M221"]]) {
  by(id).oninput = () => { dragging = id; put(`${id}-shown`, `${by(id).value} %`); };
  by(id).onchange = () => script(`${word} S${by(id).value}`).finally(() => { dragging = null; });
}
by("upload").onsubmit = (event) => { event.preventDefault(); upload(event.target, event.submitter ? event.submitter.value : "false"); };
by("line").onsubmit = (event) => { event.preventDefault(); const text = by("code").value.trim(); if (text) script(text); by("code").value = ""; };
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && !by("ask").open) stop(); });
setInterval(() => { if (socket && socket.readyState === WebSocket.OPEN && Date.now() - heard > 5000) socket.close(); }, 1000);
connect();
