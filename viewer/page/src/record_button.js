// Records the world, at the server: a button that begins and ends it, and a link to the file.
import {number} from './plot.js';
import {snapshotName} from './worlds.js';

const kTimeoutMs = 60_000;

export class RecordButton {
  #isBusy = false;
  #told = null;  // the recording whose end has been told; null: before the first status
  #recording = null;

  // `mayRecord()`: as the role allows; `status()` is that of the cluster, or null.
  constructor({button, link, ask, mayRecord, status, notify}) {
    Object.assign(this, {button, link, ask, mayRecord, status, notify});
    button.onclick = () => this.#isOn ? this.#run('stop_recording') : this.#begin();
  }

  get #isOn() { return this.#recording?.is_recording ?? false; }

  // With every status: the recording of the server, which other tabs may have begun.
  refresh(recording = this.#recording) {
    this.#recording = recording;
    const state = this.status()?.state;
    const isLoaded = state === 'paused' || state === 'running';
    this.button.disabled = !this.mayRecord() || this.#isBusy || !(isLoaded || this.#isOn);
    this.button.classList.toggle('on', this.#isOn);
    this.button.setAttribute('aria-pressed', this.#isOn);
    this.button.textContent = this.#isOn ? 'Stop' : 'Record';
    this.button.title = this.#isOn ? 'End the recording and complete its file' : 'Record all that happens from now on';
    this.link.hidden = !recording?.number;
    if (!recording?.number) return;
    const size = `${number(recording.bytes / 1e6)} MB`;
    this.link.textContent = this.#isOn ? `recording ${recording.name}, ${size}` : `${recording.name}.mcap, ${size}`;
    if (this.#isOn || recording.bytes === 0)
      this.link.removeAttribute('href');
    else
      this.link.href = `/recordings/${recording.name}.mcap`;
    this.#tellEnd(recording);
  }

  // Once, unless it was there before this page.
  #tellEnd({number, is_recording: isOn, name, said, is_whole: isWhole}) {
    const ended = isOn ? number - 1 : number;
    if (this.#told !== null && ended > this.#told && !isOn) this.notify(`${name}: ${said}`, !isWhole);
    this.#told = ended;
  }

  #begin() {
    const {world, tick} = this.status();
    return this.#run('record', {name: snapshotName(world, tick)});
  }

  async #run(what, details = {}) {
    this.#isBusy = true;
    this.refresh();
    try {
      this.#recording = await this.ask(what, details, kTimeoutMs);
    } catch (error) {
      this.notify(error.message, true);
    }
    this.#isBusy = false;
    this.refresh();
  }
}
