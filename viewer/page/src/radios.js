// A group of buttons of which one is chosen, by click or by arrow keys, as ARIA has radio groups.

export class Radios {
  #group;
  #key;

  // `key` names the data attribute that tells the buttons apart; `choose(value)` is called for a choice by hand.
  constructor(group, key, choose) {
    this.#group = group;
    this.#key = key;
    group.setAttribute('role', 'radiogroup');
    for (const button of this.#buttons) {
      button.setAttribute('role', 'radio');
      button.onclick = () => choose(button.dataset[key]);
    }
    group.addEventListener('keydown', (event) => this.#move(event));
  }

  get #buttons() { return [...this.#group.querySelectorAll(`button[data-${this.#key}]`)]; }

  show(value) {
    for (const button of this.#buttons) {
      const isChosen = button.dataset[this.#key] === value;
      button.classList.toggle('on', isChosen);
      button.setAttribute('aria-checked', String(isChosen));
      button.tabIndex = isChosen ? 0 : -1;
    }
  }

  #move(event) {
    const way = {ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1}[event.key];
    if (!way) return;
    const usable = this.#buttons.filter(({disabled, hidden}) => !disabled && !hidden);
    const next = usable.at((usable.indexOf(document.activeElement) + way) % usable.length);
    event.preventDefault();
    event.stopPropagation();
    next?.click();
    next?.focus();
  }
}
