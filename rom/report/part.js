// Choices of the page of `rom open`: faces by click, names, hinge, material, size; orders and news.
"use strict";
(() => {
  const part = JSON.parse(document.getElementById("part").textContent);
  const figure = document.querySelector("figure.scene"), form = document.getElementById("choice");
  const rows = document.querySelector("#chosen tbody"), log = document.getElementById("progress");
  const result = document.getElementById("result");
  const CHOSEN = "#edae49", HINGE = "#d1495b";
  const chosen = new Map(); // row of the table by the label of its face

  function element(tag, attributes = {}, ...inside) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
    made.append(...inside);
    return made;
  }

  function paint() {
    const colours = {};
    for (const [label, row] of chosen) {
      colours[label] = row.querySelector("[name=hinge]").checked ? HINGE : CHOSEN;
    }
    figure.dispatchEvent(new CustomEvent("paint", { detail: colours }));
    document.getElementById("none").hidden = chosen.size > 0;
  }

  function toggle(label) {
    if (!(label in part.faces)) return;
    if (chosen.has(label)) {
      chosen.get(label).remove();
      chosen.delete(label);
      if (chosen.size && !rows.querySelector("[name=hinge]:checked")) {
        rows.querySelector("[name=hinge]").checked = true;
      }
      paint();
      return;
    }
    const face = part.faces[label];
    const name = element("input", { name: "name", value: face.name, size: 12, "aria-label": "name" });
    name.readOnly = face.fixed;
    const hinge = element("input", { type: "radio", name: "hinge", "aria-label": `hang it on ${label}` });
    hinge.checked = chosen.size === 0;
    const remove = element("button", { type: "button", "aria-label": `leave out ${label}` }, "\u00d7");
    remove.addEventListener("click", () => toggle(label));
    const row = element("tr", {}, ...[label, face.about, name, hinge, remove].map((one) =>
      element("td", {}, one)));
    chosen.set(label, row);
    rows.append(row);
    paint();
  }

  function choice() {
    const faces = {}, values = new FormData(form);
    let hinge = "";
    for (const [label, row] of chosen) {
      const name = row.querySelector("[name=name]").value.trim();
      if (name in faces) throw new Error(`two faces are called ${name}`);
      faces[name] = label;
      if (row.querySelector("[name=hinge]").checked) hinge = name;
    }
    const text = (key) => values.get(key).trim();
    return { faces, hinge, E: text("E"), nu: text("nu"), rho: text("rho"), size: text("size") };
  }

  async function order(name, options) {
    const answer = await fetch(name, { method: "POST", body: JSON.stringify(options) });
    if (!answer.ok) throw new Error((await answer.text()) || `the server said ${answer.status}`);
    return answer.json();
  }

  function say(line, className = "") {
    log.append(element("span", { class: className }, `${line}\n`));
    log.scrollTop = log.scrollHeight;
  }

  function working(on) {
    form.swing.disabled = on;
    form.stop.hidden = !on;
  }

  const attempt = (work) => async () => {
    try {
      await work();
    } catch (error) {
      say(error.message, "failed");
    }
  };
  form.addEventListener("submit", (event) => event.preventDefault());
  form.swing.addEventListener("click", attempt(() => order("swing", choice())));
  form.save.addEventListener("click", attempt(async () => {
    const { file, command } = await order("save", choice());
    say(`${file} is written; the same on the command line:\n${command}`);
  }));
  form.stop.addEventListener("click", attempt(() => order("stop", {})));
  rows.addEventListener("change", paint);
  figure.addEventListener("pick", ({ detail }) => toggle(detail));
  form.material.addEventListener("change", () => {
    const numbers = part.materials[form.material.value];
    if (numbers) [form.E.value, form.nu.value, form.rho.value] = numbers;
  });
  for (const key of ["E", "nu", "rho"]) {
    form[key].addEventListener("input", () => { form.material.value = ""; });
  }

  const news = new EventSource("events");
  news.addEventListener("message", (event) => {
    const { began, line, ended, failed, report } = JSON.parse(event.data);
    if (began) {
      log.replaceChildren();
      result.replaceChildren();
      working(true);
    }
    if (began || line) say(began || line);
    if (ended !== undefined) {
      working(false);
      say(ended, failed ? "failed" : "");
    }
    if (report) {
      result.replaceChildren(element("iframe", { src: report, title: "Report of the swing" }));
      result.scrollIntoView({ behavior: "smooth" });
    }
  });
  news.addEventListener("error", () => {
    if (news.readyState !== EventSource.CLOSED) return;
    say("This part is open in another window, or the program has ended: close this one.", "failed");
    form.swing.disabled = form.save.disabled = true;
  });
  paint();
})();
