// The model of the selected body: its bodies, to be selected, and its joints, to be driven.
import {element} from './dashboard.js';

const kRefreshEvery = 500;  // ms
const kTurn = Math.PI;      // what a slider spans to both sides of a joint without limits, rad or m

export const modelOf = (name) => name.split('::')[0];
const within = (name) => name.split('::').slice(1).join('::') || name;

// What a slider spans, and where it stands: where the joint is led, or else where it is.
export function rangeOf({position, lower, upper, target}) {
  const at = target ?? position ?? 0;
  return {low: lower ?? Math.min(at - kTurn, -kTurn), high: upper ?? Math.max(at + kTurn, kTurn), at};
}

export const textOf = ({position, unit}) => position === null ? '' : `${(Math.round(1000 * position) / 1000 + 0).toFixed(3)} ${unit}`;

class JointRow {
  #held = false;  // by the pointer: what it shows is not changed then

  constructor(parent, name, axis, onDrive) {
    this.element = element('label');
    this.text = element('small');
    this.slider = element('input');
    this.slider.type = 'range';
    this.slider.step = 'any';
    this.slider.setAttribute('aria-label', name);
    this.slider.oninput = () => onDrive({joint: name, axis, target: Number(this.slider.value)});
    this.element.title = 'A double click lets go';
    this.element.ondblclick = () => onDrive({joint: name, axis, free: true});
    this.slider.onpointerdown = () => this.#held = true;
    this.slider.onpointerup = this.slider.onblur = () => this.#held = false;
    this.element.append(element('span', within(name)), this.text, this.slider);
    parent.append(this.element);
  }

  show(axis, mayDrive) {
    const {low, high, at} = rangeOf(axis);
    this.text.textContent = textOf(axis);
    this.slider.disabled = !mayDrive;
    if (this.#held) return;
    Object.assign(this.slider, {min: low, max: high});
    this.slider.value = at;
  }
}

export class Model {
  #name = null;
  #rows = new Map();  // by joint and axis
  #asked = 0;         // ms
  #bodies = '';       // as they are shown
  #wanted = null;     // a drive that waits for the answer to the one before
  #isDriving = false;
  #joints = [];

  // `ask(what, details)` promises an answer; `mayDrive()`: whether the world may be changed.
  constructor({panel, name, filter, bodies, joints, ask, select, mayDrive, notify}) {
    Object.assign(this, {panel, title: name, filter, list: bodies, joints, ask, select, mayDrive, notify});
    filter.oninput = () => this.#narrow();
  }

  // As they were last told: {name, axes}.
  get told() { return this.#joints; }

  // Of the body of this name; null: of none.
  show(body) {
    const name = body?.includes('::') ? modelOf(body) : null;
    if (name === this.#name) return;
    this.#name = name;
    this.#asked = 0;
    this.#joints = [];
    this.#bodies = '';
    this.#rows.clear();
    this.filter.value = '';
    this.list.replaceChildren();
    this.joints.replaceChildren();
    this.panel.hidden = true;
  }

  async refresh() {
    const now = performance.now();
    if (this.#name === null || (this.#asked && now - this.#asked < kRefreshEvery)) return;
    this.#asked = now;
    const name = this.#name;
    const answer = await this.ask('model', {model: name}).catch(() => null);  // the next time
    if (answer && name === this.#name) this.#fill(answer);
  }

  #fill({bodies, joints, truncated}) {
    this.#joints = joints;
    this.panel.hidden = bodies.length < 2 && joints.length === 0;
    this.title.textContent = truncated ? `${this.#name}, in part` : this.#name;
    const shown = JSON.stringify(bodies);
    if (shown !== this.#bodies) {
      this.#bodies = shown;
      this.list.replaceChildren(...bodies.map(({id, name}) => {
        const button = element('button', within(name));
        button.onclick = () => this.select(id);
        return button;
      }));
    }
    for (const {name, axes} of joints) {
      axes.forEach((axis, n) => {
        const key = `${name} ${n}`;
        if (!this.#rows.has(key))
          this.#rows.set(key, new JointRow(this.joints, name, n, (drive) => this.#drive(drive)));
        this.#rows.get(key).show(axis, this.mayDrive());
      });
    }
    this.#narrow();
  }

  #narrow() {
    const text = this.filter.value.toLowerCase();
    for (const part of [...this.list.children, ...this.joints.children])
      part.hidden = !part.textContent.toLowerCase().includes(text);
  }

  // One at a time: of those that come meanwhile, the last counts.
  async #drive(drive) {
    this.#wanted = drive;
    if (this.#isDriving) return;
    this.#isDriving = true;
    while (this.#wanted) {
      const next = this.#wanted;
      this.#wanted = null;
      await this.ask('drive', next).catch((error) => this.notify(error.message, true));
    }
    this.#isDriving = false;
  }
}
