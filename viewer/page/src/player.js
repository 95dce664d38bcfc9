// Opens and closes recordings, and runs the panel with the time slider.
import {Playback} from './recording/playback.js';
import {Recording} from './recording/recording.js';

const kSpeeds = [0.1, 0.25, 0.5, 1, 2, 4, 10];
const kPlay = 'M4 2.5v11l9-5.5z';
const kPause = 'M3.5 2.5h3v11h-3zM9.5 2.5h3v11h-3z';

const $ = (id) => document.getElementById(id);

export class Player {
  #playback = null;

  constructor({connection, source, bodies, notify}) {
    Object.assign(this, {connection, source, bodies, notify});
    this.onBegin = () => {};
    this.onEnd = () => {};
    $('speed').replaceChildren(
        ...kSpeeds.map((speed) => new Option(`${speed} ×`, speed, false, speed === 1)));
    $('speed').onchange = () => this.#playback.speed = Number($('speed').value);
    $('replay').onclick = () => this.toggle();
    $('back').onclick = () => this.step(-1);
    $('next').onclick = () => this.step(1);
    $('timeline').oninput = () => this.#playback.seek(Number($('timeline').value));
    $('timeline').onpointerup = () => $('timeline').blur();  // gives the keyboard back to the web UI
    $('live').onclick = () => this.close();
    $('open').onclick = () => $('file').click();
    $('file').onchange = () => {
      this.open($('file').files[0]);
      $('file').value = '';  // so that the same file can be chosen again
    };
    this.#takeDropped();
  }

  get isOn() { return this.#playback !== null; }
  get isPlaying() { return this.#playback?.isPlaying ?? false; }

  // Shows a recording instead of the current source. A file that is no recording is reported and changes nothing.
  async open(file) {
    let recording;
    try {
      recording = await Recording.open(file);
    } catch (error) {
      return this.notify(error.message, true);
    }
    this.connection.close();
    this.#playback = new Playback(recording, (ray) => this.bodies.pick(ray));
    this.#playback.speed = Number($('speed').value);
    this.#playback.addEventListener('moved', () => this.#show());
    this.#playback.addEventListener('failed', ({detail}) => {
      this.#show();
      this.notify(`${file.name}: ${detail.message}`, true);
    });
    this.source.use(this.#playback);
    this.onBegin();
    this.#showRecording(recording);
    await this.#playback.start();
  }

  // Back to the cluster.
  close() {
    this.#playback = null;
    this.source.use(this.connection);
    this.onEnd();
    this.connection.open();
  }

  toggle() {
    if (this.#playback.isPlaying)
      this.#playback.pause();
    else
      this.#playback.play();
  }

  step(way) { this.#playback.step(way); }

  advance(seconds) { this.#playback?.advance(seconds); }

  #takeDropped() {
    const hasFile = ({dataTransfer}) => dataTransfer?.types.includes('Files');
    const showTarget = (on) => document.body.classList.toggle('dropping', on);
    addEventListener('dragover', (event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      showTarget(true);
    });
    addEventListener('dragleave', ({relatedTarget}) => showTarget(relatedTarget !== null));
    addEventListener('drop', (event) => {
      if (!hasFile(event)) return;
      event.preventDefault();
      showTarget(false);
      this.open(event.dataTransfer.files[0]);
    });
  }

  #showRecording({file, first, last, everyTicks}) {
    $('fileName').textContent = $('fileName').title = file.name;
    Object.assign($('timeline'), {min: first, max: last, step: everyTicks, value: first});
  }

  #show() {
    if (!this.#playback) return;
    const {isPlaying, tick, time, recording, counts} = this.#playback;
    $('timeline').value = tick;
    $('timeline')
        .style.setProperty('--share', (tick - recording.first) / (recording.last - recording.first || 1));
    $('moment').textContent = `${time.toFixed(2)} s · tick ${tick}`;
    $('until').textContent = `of ${recording.timeOf(recording.last).toFixed(2)} s · tick ${recording.last}`;
    $('population').textContent = `${counts.awake} of ${counts.bodies} bodies awake`;
    $('replay').querySelector('path').setAttribute('d', isPlaying ? kPause : kPlay);
    $('back').disabled = tick <= recording.first;
    $('next').disabled = tick >= recording.last;
  }
}
