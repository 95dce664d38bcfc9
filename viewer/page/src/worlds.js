// Whole worlds: those that the installation offers, snapshots, and the world that is loaded anew. An empty cluster shows
// what it could load.
import {element} from './dashboard.js';
import {number} from './plot.js';

const kLoadTimeoutMs = 150_000;  // of the cluster, and some more

// A name for a snapshot: of the world and its tick, of characters that names may have.
export function snapshotName(world, tick) {
  const plain = world.replace(/[^A-Za-z0-9_.-]+/g, '-').replace(/^[^A-Za-z0-9]+/, '').slice(0, 40);
  return `${plain || 'world'}-${tick}`;
}

export class Worlds {
  #isOpen = false;
  #isEmpty = false;
  #isBusy = false;
  #shown = '';

  // `ask(what, details, timeout)` promises an answer; `mayLoad()` and `maySave()`: as the role allows; `status()` is
  // that of the cluster, or null.
  constructor({panel, title, hint, lists, buttons, ask, mayLoad, maySave, status, notify}) {
    Object.assign(this, {panel, title, hint, lists, buttons, ask, mayLoad, maySave, status, notify});
    buttons.open.onclick = () => this.#isOpen ? this.close() : this.open();
    buttons.close.onclick = () => this.close();
    buttons.reset.onclick = () => this.#run('reset', {}, 'loaded again');
    buttons.save.onclick = () => this.#save();
  }

  get isBusy() { return this.#isBusy; }

  async open() {
    this.#isOpen = true;
    await this.#fill();
    this.refresh();
    this.lists.querySelector('button')?.focus();
  }

  close() {
    this.#isOpen = false;
    this.refresh();
  }

  // With every status.
  refresh() {
    const state = this.status()?.state;
    const wasEmpty = this.#isEmpty;
    this.#isEmpty = state === 'empty' || state === 'failed';
    if (this.#isEmpty && !wasEmpty) this.#fill();
    const isLoaded = state === 'paused' || state === 'running';
    this.panel.hidden = !this.#isEmpty && !this.#isOpen;
    this.buttons.close.hidden = this.#isEmpty;
    this.buttons.open.disabled = !this.mayLoad();
    this.buttons.reset.disabled = !this.mayLoad() || !isLoaded || this.#isBusy;
    this.buttons.save.disabled = !this.maySave() || !isLoaded || this.#isBusy;
    this.title.textContent = this.#isEmpty ? 'This cluster has no world' : 'Load another world';
    this.hint.textContent = this.#isBusy ? 'Loading…' :
        this.mayLoad() ? 'Choose one, or load a file with tessera load FILE.' :
                         'It appears here as soon as somebody with the role admin loads one.';
    for (const button of this.lists.querySelectorAll('button')) button.disabled = this.#isBusy;
  }

  async #fill() {
    if (!this.mayLoad()) return;
    const {worlds, snapshots} = await this.ask('worlds').catch(() => ({worlds: [], snapshots: []}));
    const shown = JSON.stringify([worlds, snapshots]);
    if (shown === this.#shown) return;
    this.#shown = shown;
    const entry = (name, text, run) => {
      const button = element('button');
      button.append(element('b', name), element('small', text));
      button.onclick = run;
      return button;
    };
    const replace = () => ({replace: !this.#isEmpty});
    const ofWorlds = worlds.map(
        ({name, text}) => entry(name, text, () => this.#run('load', {world: name, ...replace()}, `${name} is loaded`)));
    const ofSnapshots = snapshots.map(
        ({name, bytes}) => entry(
            name, `${number(bytes / 1e6)} MB`, () => this.#run('restore', {name, ...replace()}, `${name} is restored`)));
    this.lists.replaceChildren(
        ...(worlds.length > 0 ? [element('h3', 'Worlds'), ...ofWorlds] : []),
        ...(snapshots.length > 0 ? [element('h3', 'Snapshots'), ...ofSnapshots] : []));
  }

  async #save() {
    const {world, tick} = this.status();
    const name = snapshotName(world, tick);
    await this.#run('save', {name}, `saved as ${name}`);
    if (this.#isOpen) await this.#fill();
  }

  async #run(what, details, done) {
    if (this.#isBusy) return;
    this.#isBusy = true;
    this.refresh();
    try {
      await this.ask(what, details, kLoadTimeoutMs);
      this.#isOpen = false;
      this.notify(done);
    } catch (error) {
      this.notify(error.message, true);
    }
    this.#isBusy = false;
    this.refresh();
  }
}
