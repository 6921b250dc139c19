// Draws the scenes of a report: bodies that turn, mode shapes that swing, mechanisms that move.
//
// A scene (rom/report/scene.py) has bodies with points x0, triangles and shapes S, and either modes
// or positions, orientations and elastic coordinates q over time; what is drawn is
//     x = r + A (x0 + magnification S q).
// One WebGL context draws for all figures of the page; each copies the picture to its own canvas.
"use strict";
(() => {
  const VIRIDIS = ("440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c 1fa088 28ae80 "
    + "3fbc73 5ec962 84d44b addc30 d8e219 fde725").split(" ");
  const EDGE = "#3a414b", UNDEFORMED = "#8a9099";
  const PERIOD = 2.0; // of a mode at full speed [s]
  const LASTS = 6.0; // what a motion takes when it is first played [s], about
  const KINDS = { uint16: Uint16Array, uint32: Uint32Array, int16: Int16Array,
    float32: Float32Array };
  const LENGTHS = [[1, "m"], [1e-3, "mm"], [1e-6, "\u00b5m"], [1e-9, "nm"], [1e-12, "pm"]];
  const STRESSES = [[1e9, "GPa"], [1e6, "MPa"], [1e3, "kPa"], [1, "Pa"]];
  const TIMES = [[1, "s"], [1e-3, "ms"], [1e-6, "\u00b5s"]];

  // ---- numbers and words

  /** The numbers of an array {type, ref}, which stands in an element of its own. */
  function numbers(array) {
    const text = atob(document.getElementById(array.ref).textContent);
    const bytes = Uint8Array.from(text, (letter) => letter.charCodeAt(0));
    return new KINDS[array.type](bytes.buffer);
  }

  /** The largest unit in which the value is at least one. */
  function unitOf(value, units) {
    return units.find(([size]) => value >= size * (1 - 1e-9)) || units[units.length - 1];
  }

  function rounded(value, digits = 3) {
    return String(Number(value.toPrecision(digits)));
  }

  function withUnit(value, units, digits = 3) {
    const [size, name] = unitOf(value, units);
    return `${rounded(value / size, digits)} ${name}`;
  }

  /** 1, 2 or 5 times a power of ten, not larger than the value. */
  function niceBelow(value) {
    const power = 10 ** Math.floor(Math.log10(value) + 1e-9);
    return [5, 2, 1].find((step) => step * power <= value * (1 + 1e-9)) * power;
  }

  /** Values 1, 2, 5 times powers of ten, so many steps below and above one of them, falling. */
  function ladder(value, [below, above]) {
    const power = Math.floor(Math.log10(value) + 1e-9);
    const start = 3 * power + [1, 2, 5].indexOf(Math.round(value / 10 ** power));
    const step = (i) => Number(`${[1, 2, 5][((i % 3) + 3) % 3]}e${Math.floor(i / 3)}`);
    return Array.from({ length: above - below + 1 }, (_, i) => step(start + above - i));
  }

  function element(tag, attributes = {}, ...inside) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...inside);
    return made;
  }

  // ---- the one WebGL context

  const figures = [];
  let renderer = null;
  let colours = null;

  function canDraw() {
    if (renderer) return true;
    const canvas = document.createElement("canvas");
    const look = { antialias: true, alpha: true };
    const context = canvas.getContext("webgl2", look);
    if (!context) return false;
    renderer = new THREE.WebGLRenderer({ canvas, context, ...look });
    canvas.addEventListener("webglcontextlost", () => figures.forEach((one) => one.giveUp()));
    return true;
  }

  /** The colour map as a texture, 256 texels from 0 to 1. */
  function colourMap() {
    if (colours) return colours;
    const texels = new Uint8Array(4 * 256);
    const channel = (k, c) => parseInt(VIRIDIS[k].slice(2 * c, 2 * c + 2), 16);
    for (let i = 0; i < 256; i++) {
      const at = (i / 255) * (VIRIDIS.length - 1), k = Math.min(Math.floor(at), VIRIDIS.length - 2);
      for (let c = 0; c < 3; c++) {
        texels[4 * i + c] = channel(k, c) + (at - k) * (channel(k + 1, c) - channel(k, c));
      }
      texels[4 * i + 3] = 255;
    }
    colours = new THREE.DataTexture(texels, 256, 1);
    colours.colorSpace = THREE.SRGBColorSpace;
    colours.magFilter = colours.minFilter = THREE.LinearFilter;
    colours.needsUpdate = true;
    return colours;
  }

  // ---- a body

  class Body {
    constructor(data) {
      this.name = data.name;
      this.colour = data.colour;
      this.rest = Float32Array.from(numbers(data.points.values),
        (value, i) => data.points.centre[i % 3] + data.points.step * value);
      this.n = this.rest.length / 3;
      const columns = (list) => list.map((one) => ({ scale: one.scale, at: numbers(one.values) }));
      this.shapes = columns(data.shapes);
      this.stresses = columns(data.stresses);
      this.position = numbers(data.position);
      this.orientation = numbers(data.orientation);
      this.q = data.q ? numbers(data.q) : new Float32Array(0);
      this.moved = new Float32Array(3 * this.n);
      this.values = new Float32Array(this.n);
      this.build(numbers(data.triangles), numbers(data.edges));
    }

    get flexible() {
      return this.shapes.length > 0;
    }

    build(triangles, edges) {
      this.at = new THREE.BufferAttribute(this.rest.slice(), 3);
      this.uv = new THREE.BufferAttribute(new Float32Array(2 * this.n).fill(0.5), 2);
      const surface = new THREE.BufferGeometry();
      surface.setAttribute("position", this.at);
      surface.setAttribute("uv", this.uv);
      surface.setIndex(new THREE.BufferAttribute(triangles, 1));
      const look = { side: THREE.DoubleSide, flatShading: true, polygonOffset: true,
        polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
      this.plain = new THREE.MeshLambertMaterial({ color: this.colour, ...look });
      this.mapped = new THREE.MeshLambertMaterial({ map: colourMap(), ...look });
      this.mesh = new THREE.Mesh(surface, this.plain);
      this.group = new THREE.Group();
      this.group.add(this.mesh, this.lines(this.at, edges, EDGE));
      this.still = this.lines(new THREE.BufferAttribute(this.rest, 3), edges, UNDEFORMED);
      this.group.traverse((thing) => { thing.frustumCulled = false; });
      this.still.frustumCulled = false;
    }

    /** Where the segment a + s way first meets a triangle: s, above 1 if nowhere. */
    hit(a, way) {
      const x = this.at.array, index = this.mesh.geometry.index.array;
      const corner = (k) => new THREE.Vector3().fromArray(x, 3 * index[k]);
      let nearest = 2;
      for (let k = 0; k < index.length; k += 3) {
        const p = corner(k), u = corner(k + 1).sub(p), v = corner(k + 2).sub(p);
        const h = way.clone().cross(v), size = u.dot(h), s = a.clone().sub(p), q = s.clone().cross(u);
        const [f, g] = [s.dot(h) / size, way.dot(q) / size]; // weights of the other two corners
        const depth = v.dot(q) / size;
        if (f >= 0 && g >= 0 && f + g <= 1 && depth >= 0) nearest = Math.min(nearest, depth);
      }
      return nearest;
    }

    lines(at, edges, color) {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", at);
      geometry.setIndex(new THREE.BufferAttribute(edges, 1));
      return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({ color }));
    }

    /** Displacement of the points for elastic coordinates and a rigid motion, into `moved`. */
    displace(q, rigid = null) {
      const u = this.moved, x = this.rest;
      u.fill(0);
      if (rigid) {
        const [a, b, c, p, r, s] = rigid;
        for (let i = 0; i < u.length; i += 3) {
          u[i] = a + r * x[i + 2] - s * x[i + 1];
          u[i + 1] = b + s * x[i] - p * x[i + 2];
          u[i + 2] = c + p * x[i + 1] - r * x[i];
        }
      }
      add(u, this.shapes, q);
    }

    lengths() {
      const u = this.moved;
      for (let i = 0; i < this.n; i++) {
        this.values[i] = Math.hypot(u[3 * i], u[3 * i + 1], u[3 * i + 2]);
      }
    }

    vonMises(q) {
      const stress = add(new Float32Array(6 * this.n), this.stresses, q);
      for (let i = 0; i < this.n; i++) {
        const [xx, yy, zz, yz, xz, xy] = stress.subarray(6 * i, 6 * i + 6);
        const normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2;
        this.values[i] = Math.sqrt(0.5 * normal + 3 * (yz * yz + xz * xz + xy * xy));
      }
    }

    /** Move the points by the displacement, so many times larger. */
    show(factor) {
      const { rest, moved } = this, x = this.at.array;
      for (let i = 0; i < x.length; i++) x[i] = rest[i] + factor * moved[i];
      this.at.needsUpdate = true;
    }

    /** Colour by the values, the limit being the end of the colours; null for none. */
    paint(limit) {
      this.mesh.material = limit === null ? this.plain : this.mapped;
      if (limit === null) return;
      const uv = this.uv.array;
      for (let i = 0; i < this.n; i++) {
        uv[2 * i] = (0.5 + 255 * Math.min(this.values[i] / limit, 1)) / 256;
      }
      this.uv.needsUpdate = true;
    }

    /** Place the frame between two instants. */
    place(k, next, share) {
      const r = this.position, p = this.orientation;
      const from = new THREE.Vector3().fromArray(r, 3 * k);
      this.group.position.copy(from.lerp(new THREE.Vector3().fromArray(r, 3 * next), share));
      const turned = (i) => new THREE.Quaternion(p[4 * i + 1], p[4 * i + 2], p[4 * i + 3], p[4 * i]);
      this.group.quaternion.copy(turned(k).slerp(turned(next), share));
    }

    /** Elastic coordinates between two instants. */
    coordinates(k, next, share) {
      const r = this.shapes.length;
      return this.shapes.map((_, j) =>
        (1 - share) * this.q[k * r + j] + share * this.q[next * r + j]);
    }
  }

  /** Add columns times coordinates to an array, which is given back. */
  function add(sum, columns, q) {
    columns.forEach((column, j) => {
      const factor = column.scale * q[j], at = column.at;
      if (factor) for (let i = 0; i < sum.length; i++) sum[i] += factor * at[i];
    });
    return sum;
  }

  // ---- a figure

  class Figure {
    constructor(figure) {
      this.figure = figure;
      this.data = JSON.parse(figure.querySelector(".scene-data").textContent);
      this.playing = false;
      this.visible = true;
      this.speed = 1;
      this.colour = "";
      this.buildScene();
      this.isModes = this.data.modes.length > 0;
      this.times = this.data.times ? numbers(this.data.times) : null;
      this.buildPage();
      if (this.isModes) this.choose(0);
      figure.classList.add("live");
      this.watch();
    }

    // -- what is seen

    buildScene() {
      const { view, bodies } = this.data;
      this.scene = new THREE.Scene();
      this.world = new THREE.Group();
      this.world.scale.setScalar(1 / view.radius); // so that one set of distances fits all sizes
      this.bodies = bodies.map((data) => new Body(data));
      for (const body of this.bodies) {
        body.place(0, 0, 0);
        this.world.add(body.group);
        if (this.data.modes.length) {
          body.still.position.copy(body.group.position);
          this.world.add(body.still);
        }
      }
      this.camera = new THREE.OrthographicCamera(-1, 1, 1, -1, 0, 40);
      this.camera.up.fromArray(view.up);
      this.camera.position.fromArray(view.toward).multiplyScalar(20);
      const sun = new THREE.DirectionalLight("white", 1.7);
      sun.position.set(-0.5, 0.9, 1); // over the left shoulder
      this.camera.add(sun);
      this.scene.add(this.world, this.camera, new THREE.AmbientLight("white", 1.7));
    }

    // -- what surrounds it

    buildPage() {
      const { figure, data } = this;
      this.canvas = element("canvas", { tabindex: "0", role: "img", "aria-label": data.title });
      this.legend = element("div", { class: "legend" });
      this.controls = element("div", { class: "controls" });
      const shape = Math.min(Math.max(data.view.wide / data.view.tall, 1), 2);
      this.canvas.style.aspectRatio = String(shape);
      const stage = element("div", { class: "stage" }, this.canvas);
      this.paper = this.canvas.getContext("2d");
      if (this.isModes || this.times) this.addPlay();
      if (this.isModes) this.addModes();
      if (this.times) this.addTime();
      if (this.isModes || this.times) this.addSpeed();
      if (this.bodies.some((body) => body.flexible)) this.addAmplitude();
      this.addColours();
      const reset = element("button", { type: "button", class: "reset" }, "Reset view");
      reset.addEventListener("click", () => this.reset());
      this.controls.append(reset);
      const keys = element("p", { class: "keys" }, this.help());
      figure.querySelector(".still").before(stage, this.legend, this.controls,
        element("details", {}, element("summary", {}, "Mouse, touch and keys"), keys));
      this.orbit = new THREE.OrbitControls(this.camera, this.canvas);
      this.orbit.addEventListener("change", () => this.ask());
      this.orbit.saveState();
      // the wheel scrolls the page until the picture has been clicked
      stage.addEventListener("wheel", (event) => {
        if (document.activeElement !== this.canvas) event.stopPropagation();
      }, { capture: true });
      this.canvas.addEventListener("pointerdown", () => this.canvas.focus({ preventScroll: true }));
      this.canvas.addEventListener("keydown", (event) => this.key(event));
      if (data.pick) this.listen();
    }

    /** Tell the page which body is clicked, and let it colour some: {name: colour}. */
    listen() {
      let pressed = null;
      this.canvas.addEventListener("pointerdown", (event) => { pressed = event; });
      this.canvas.addEventListener("pointerup", (event) => {
        if (!pressed || event.button || Math.hypot(event.x - pressed.x, event.y - pressed.y) > 4) return;
        const seen = this.seenAt(event.offsetX, event.offsetY);
        if (seen) this.figure.dispatchEvent(new CustomEvent("pick", { detail: seen.name }));
      });
      this.figure.addEventListener("paint", ({ detail }) => {
        for (const body of this.bodies) body.plain.color.set(detail[body.name] || body.colour);
        this.ask();
      });
    }

    /** The nearest body at a point of the picture [pixel], or none. */
    seenAt(x, y) {
      const { camera, data } = this, { clientWidth, clientHeight } = this.canvas;
      const at = (depth) => new THREE.Vector3((2 * x) / clientWidth - 1,
        1 - (2 * y) / clientHeight, depth).unproject(camera).multiplyScalar(data.view.radius);
      const [from, to] = [at(-1), at(1)];
      let nearest = 1, seen = null;
      for (const body of this.bodies) {
        const back = body.group.quaternion.clone().invert();
        const [a, b] = [from, to].map((p) =>
          p.clone().sub(body.group.position).applyQuaternion(back));
        const depth = body.hit(a, b.sub(a));
        if (depth < nearest) [nearest, seen] = [depth, body];
      }
      return seen;
    }

    help() {
      const words = ["Drag, or arrow keys: turn. Wheel after a click, two fingers, or + and -: zoom.",
        "Right button or two fingers: move. 0: reset the view."];
      if (this.isModes || this.times) words.push("Space: play and pause.");
      if (this.isModes) words.push("Comma and full stop: last and next mode.");
      if (this.times) words.push("Comma and full stop: a little back and on.");
      words.push("Keys act when the picture has been clicked or reached with Tab.");
      return words.join(" ");
    }

    labelled(name, control, ...more) {
      this.controls.append(element("label", {}, `${name} `, control, ...more));
      return control;
    }

    choice(name, className, options) {
      const select = element("select", { class: className });
      for (const [value, text] of options) select.append(element("option", { value }, text));
      return this.labelled(name, select);
    }

    slider(name, className, [min, max, step, value]) {
      const range = element("input", { type: "range", class: className, min, max, step, value });
      this[`${className}Words`] = element("output");
      return this.labelled(name, range, this[`${className}Words`]);
    }

    addPlay() {
      this.phase = this.isModes ? 0.25 : 0; // the largest deformation is seen first
      this.button = element("button", { type: "button", class: "play" }, "\u25b6 Play");
      this.button.addEventListener("click", () => this.play(!this.playing));
      this.controls.append(this.button);
    }

    addModes() {
      this.modes = element("select", { class: "mode" });
      let group = null;
      this.data.modes.forEach((mode, k) => {
        if (!group || group.label !== mode.group) {
          group = element("optgroup", { label: mode.group });
          this.modes.append(group);
        }
        group.append(element("option", { value: k }, mode.label));
      });
      this.labelled("Mode", this.modes);
      this.modes.addEventListener("change", () => this.choose(Number(this.modes.value)));
    }

    addTime() {
      this.span = this.times[this.times.length - 1];
      this.clock = unitOf(Math.max(Math.abs(this.data.start), this.span) / 10, TIMES);
      this.timeSlider = this.slider("Time", "time", [0, 1, "any", 0]);
      this.timeSlider.addEventListener("input", () => {
        this.phase = Number(this.timeSlider.value);
        this.ask();
      });
    }

    addSpeed() {
      const first = this.times ? niceBelow(this.span / LASTS) : 1;
      const whole = this.times ? "true speed" : "normal";
      const said = (f) => {
        const times = f < 1 ? `1/${rounded(1 / f)}` : `${rounded(f)} times`;
        if (Math.abs(f - 1) < 1e-6) return whole;
        return this.times ? `${times}${f < 1 ? " of" : ""} ${whole}` : times;
      };
      const offered = ladder(first, this.times ? [-6, 4] : [-3, 1]);
      const select = this.choice("Speed", "speed", offered.map((f) => [f, said(f)]));
      this.speed = offered.reduce((a, b) => (Math.abs(b - first) < Math.abs(a - first) ? b : a));
      select.value = String(this.speed);
      select.addEventListener("change", () => { this.speed = Number(select.value); });
    }

    addAmplitude() {
      if (!this.isModes && !this.times) return;
      if (this.isModes) {
        this.amplitude = this.slider("Amplitude", "amplitude", [0, 0.25, 0.005, this.data.magnify]);
      } else {
        const start = Math.log10(this.data.magnify);
        const range = [Math.min(0, start), Math.max(4, start), "any", start];
        this.amplitude = this.slider("Deformation", "amplitude", range);
      }
      this.amplitude.addEventListener("input", () => this.ask());
    }

    addColours() {
      const flexible = this.bodies.some((body) => body.flexible);
      const stressed = this.bodies.some((body) => body.stresses.length);
      if (!flexible || (!this.isModes && !this.times)) {
        this.nameBodies();
        return;
      }
      const offered = [["displacement", "displacement"]];
      if (stressed) offered.push(["stress", "von Mises stress"]);
      offered.push(["", "bodies"]);
      const select = this.choice("Colour", "colour", offered);
      this.colour = "displacement";
      select.addEventListener("change", () => {
        this.colour = select.value;
        if (this.isModes) this.colourMode();
        this.nameColours();
        this.ask();
      });
      if (!this.isModes) this.nameColours();
    }

    // -- the legend

    nameBodies() {
      if (this.data.pick) return; // the page names what is clicked
      const dots = this.bodies.slice(0, 16).map((body) => {
        const dot = element("span", { class: "dot" });
        dot.style.background = body.colour;
        return element("span", { class: "named" }, dot, body.name);
      });
      if (this.bodies.length > dots.length) dots.push(`and ${this.bodies.length - dots.length} more`);
      this.legend.replaceChildren(...dots);
    }

    /** Limit of the colours in SI, units, and words for them. */
    colourMeaning() {
      const limits = this.data.limits;
      if (!this.isModes && this.colour === "stress") return [limits.stress, STRESSES, "von Mises stress"];
      if (!this.isModes) {
        return [limits.displacement, LENGTHS, "displacement relative to the frame of the body"];
      }
      if (this.colour === "displacement") {
        return [1, [[1, ""]], "displacement / largest displacement of the mode"];
      }
      const far = withUnit(this.reference, LENGTHS);
      return [this.limit, STRESSES, `von Mises stress where the largest displacement is ${far}`];
    }

    nameColours() {
      if (!this.colour) return this.nameBodies();
      const [limit, units, words] = this.colourMeaning();
      const [size, unit] = unitOf(limit, units);
      const ends = [0, 0.25, 0.5, 0.75, 1].map((f) => element("span", {}, rounded((f * limit) / size)));
      this.legend.replaceChildren(
        element("div", { class: "meaning" }, unit ? `${words} [${unit}]` : words),
        element("div", { class: "bar" }), element("div", { class: "ends" }, ...ends));
    }

    // -- modes

    choose(k) {
      const mode = this.data.modes[k], body = this.bodies[0];
      this.modes.value = k;
      this.q = mode.q || body.shapes.map((_, j) => (j === mode.coordinate ? 1 : 0));
      body.displace(this.q, mode.rigid);
      body.lengths();
      this.largest = Math.max(...chunks(body.values), 1e-300);
      this.colourMode();
      this.nameColours();
      this.ask();
    }

    /** Colours of a mode stay while it swings: they are its amplitude. */
    colourMode() {
      const body = this.bodies[0];
      if (!this.colour) return body.paint(null);
      if (this.colour === "stress") {
        body.vonMises(this.q);
        this.reference = 10 ** Math.floor(Math.log10(this.data.size / 100));
        const scale = this.reference / this.largest;
        body.values.forEach((value, i) => { body.values[i] = scale * value; });
        this.limit = Math.max(...chunks(body.values), 1e-300);
      } else {
        body.lengths();
        this.limit = this.largest;
      }
      body.paint(this.limit);
    }

    swing() {
      const share = Number(this.amplitude.value);
      this.amplitudeWords.value = `${rounded(100 * share)} % of the size`;
      const now = Math.sin(2 * Math.PI * this.phase);
      this.bodies[0].show((share * this.data.size * now) / this.largest);
    }

    // -- motion

    move() {
      const t = this.phase * this.span, last = this.times.length - 1;
      let low = 0, high = last;
      while (high - low > 1) {
        const middle = (low + high) >> 1;
        if (this.times[middle] <= t) low = middle; else high = middle;
      }
      const share = (t - this.times[low]) / Math.max(this.times[high] - this.times[low], 1e-300);
      const [size, unit] = this.clock;
      this.timeWords.value = `${((this.data.start + t) / size).toFixed(unit === "s" ? 3 : 2)} ${unit}`;
      this.timeSlider.value = this.phase;
      const magnify = this.amplitude ? 10 ** Number(this.amplitude.value) : 1;
      if (this.amplitude) {
        this.amplitudeWords.value = magnify === 1 ? "true size" : `${rounded(magnify)} times larger`;
      }
      for (const body of this.bodies) {
        body.place(low, high, share);
        if (body.flexible) this.deform(body, body.coordinates(low, high, share), magnify);
      }
    }

    deform(body, q, magnify) {
      body.displace(q);
      body.show(magnify);
      const shown = this.colour === "stress" && !body.stresses.length ? "" : this.colour;
      if (shown === "stress") body.vonMises(q);
      else if (shown) body.lengths();
      body.paint(shown ? Math.max(this.data.limits[shown], 1e-300) : null);
    }

    // -- time passes

    play(on) {
      this.playing = on;
      this.button.textContent = on ? "\u275a\u275a Pause" : "\u25b6 Play";
      this.last = null;
      if (on && this.times && this.phase >= 1) this.phase = 0;
      this.ask();
    }

    /** Draw at the next chance. */
    ask() {
      if (this.waiting || !this.visible) return;
      this.waiting = true;
      requestAnimationFrame((now) => {
        this.waiting = false;
        if (this.playing) {
          this.pass(this.last === null ? 0 : Math.min((now - this.last) / 1000, 0.25));
          this.last = now;
        }
        this.draw();
        if (this.playing) this.ask();
      });
    }

    pass(seconds) {
      const period = this.isModes ? PERIOD : Math.max(this.span, 1e-300);
      this.phase = (this.phase + (seconds * this.speed) / period) % 1;
    }

    watch() {
      new ResizeObserver(() => this.ask()).observe(this.canvas);
      new IntersectionObserver(([seen]) => {
        this.visible = seen.isIntersecting;
        this.last = null;
        this.ask();
      }).observe(this.canvas);
      matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.ask());
    }

    // -- the eye

    reset() {
      this.orbit.reset();
      this.ask();
    }

    turn(across, upward) {
      const { camera, orbit } = this;
      const eye = camera.position.clone().sub(orbit.target);
      const right = camera.up.clone().cross(eye).normalize();
      const height = eye.angleTo(camera.up);
      const rise = height - Math.min(Math.max(height - upward, 0.02), Math.PI - 0.02);
      eye.applyAxisAngle(right, -rise).applyAxisAngle(camera.up.clone().normalize(), across);
      camera.position.copy(orbit.target).add(eye);
      orbit.update();
      this.ask();
    }

    zoom(factor) {
      this.camera.zoom *= factor;
      this.ask();
    }

    step(way) {
      if (this.isModes) {
        const n = this.data.modes.length;
        this.choose((Number(this.modes.value) + way + n) % n);
      } else if (this.times) {
        this.phase = Math.min(Math.max(this.phase + way / 200, 0), 1);
        this.ask();
      }
    }

    key(event) {
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      const acts = {
        ArrowLeft: () => this.turn(-0.1, 0), ArrowRight: () => this.turn(0.1, 0),
        ArrowUp: () => this.turn(0, 0.1), ArrowDown: () => this.turn(0, -0.1),
        "+": () => this.zoom(1.15), "=": () => this.zoom(1.15), "-": () => this.zoom(1 / 1.15),
        0: () => this.reset(), " ": () => this.button && this.play(!this.playing),
        ",": () => this.step(-1), ".": () => this.step(1),
      };
      if (!(event.key in acts)) return;
      event.preventDefault();
      acts[event.key]();
    }

    // -- drawing

    draw() {
      const { canvas, camera, data } = this;
      const width = canvas.clientWidth, height = canvas.clientHeight;
      if (!width || !height || this.lost) return;
      if (this.isModes) this.swing();
      else if (this.times) this.move();
      const ratio = Math.min(window.devicePixelRatio || 1, 2);
      const wide = Math.round(width * ratio), tall = Math.round(height * ratio);
      const scale = 1.08 * Math.max(data.view.wide / width, data.view.tall / (height - 50));
      this.perPixel = scale / camera.zoom; // [m]
      camera.right = (0.5 * width * scale) / data.view.radius;
      camera.top = (0.5 * height * scale) / data.view.radius;
      [camera.left, camera.bottom] = [-camera.right, -camera.top];
      camera.updateProjectionMatrix();
      const drawn = renderer.domElement;
      if (drawn.width !== wide || drawn.height !== tall) renderer.setSize(wide, tall, false);
      renderer.render(this.scene, camera);
      if (canvas.width !== wide || canvas.height !== tall) [canvas.width, canvas.height] = [wide, tall];
      const paper = this.paper;
      paper.setTransform(1, 0, 0, 1, 0, 0);
      paper.clearRect(0, 0, wide, tall);
      paper.drawImage(drawn, 0, 0);
      paper.setTransform(ratio, 0, 0, ratio, 0, 0);
      paper.font = "13px sans-serif";
      paper.fillStyle = paper.strokeStyle = getComputedStyle(canvas).color;
      this.drawAxes(44, height - 44);
      this.drawScale(width - 20, height - 20, width);
    }

    drawAxes(x, y) {
      const paper = this.paper, back = this.camera.quaternion.clone().invert();
      const axes = ["x", "y", "z"].map((name, k) => {
        const way = new THREE.Vector3().setComponent(k, 1).applyQuaternion(back);
        return { name, way, colour: ["#d1495b", "#3f9b5f", "#3d7fd6"][k] };
      });
      axes.sort((a, b) => a.way.z - b.way.z);
      paper.textAlign = "center";
      paper.textBaseline = "middle";
      for (const { name, way, colour } of axes) {
        paper.save();
        paper.strokeStyle = colour;
        paper.lineWidth = 2;
        paper.beginPath();
        paper.moveTo(x, y);
        paper.lineTo(x + 26 * way.x, y - 26 * way.y);
        paper.stroke();
        paper.restore();
        if (Math.hypot(way.x, way.y) > 0.15) paper.fillText(name, x + 36 * way.x, y - 36 * way.y);
      }
    }

    drawScale(right, y, width) {
      const length = niceBelow(0.25 * width * this.perPixel), pixels = length / this.perPixel;
      const paper = this.paper;
      paper.lineWidth = 1.5;
      paper.beginPath();
      paper.moveTo(right - pixels, y - 5);
      paper.lineTo(right - pixels, y);
      paper.lineTo(right, y);
      paper.lineTo(right, y - 5);
      paper.stroke();
      paper.textAlign = "center";
      paper.textBaseline = "bottom";
      paper.fillText(withUnit(length, LENGTHS), right - pixels / 2, y - 4);
    }

    /** Back to the still picture. */
    giveUp() {
      this.lost = true;
      this.playing = false;
      this.figure.classList.remove("live");
    }
  }

  /** The largest values of parts of an array, few enough to be arguments. */
  function chunks(values) {
    const found = [];
    for (let k = 0; k < values.length; k += 10000) {
      found.push(Math.max(...values.subarray(k, k + 10000)));
    }
    return found;
  }

  for (const figure of document.querySelectorAll("figure.scene")) {
    try {
      if (canDraw()) figures.push(new Figure(figure));
    } catch (error) {
      reportError(error); // the still picture stays
    }
  }
})();
