// The selected body or sector: its properties and their history since it was selected.
import {fill} from './dashboard.js';
import {describe} from './geometry.js';
import {number, Plot} from './plot.js';
import {moved, placed, sectorText} from './position.js';

const rounded = (x) => Number(x.toPrecision(4));
const kProgramsEvery = 500;  // ms

const kPlotFirst = 'speed, m/s';
const kPlottableMax = 64;  // of a program

const kNumbersShown = 16;  // of a program, which may have a thousand

// What is shown of the programs of a body: a row each, by their names, or else by their kinds.
export function programFacts(programs) {
  const text = (numbers) => {
    const all = Object.entries(numbers).map(([name, value]) => `${name} ${rounded(value)}`);
    const more = all.length > kNumbersShown ? [`... ${all.length} numbers`] : [];
    return [...all.slice(0, kNumbersShown), ...more].join(', ');
  };
  return programs.map(({kind, name, inputs, values, fault}) =>
    [name ? `${kind} ${name}` : kind,
     fault ? `stopped: ${fault}` : [text(inputs), text(values)].filter(Boolean).join('; ')]);
}

// What can be plotted of a body: its speed, the numbers of its programs, and where the joints of its model are, each by
// a name.
export function plottable({speed}, programs, joints = []) {
  const found = new Map([[kPlotFirst, speed]]);
  for (const {kind, name, inputs, values} of programs) {
    for (const [number, value] of [...Object.entries(inputs), ...Object.entries(values)].slice(0, kPlottableMax))
      found.set(`${name || kind}: ${number}`, value);
  }
  for (const {name, axes} of joints.slice(0, kPlottableMax)) {
    axes.forEach(({position, unit}, n) => {
      const which = axes.length > 1 ? ` axis ${n + 1}` : '';
      if (position !== null) found.set(`joint ${name.split('::').slice(1).join('::') || name}${which}, ${unit}`, position);
    });
  }
  return found;
}

export class Details {
  #plot = null;
  #plotted = kPlotFirst;  // of plottable()
  #shown = null;  // {body} or {sector}
  #programs = [];
  #askedPrograms = 0;  // ms

  // `programsOf(id)` promises the programs of a body, and `joints()` returns those of its model; `onRays` is told of rays of its sensors (SensorRays.show()).
  constructor({panel, name, facts, plot, choice, actions, bodies, programsOf, joints, onRays}) {
    Object.assign(this, {panel, name, facts, plotPlace: plot, choice, actions, bodies, programsOf, joints, onRays});
    choice.onchange = () => this.#plotNumber(choice.value);
  }

  // An array of three BigInt, or null.
  get sector() {
    return this.#shown?.sector ?? null;
  }

  hide() {
    this.#begin(null);
  }

  showBody(id) {
    this.#begin({body: id});
    this.#plotNumber(kPlotFirst);
  }

  showSector(sector) {
    this.#begin({sector}, 'bodies, awake', '', [
      {name: 'bodies', colour: 'blue'},
      {name: 'awake', colour: 'teal'},
    ]);
  }

  #begin(shown, title, unit, lines) {
    this.#shown = shown;
    this.#programs = [];
    this.#askedPrograms = 0;
    this.onRays([]);
    this.panel.hidden = shown === null;
    this.plotPlace.replaceChildren();
    this.#plot = lines ? new Plot(this.plotPlace, title, unit, lines) : null;
    this.actions.hidden = this.choice.hidden = shown?.body === undefined;
    this.choice.replaceChildren();
  }

  #plotNumber(name) {
    this.#plotted = name;
    this.plotPlace.replaceChildren();
    this.#plot = new Plot(this.plotPlace, name, '', [{name, colour: 'teal'}]);
  }

  #refreshChoice(names) {
    if (names.length === this.choice.options.length) return;
    this.choice.replaceChildren(...names.map((name) => new Option(name)));
    this.choice.value = this.#plotted;
    this.choice.hidden = names.length < 2;
  }

  // Shows the current values.
  refresh(hasServers) {
    if (!this.#shown || !this.bodies.view) return;
    if (this.#shown.sector)
      this.#refreshSector(hasServers);
    else
      this.#refreshBody(hasServers);
  }

  #refreshBody(hasServers) {
    const body = this.bodies.look(this.#shown.body);
    if (!body) return;
    const {info, speed, server, isAsleep, position, parts} = body;
    const {view} = this.bodies;
    const place = moved(placed(position), position.local, view.sector_size);
    this.#head(info.name);
    fill(this.facts, [
      ['id', String(info.id)],
      ['shape', describe(parts)],
      ['mass', info.motion === 'dynamic' ? `${rounded(info.mass)} kg` : info.motion],
      ['friction', String(rounded(info.friction))],
      ...(view.frame ? [['frame', view.frame_name]] : []),
      ['sector', sectorText(place.sector)],
      ['position', `${place.local.map((x) => x.toFixed(3)).join(', ')} m`],
      ['speed', `${speed.toFixed(3)} m/s`],
      ['state', isAsleep ? 'asleep' : 'awake'],
      ...(hasServers ? [['server', String(server + 1)]] : []),
      ...programFacts(this.#programs),
    ]);
    const numbers = plottable(body, this.#programs, hasServers ? this.joints() : []);
    this.#refreshChoice([...numbers.keys()]);
    this.#plot.add(numbers.get(this.#plotted) ?? 0);
    if (hasServers && info.motion !== 'static') this.#askPrograms();
  }

  // Now and then: they are not in the stream of bodies.
  #askPrograms() {
    const now = performance.now();
    if (this.#askedPrograms && now - this.#askedPrograms < kProgramsEvery) return;
    this.#askedPrograms = now;
    const shown = this.#shown;
    this.programsOf(shown.body)
        .then(({programs}) => {
          if (this.#shown !== shown) return;
          this.#programs = programs;
          this.onRays(programs.flatMap(({rays}) => rays));
        })
        .catch(() => {});  // the next time
  }

  #refreshSector(hasServers) {
    const {sector} = this.#shown;
    const {count, awake, fastest, server} = this.bodies.inSector(sector);
    this.#head(`sector ${sectorText(sector)}`);
    fill(this.facts, [
      ['edge', `${rounded(this.bodies.view.sector_size)} m`],
      ['bodies', number(count)],
      ['awake', number(awake)],
      ['fastest', `${fastest.toFixed(3)} m/s`],
      ...(hasServers && count > 0 ? [['server', String(server + 1)]] : []),
    ]);
    this.#plot.add(count, awake);
  }

  #head(text) {
    this.name.textContent = this.name.title = text;
  }
}
