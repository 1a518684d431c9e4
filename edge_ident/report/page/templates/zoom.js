"use strict";
// Charts over time: enlarge a part of the time. Without this script the page says the same.
(() => {
  const SVG = "http://www.w3.org/2000/svg";
  const WIDTH = 20000, HEIGHT = 4000, SMALLEST = 1 / 400, TICKS = 5;

  const make = (name, attributes, text) => {
    const made = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
    if (text !== undefined) made.textContent = text;
    return made;
  };

  const ticks = (from, to) => {
    const rough = (to - from) / TICKS, ten = 10 ** Math.floor(Math.log10(rough));
    const step = ten * [1, 2, 2.5, 5, 10].find((factor) => ten * factor >= rough * 0.999999);
    const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9) + (step / ten === 2.5 ? 1 : 0));
    const found = [];
    for (let n = Math.ceil(from / step - 1e-9); n * step <= to + 1e-9 * step; n += 1)
      found.push([(n * step - from) / (to - from), (n * step).toFixed(decimals)]);
    return found;
  };

  const draw = (chart, low, high, from, to) => {
    const scale = WIDTH / (high - low);
    chart.querySelector("svg.plot")
      .setAttribute("viewBox", `${(from - low) * scale} 0 ${(to - from) * scale} ${HEIGHT}`);
    chart.querySelector(".x-ticks").replaceChildren(...ticks(from, to).flatMap(([place, text]) => {
      const x = `${100 * place}%`;
      return [make("line", { x1: x, x2: x, y1: 0, y2: "100%" }), make("text", { x, y: "100%" }, text)];
    }));
  };

  const enlarge = (group) => {
    const charts = [...group.querySelectorAll("svg.chart")];
    const [low, high] = charts[0].dataset.x.split(" ").map(Number);
    const output = group.querySelector("output");
    let from = low, to = high;

    const show = (start, end) => {
      const span = Math.min(Math.max(end - start, (high - low) * SMALLEST), high - low);
      from = Math.min(Math.max(start, low), high - span);
      to = from + span;
      for (const chart of charts) draw(chart, low, high, from, to);
      output.textContent = `${from.toFixed(2)} to ${to.toFixed(2)} s`;
    };
    const moves = {
      in: () => show(from + (to - from) / 4, to - (to - from) / 4),
      out: () => show(from - (to - from) / 2, to + (to - from) / 2),
      left: () => show(from - (to - from) / 2, to - (to - from) / 2),
      right: () => show(from + (to - from) / 2, to + (to - from) / 2),
      all: () => show(low, high),
    };
    for (const button of group.querySelectorAll("button"))
      button.addEventListener("click", moves[button.dataset.do]);
    for (const chart of charts) select(chart, (a, b) => show(from + a * (to - from), from + b * (to - from)), moves.all);
    group.querySelector(".tools").hidden = false;
  };

  const select = (chart, chosen, reset) => {
    let start = null, shade = null;
    const place = (event) => {
      const box = chart.querySelector("svg.plot").getBoundingClientRect();
      return Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1);
    };
    const end = () => { start = null; shade?.remove(); shade = null; };
    chart.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      start = place(event);
      chart.setPointerCapture(event.pointerId);
      shade = make("rect", { class: "selection", y: 0, height: "100%", width: 0 });
      chart.append(shade);
    });
    chart.addEventListener("pointermove", (event) => {
      if (start === null) return;
      const now = place(event);
      shade.setAttribute("x", `${100 * Math.min(start, now)}%`);
      shade.setAttribute("width", `${100 * Math.abs(now - start)}%`);
    });
    chart.addEventListener("pointerup", (event) => {
      if (start === null) return;
      const [a, b] = [start, place(event)].sort((one, other) => one - other);
      end();
      if (b - a > 0.01) chosen(a, b);
    });
    chart.addEventListener("pointercancel", end);
    chart.addEventListener("dblclick", reset);
  };

  for (const group of document.querySelectorAll("[data-zoom]")) enlarge(group);

  // paper shows what is folded away
  let folded = [];
  addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const part of folded) part.open = true;
  });
  addEventListener("afterprint", () => {
    for (const part of folded) part.open = false;
  });
})();
