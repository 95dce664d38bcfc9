// Where to go: the list of places with bodies, and jumps to a sector or a body. A jump that finds nothing says so, and
// leads back.
import {number} from './plot.js';
import {fromJson, parseSector, sectorText} from './position.js';

const kShownMax = 50;
const kSimilarMax = 5;

export const distanceFor = (half) => Math.min(Math.max(2.4 * half, 14), 260);

const placeText = ({sector, frame_name: frame}) => frame ? `${frame}, ${sectorText(sector)}` : sectorText(sector);

const isSame = (a, b) => a.every((index, axis) => index === b[axis]);

export class Places {
  #arriving = null;  // {sector, from} of a jump whose view has not come yet

  // `goTo(position, distance)` moves the camera and `select(id)` selects a body; `isLive()`: not a recording.
  constructor({list, form, text, names, answer, source, camera, bodies, goTo, select, isLive}) {
    Object.assign(this, {list, text, names, answer, source, camera, bodies, goTo, select, isLive});
    this.all = [];
    text.oninput = () => this.#suggest();
    form.onsubmit = (event) => {
      event.preventDefault();
      this.jump(text.value).catch(() => {});  // the answer says why
    };
  }

  // What the source knows; `all` stays as it is where that fails.
  async ask() {
    const {places} = await this.source.ask('places');
    this.all = places.map((place) => ({...place, ...fromJson(place)}));
  }

  show() {
    const shown = this.all.slice(0, kShownMax);
    const text = JSON.stringify(shown.map((place) => [placeText(place), place.bodies, place.name]));
    if (this.list.dataset.shown === text) return;
    this.list.dataset.shown = text;
    this.list.replaceChildren(...shown.map((place) => {
      const button = document.createElement('button');
      const name = document.createElement('span');
      name.textContent = place.name.split('::')[0];
      const count = document.createElement('small');
      count.textContent = `${number(place.bodies)} bod${place.bodies === 1 ? 'y' : 'ies'}`;
      const sector = document.createElement('small');
      sector.textContent = placeText(place);
      button.append(name, count, sector);
      button.onclick = () => {
        this.#say(null);
        this.goTo(place, distanceFor(place.half));
      };
      return button;
    }));
  }

  // To a sector, or to the body of a name or id. Rejects where there is no such body.
  async jump(text) {
    this.#say(null);
    const from = this.#here();
    const sector = parseSector(text);
    if (sector) {
      this.#arriving = {sector, from};
      return this.goTo({sector, local: [0, 0, 0]});
    }
    const id = /^#?\d+$/.test(text.trim()) ? Number(text.trim().replace('#', '')) : text.trim();
    try {
      const found = await this.source.ask('find', {body: id});
      this.goTo(fromJson(found), 14);
      this.select(found.body);
    } catch (error) {
      this.#say(error.message);
      await this.#offerSimilar(text.trim());
      throw error;
    }
  }

  // After a frame with all bodies of the view.
  arrived() {
    const {view} = this.bodies;
    if (!this.#arriving || view.frame || !isSame(this.#arriving.sector, view.sector)) return;
    const {sector, from} = this.#arriving;
    this.#arriving = null;
    if (this.bodies.countMoving > 0) return;
    this.#say(`No body is near sector ${sectorText(sector)}.`);
    if (from) this.#offer('Back to where you were', () => this.#return(from));
    const [place] = this.all;
    if (place)
      this.#offer(`Go to ${place.name.split('::')[0] || 'the largest place'}`, () => this.goTo(place, distanceFor(place.half)));
  }

  // Of bodies whose names begin with what has been typed so far.
  async #suggest() {
    const text = this.text.value.trim();
    if (!this.isLive() || text === '' || parseSector(text)) return;
    const {names} = await this.source.ask('names', {text}).catch(() => ({names: []}));
    this.names.replaceChildren(...names.map(({name}) => new Option(name)));
  }

  async #offerSimilar(text) {
    if (!this.isLive() || text === '') return;
    const {names} = await this.source.ask('search', {text}).catch(() => ({names: []}));
    for (const {name} of names.slice(0, kSimilarMax)) this.#offer(name, () => this.jump(name).catch(() => {}));
  }

  #here() {
    const {focus, yaw, pitch, distance} = this.camera;
    return focus && {focus, yaw, pitch, distance};
  }

  #return({focus, yaw, pitch, distance}) {
    Object.assign(this.camera, {yaw, pitch});
    this.goTo(focus, distance);
  }

  // Null: nothing.
  #say(text) {
    this.#arriving = null;
    this.answer.hidden = text === null;
    this.answer.replaceChildren(text ?? '');
  }

  #offer(text, run) {
    const button = Object.assign(document.createElement('button'), {type: 'button', textContent: text});
    button.onclick = () => {
      this.#say(null);
      run();
    };
    this.answer.append(button);
  }
}
