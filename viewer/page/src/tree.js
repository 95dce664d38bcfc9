// All bodies by their models, as a tree that is searched by any part of a name.
import {element} from './dashboard.js';
import {modelOf} from './model.js';

// Models in the order of their first bodies, each with its bodies: {name, bodies: [{id, name, text}]}.
export function grouped(names) {
  const models = new Map();
  for (const {id, name} of names) {
    const model = modelOf(name);
    if (!models.has(model)) models.set(model, {name: model, bodies: []});
    models.get(model).bodies.push({id, name, text: name.slice(model.length + 2) || name});
  }
  return [...models.values()];
}

export class Tree {
  #wanted = null;  // a text that waits for the answer to the one before
  #isAsking = false;

  // `ask(what, details)` promises an answer; `go(name)` shows a body.
  constructor({fold, text, tree, note, ask, go}) {
    Object.assign(this, {fold, text, tree, note, ask, go});
    text.oninput = () => this.#search();
    fold.ontoggle = () => this.#search();
    tree.addEventListener('keydown', (event) => this.#move(event));
  }

  // For another world.
  clear() {
    this.tree.replaceChildren();
    this.note.textContent = '';
    this.#search();
  }

  async #search() {
    if (!this.fold.open) return;
    this.#wanted = this.text.value.trim();
    if (this.#isAsking) return;
    this.#isAsking = true;
    while (this.#wanted !== null) {
      const text = this.#wanted;
      this.#wanted = null;
      const answer = await this.ask('search', {text}).catch(() => null);
      if (answer) this.#show(answer, text);
    }
    this.#isAsking = false;
  }

  #show({names, truncated}, text) {
    const models = grouped(names);
    const isOpen = text !== '' && names.length <= 50;
    this.tree.replaceChildren(...models.map((model) => this.#modelItem(model, isOpen)));
    this.#makeReachable(this.#items[0]);
    this.note.textContent = names.length === 0 ? `no name has “${text}” in it` :
        truncated ? `the first ${names.length}; type more of a name to see others` :
                    '';
  }

  #modelItem({name, bodies}, isOpen) {
    const isSingle = bodies.length === 1;
    const item = this.#item(isSingle ? bodies[0].name : `${name} (${bodies.length})`, () => isSingle && this.go(bodies[0].name));
    if (isSingle) return item;
    const group = item.appendChild(element('div'));
    group.setAttribute('role', 'group');
    group.append(...bodies.map((body) => this.#item(body.text, () => this.go(body.name))));
    const set = (on) => {
      item.setAttribute('aria-expanded', String(on));
      group.hidden = !on;
    };
    item.toggle = (on = group.hidden) => set(on);
    set(isOpen);
    return item;
  }

  #item(text, run) {
    const item = element('div');
    item.setAttribute('role', 'treeitem');
    item.tabIndex = -1;
    item.append(element('span', text));
    item.activate = () => item.toggle ? item.toggle() : run();
    item.onclick = (event) => {
      event.stopPropagation();
      this.#makeReachable(item);
      item.activate();
    };
    return item;
  }

  // The items that are not folded away.
  get #items() {
    return [...this.tree.querySelectorAll('[role=treeitem]')].filter((item) => !item.parentElement.hidden);
  }

  // One item at a time is in the order of Tab.
  #makeReachable(item) {
    for (const other of this.tree.querySelectorAll('[tabindex="0"]')) other.tabIndex = -1;
    if (item) item.tabIndex = 0;
  }

  #move(event) {
    const items = this.#items;
    const item = document.activeElement;
    const at = items.indexOf(item);
    if (at < 0) return;
    const isOpen = item.getAttribute('aria-expanded') === 'true';
    const next = {
      ArrowDown: () => items[at + 1],
      ArrowUp: () => items[at - 1],
      Home: () => items[0],
      End: () => items.at(-1),
      ArrowRight: () => item.toggle && !isOpen ? item.toggle(true) : isOpen ? items[at + 1] : null,
      ArrowLeft: () => item.toggle && isOpen ? item.toggle(false) : item.parentElement.closest('[role=treeitem]'),
      Enter: () => item.activate(),
      ' ': () => item.activate(),
    }[event.key];
    if (!next) return;
    event.preventDefault();
    event.stopPropagation();
    const other = next();
    if (!(other instanceof HTMLElement)) return;
    this.#makeReachable(other);
    other.focus();
  }
}
