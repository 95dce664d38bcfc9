// A small plot of the last minutes: one or more lines over time, with their names and latest values.

const kSamplesMax = 240;

// Of the theme: its `ui`.
let colours = {};
export function usePlotColours(ui) { colours = ui; }

export function number(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  const size = Math.abs(value);
  if (size >= 1e9) return `${(value / 1e9).toPrecision(3)} G`;
  if (size >= 1e6) return `${(value / 1e6).toPrecision(3)} M`;
  if (size >= 1e4) return `${(value / 1e3).toPrecision(3)} k`;
  if (Number.isInteger(value)) return String(value);
  return size >= 100 ? value.toFixed(0) : size >= 10 ? value.toFixed(1) : value.toFixed(2);
}

export class Plot {
  // `lines` are {name, colour} each, a colour by its name in the theme.
  constructor(parent, title, unit, lines) {
    this.lines = lines;
    this.samples = lines.map(() => []);
    this.element = document.createElement('figure');
    this.element.className = 'plot';
    const caption = document.createElement('figcaption');
    const name = document.createElement('span');
    name.textContent = title;
    const values = document.createElement('span');
    values.className = 'values';
    this.values = lines.map(({name: line, colour}) => {
      const value = document.createElement('b');
      value.style.color = `var(--${colour})`;
      value.title = line;
      values.append(value);
      return value;
    });
    const unitText = document.createElement('i');
    unitText.textContent = unit;
    values.append(unitText);
    caption.append(name, values);
    this.canvas = document.createElement('canvas');
    this.canvas.setAttribute('aria-hidden', 'true');
    this.element.append(caption, this.canvas);
    parent.append(this.element);
  }

  add(...values) {
    values.forEach((value, n) => {
      this.samples[n].push(Number.isFinite(value) ? value : 0);
      if (this.samples[n].length > kSamplesMax) this.samples[n].shift();
      this.values[n].textContent = number(value);
    });
    this.draw();
  }

  clear() {
    this.samples = this.lines.map(() => []);
    this.draw();
  }

  draw() {
    const {clientWidth: width, clientHeight: height} = this.canvas;
    if (!width) return;
    const ratio = devicePixelRatio;
    this.canvas.width = width * ratio;
    this.canvas.height = height * ratio;
    const context = this.canvas.getContext('2d');
    context.scale(ratio, ratio);
    const top = Math.max(...this.samples.flat(), 1e-9) * 1.12;
    context.strokeStyle = colours.edge;
    context.beginPath();
    for (const share of [0.5, 1]) {
      context.moveTo(0, Math.round(height * share) - 0.5);
      context.lineTo(width, Math.round(height * share) - 0.5);
    }
    context.stroke();
    this.samples.forEach((samples, n) => {
      if (samples.length < 2) return;
      const x = (place) => width - (samples.length - 1 - place) * width / (kSamplesMax - 1);
      const y = (value) => height - 1 - value / top * (height - 2);
      context.beginPath();
      samples.forEach((value, place) => context.lineTo(x(place), y(value)));
      context.strokeStyle = colours[this.lines[n].colour];
      context.lineWidth = 1.5;
      context.lineJoin = 'round';
      context.stroke();
      if (n > 0) return;
      context.lineTo(width, height);
      context.lineTo(x(0), height);
      context.globalAlpha = 0.1;
      context.fillStyle = colours[this.lines[n].colour];
      context.fill();
      context.globalAlpha = 1;
    });
  }
}
