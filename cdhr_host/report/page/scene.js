// The path as screen-facing ribbons: one instance a segment, whose two ends are neighbours in one buffer.
const VERTEX = `#version 300 es
precision highp float;
in vec3 from, to;
in float fromValue, toValue, clay;
uniform mat4 view;
uniform vec3 low, extent, travelColour, light;
uniform vec2 half_, range;
uniform float bead, focal, thin, still;
uniform bool travel;
out float value, across, shade;
flat out float laid;
void main() {
  vec3 a = low + extent * from, b = low + extent * to, along = b - a;
  laid = still > 0.0 ? 0.0 : clay;
  vec4 p = view * vec4(a, 1.0), q = view * vec4(b, 1.0);
  if ((laid == 0.0 && !travel) || (p.w < 0.5 && q.w < 0.5)) { gl_Position = vec4(2.0, 2.0, 2.0, 1.0); return; }
  if (p.w < 0.5) p = mix(p, q, (0.5 - p.w) / (q.w - p.w));
  if (q.w < 0.5) q = mix(q, p, (0.5 - q.w) / (p.w - q.w));
  vec2 way = (q.xy / q.w - p.xy / p.w) * half_;
  vec2 dir = length(way) > 1e-4 ? normalize(way) : vec2(1.0, 0.0);
  bool end = gl_VertexID > 1;
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  vec4 here = end ? q : p;
  float width = laid > 0.0 ? max(thin, bead * focal / here.w) : 0.6 * thin;
  vec2 off = 0.5 * width * (side * vec2(-dir.y, dir.x) + (end ? 0.5 : -0.5) * dir);
  gl_Position = here + vec4(off / half_ * here.w, 0.0, 0.0);
  value = ((end ? toValue : fromValue) - range.x) / (range.y - range.x);
  across = side;
  vec3 run = length(along) > 0.0 ? normalize(along) : vec3(1.0, 0.0, 0.0);
  shade = 0.72 + 0.28 * length(cross(run, light));
}`;
const FRAGMENT = `#version 300 es
precision highp float;
in float value, across, shade;
flat in float laid;
uniform sampler2D map;
uniform vec3 travelColour, outside;
uniform bool marks;
out vec4 colour;
void main() {
  vec3 plain = marks && value < 0.0 ? outside : texture(map, vec2(clamp(value, 0.002, 0.998), 0.5)).rgb;
  float round_ = 0.62 + 0.38 * sqrt(max(0.0, 1.0 - across * across));
  colour = vec4(laid > 0.0 ? plain * shade * round_ : travelColour, 1.0);
}`;
const FEW = 40000; // segments drawn at once while the view moves, to begin with
const WHOLE = 40; // times as many when it rests: a machine that draws slowly never draws them all

class Scene {
  constructor(canvas, trail) {
    this.canvas = canvas;
    this.gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("WebGL 2 is not to be had");
    this.trail = trail;
    this.step = 1;
    this.few = FEW;
    this.program = this.linked();
    this.places = this.buffer(trail.xyz);
    this.clay = this.buffer(trail.flow);
    this.values = {};
    this.bed = this.circle(trail.facts.bed.radius);
    this.texture = this.gl.createTexture();
  }

  linked() {
    const gl = this.gl, program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    return program;
  }

