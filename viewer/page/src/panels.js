// The panels at the sides: both where there is room, else one at a time, or none.
import {storage} from './storage.js';

const kRoomForBoth = '(min-width: 900px)';
const kRoomForOne = '(min-width: 600px)';

export class Panels {
  #shown = {left: true, right: true};

  // `toggles` are the buttons that show and hide the panels `left` and `right`.
  constructor(body, toggles) {
    Object.assign(this, {body, toggles});
    this.both = matchMedia(kRoomForBoth);
    this.one = matchMedia(kRoomForOne);
    for (const media of [this.both, this.one]) media.addEventListener('change', () => this.#fit());
    for (const [side, button] of Object.entries(toggles)) button.onclick = () => this.toggle(side);
    this.#fit();
  }

  toggle(side) {
    const on = !this.#shown[side];
    if (on && !this.both.matches) this.#shown = {left: false, right: false};
    this.#shown[side] = on;
    if (this.both.matches) storage.setItem(`tessera-${side}`, String(on));
    this.#show();
  }

  reveal(side) {
    if (!this.#shown[side]) this.toggle(side);
  }

  // As remembered where there is room for both.
  #fit() {
    const isWanted = (side) => storage.getItem(`tessera-${side}`) !== 'false';
    this.#shown = this.both.matches ? {left: isWanted('left'), right: isWanted('right')} :
                                      {left: this.one.matches, right: false};
    this.#show();
  }

  #show() {
    for (const [side, button] of Object.entries(this.toggles)) {
      this.body.classList.toggle(`without-${side}`, !this.#shown[side]);
      button.setAttribute('aria-expanded', String(this.#shown[side]));
      button.classList.toggle('on', this.#shown[side]);
    }
  }
}