  buffer(data) {
    const gl = this.gl, made = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, made);
    gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
    return made;
  }

  // the bed's rim and a cross through its axis, in a box of their own
  circle(radius) {
    const turn = [...Array(97).keys()].map((k) => (k * Math.PI) / 48);
    const round = turn.flatMap((a) => [Math.cos(a), Math.sin(a), 0]);
    const cross = [0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0];
    const data = new Uint16Array([...round, ...cross].map((each) => Math.round((each + 1) * 32767)));
    return { radius, places: this.buffer(data), count: data.length / 3 };
  }

  uniform(kind, name, ...values) {
    this.gl[`uniform${kind}`](this.gl.getUniformLocation(this.program, name), ...values);
  }

  attribute(name, buffer, size, type, bytes, first, normal) {
    const gl = this.gl, at = gl.getAttribLocation(this.program, name);
    if (at < 0) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, type, normal, bytes * this.step, bytes * first);
    gl.vertexAttribDivisor(at, 1);
  }

  // quantity: values as shares of its range, where to spread colours, whether those below are outside
  colour(name, values, spread, marks) {
    this.values[name] ??= this.buffer(values);
    this.shown = { values: this.values[name], spread, marks };
    const gl = this.gl;
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(colourTable(mapOf(name)).buffer));
    for (const edge of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, edge, gl.CLAMP_TO_EDGE);
    for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), { clientWidth, clientHeight } = this.canvas;
    const [width, height] = [Math.max(1, Math.round(clientWidth * ratio)), Math.max(1, Math.round(clientHeight * ratio))];
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    return ratio;
  }

  // ms a quick frame took: fewer segments the next time, or more
  pace(took) {
    if (took > 60) this.few = Math.max(this.few / 2, 4000);
    else if (took < 20) this.few = Math.min(this.few * 1.5, 1e6);
  }

  // quick: fewer segments while the view moves
  draw(matrix, [first, last], { back, faint, travel, quick }) {
    const gl = this.gl, ratio = this.resize(), { width, height } = this.canvas;
    gl.viewport(0, 0, width, height);
    gl.clearColor(...back, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.useProgram(this.program);
    this.uniform("Matrix4fv", "view", false, matrix);
    this.uniform("2f", "half_", width / 2, height / 2);
    this.uniform("1f", "focal", height / 2 / Math.tan(FIELD / 2));
    this.uniform("1f", "thin", 1.6 * ratio);
    this.uniform("3f", "light", 0.35, -0.5, 0.79);
    this.uniform("3f", "travelColour", ...faint);
    this.uniform("3f", "outside", ...OUTSIDE.map((each) => each / 255));
    this.bedRim();
    this.path(first, last, travel, quick);
  }

  bedRim() {
    const gl = this.gl, { radius, places, count } = this.bed;
    this.step = 1;
    this.uniform("3f", "low", -radius, -radius, 0);
    this.uniform("3f", "extent", 2 * radius, 2 * radius, 0);
    this.uniform("1f", "still", 1);
    this.uniform("1i", "travel", 1);
    this.ends(places, this.shown.values, 0);
    // the cross's z is mid-range of a box without height
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count - 1);
  }

  path(first, last, travel, quick) {
    const gl = this.gl, { low, high } = this.trail.facts.box, { spread, marks, values } = this.shown;
    this.step = Math.max(1, Math.ceil((last - first) / (quick ? this.few : WHOLE * this.few)));
    this.uniform("3f", "low", ...low);
    this.uniform("3f", "extent", ...high.map((each, k) => each - low[k]));
    this.uniform("1f", "still", 0);
    this.uniform("1i", "travel", travel ? 1 : 0);
    this.uniform("1f", "bead", this.trail.bead);
    this.uniform("2f", "range", ...spread);
    this.uniform("1i", "marks", marks ? 1 : 0);
    this.ends(this.places, values, first);
    const count = Math.floor((last - first) / this.step);
    if (count > 0) gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, count);
  }

  ends(places, values, first) {
    const gl = this.gl;
    this.attribute("from", places, 3, gl.UNSIGNED_SHORT, 6, first, true);
    this.attribute("to", places, 3, gl.UNSIGNED_SHORT, 6, first + this.step, true);
    if (places !== this.places) {
      for (const name of ["fromValue", "toValue", "clay"]) gl.disableVertexAttribArray(gl.getAttribLocation(this.program, name));
      return;
    }
    this.attribute("fromValue", values, 1, gl.UNSIGNED_SHORT, 2, first, true);
    this.attribute("toValue", values, 1, gl.UNSIGNED_SHORT, 2, first + this.step, true);
    this.attribute("clay", this.clay, 1, gl.UNSIGNED_BYTE, 1, first + this.step, false);
  }
}

// The same from above, without WebGL: coarse, still, but there.
class FlatScene {
  constructor(canvas, trail) {
    Object.assign(this, { canvas, trail, context: canvas.getContext("2d") });
  }

  colour(name, values, spread, marks) {
    this.shown = { values, spread, marks, stops: mapOf(name) };
  }

  draw(matrix, [first, last], { back, travel }) {
    const { canvas, context, trail, shown } = this, { clientWidth: width, clientHeight: height } = canvas;
    Object.assign(canvas, { width, height });
    context.fillStyle = `rgb(${back.map((each) => each * 255)})`;
    context.fillRect(0, 0, width, height);
    const step = Math.max(1, Math.ceil((last - first) / FEW));
    for (let i = first; i + step <= last; i += step) {
      if (!trail.flow[i + step] && !travel) continue;
      const [x, y] = projected(matrix, trail.place(i), width, height);
      const [u, v] = projected(matrix, trail.place(i + step), width, height);
      const share = (shown.values[i + step] / 65535 - shown.spread[0]) / (shown.spread[1] - shown.spread[0]);
      context.strokeStyle = trail.flow[i + step] ? `rgb(${shown.marks && share < 0 ? OUTSIDE : colourAt(shown.stops, share)})` : "#999";
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(u, v);
      context.stroke();
    }
  }
}
