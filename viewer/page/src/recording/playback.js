// Plays a recording. To the web UI it looks like the connection to tessera-viewer: it receives the position
// of the camera, sends what is visible there, and answers questions, as far as a recording can.
import {fromJson, toJson} from '../position.js';

import {BodyStates} from './body_states.js';
import {placesOf} from './places.js';
import {RecordedView} from './recorded_view.js';
import {kBodies, kContacts, kStatics} from './recording.js';

const kBehindMax = 0.25;  // s of wall-clock time; a longer delay is not caught up
const kRounding = 1e-6;   // ticks
const kStatusEveryMs = 250;
const kNothing = new BodyStates(0);

export class Playback extends EventTarget {
  #recording;
  #pick;
  #view = null;
  #wantsContacts = false;
  #bodies = kNothing;  // at this tick
  #statics = kNothing;
  #contacts = null;    // last read
  #told = new Set();   // ids of bodies already described
  #shown = new Set();  // ids in the last frame
  #stream = null;      // the messages after this tick
  #pending = null;     // the next message of #stream
  #clock = 0;          // in ticks
  #behind = 0;         // s of wall-clock time to catch up
  #statusSaid = 0;     // ms of wall-clock time
  #waiting = null;     // the next task
  #working = null;

  // `pick` finds the body that a ray hits, like Bodies.pick().
  constructor(recording, pick) {
    super();
    this.#recording = recording;
    this.#pick = pick;
    this.isPlaying = false;
    this.speed = 1;
  }

  get recording() { return this.#recording; }
  get isOpen() { return true; }
  get bytes() { return this.#recording.bytesRead; }
  get tick() { return this.#bodies.tick; }
  get time() { return this.#recording.timeOf(this.tick); }
  get counts() {
    const awake = this.#bodies.asleep.reduce((count, isAsleep) => count + 1 - isAsleep, 0);
    return {bodies: this.#bodies.count, awake, statics: this.#statics.count};
  }

  async start() {
    this.#say('open');
    this.#say('hello', {read_only: true});
    this.#say('world', {world: this.#recording.world});
    await this.seek(this.#recording.first);
  }

  // --- messages from the web UI ---

  send({type, on, half, ...place}) {
    if (type === 'look') this.#look(fromJson(place), half);
    if (type === 'contacts' && on !== this.#wantsContacts) {
      this.#wantsContacts = on;
      this.seek(this.tick);
    }
  }

  async ask(what, details) {
    if (what === 'places') return {places: this.#places()};
    if (what === 'find') return this.#find(details.body);
    if (what === 'pick') return this.#pick(details);
    throw new Error(`${what}: recordings cannot be changed`);
  }

  #places() {
    const {bodies, settings} = this.#recording;
    return placesOf(this.#bodies, settings.sectorSize)
        .map(({first, ...place}) => ({...place, ...toJson(place), name: bodies.get(first)?.name ?? ''}));
  }

  #find(wanted) {
    for (const states of [this.#bodies, this.#statics]) {
      for (let n = 0; n < states.count; ++n) {
        const name = this.#recording.bodies.get(states.ids[n])?.name;
        if (wanted === states.ids[n] || wanted === name)
          return {...toJson(states.positionOf(n)), body: states.ids[n], name};
      }
    }
    throw new Error(`no body is called "${wanted}" at this tick`);
  }

  // --- time ---

  play() {
    if (this.isPlaying) return;
    this.isPlaying = true;
    this.#behind = 0;
    if (this.tick >= this.#recording.last)
      this.seek(this.#recording.first);
    else
      this.#say('moved');
  }

  pause() {
    this.isPlaying = false;
    this.#say('moved');
  }

  // Goes to the last recorded tick at or before `tick`.
  seek(tick) { return this.#do(() => this.#goTo(tick)); }

  // Goes to the previous (-1) or next (1) tick.
  step(way) {
    this.pause();
    return this.#do(async () => {
      if (way < 0) return this.#goTo(this.tick - 1);
      const next = await this.#recording.nextTick(this.tick);
      if (next !== undefined) await this.#goTo(next);
    });
  }

  // `seconds` of wall-clock time have passed.
  advance(seconds) {
    if (!this.isPlaying) return;
    this.#behind = Math.min(this.#behind + seconds, kBehindMax);
    if (!this.#working) this.#do(() => this.#goOn());
  }

  // Runs one task at a time; a newer task replaces the one that waits.
  #do(work) {
    this.#waiting = work;
    this.#working ??= this.#work();
    return this.#working;
  }

  async #work() {
    while (this.#waiting) {
      const work = this.#waiting;
      this.#waiting = null;
      try {
        await work();
      } catch (error) {
        this.isPlaying = false;
        this.#waiting = null;
        this.#say('failed', error);
      }
    }
    this.#working = null;
  }

  async #goTo(tick) {
    const last = (topic) => this.#recording.lastAt(topic, Math.max(tick, this.#recording.first));
    const messages = [await last(kBodies), await last(kStatics), this.#wantsContacts && await last(kContacts)];
    this.#stream = null;
    await this.#show(messages.filter(Boolean), true);
    this.#clock = this.tick;
  }

  async #goOn() {
    if (!this.isPlaying) return;
    this.#clock += this.#behind * this.speed / this.#recording.settings.timeStep;
    this.#behind = 0;
    const newest = new Map();  // by topic
    for (;;) {
      const message = await this.#next();
      if (!message || message.tick > this.#clock + kRounding) break;
      newest.set(message.topic, message);
      this.#pending = null;
    }
    if (newest.size > 0) await this.#show([...newest.values()], false);
    if (!this.#pending) this.pause();
  }

  async #next() {
    if (!this.#stream) {
      const topics = [kBodies, kStatics, ...(this.#wantsContacts ? [kContacts] : [])];
      this.#stream = this.#recording.after(this.tick, topics);
      this.#pending = null;
    }
    this.#pending ??= (await this.#stream.next()).value;
    return this.#pending;
  }

  // --- messages to the web UI ---

  async #show(messages, isJump) {
    for (const message of messages) {
      const said = this.#recording.read(message);
      if (message.topic === kBodies) this.#bodies = said;
      if (message.topic === kStatics) this.#statics = said;
      if (message.topic === kContacts) this.#contacts = said;
    }
    await this.#introduce();
    this.#draw(isJump);
    this.#say('moved');
    const now = performance.now();
    if (isJump || now - this.#statusSaid > kStatusEveryMs) {
      this.#statusSaid = now;
      this.#sayStatus();
    }
  }

  async #introduce() {
    const {bodies, shapes} = this.#recording;
    const strangers = [...this.#bodies.ids, ...this.#statics.ids].filter((id) => !this.#told.has(id));
    if (strangers.length === 0) return;
    await this.#recording.learn(strangers, this.tick);
    const known = strangers.map((id) => bodies.get(id)).filter(Boolean);
    for (const id of strangers) this.#told.add(id);
    const parts = known.map(({shape}) => [shape, shapes.get(shape)]);
    this.#say('bodies', {bodies: known, shapes: Object.fromEntries(parts)});
  }

  #look(focus, half) {
    const isElsewhere =
        !this.#view || focus.sector.some((index, axis) => index !== this.#view.focus.sector[axis]);
    this.#view = new RecordedView(this.#recording, focus, half);
    if (isElsewhere) this.#say('view', this.#view.describe());
    this.#draw(isElsewhere);
  }

  #draw(isKey) {
    if (!this.#view) return;
    const frame = this.#view.see(this.#bodies, this.#statics);
    const seen = new Set(frame.ids);
    frame.isKey = isKey;
    frame.gone = [...this.#shown].filter((id) => !seen.has(id));
    this.#shown = seen;
    this.#say('frame', frame);
    if (!this.#wantsContacts) return;
    const isOfThisTick = Number(this.#contacts?.tick) === this.tick;
    this.#say('frame', this.#view.seeContacts(this.tick, isOfThisTick ? this.#contacts.contacts : []));
  }

  #sayStatus() {
    const {world, settings} = this.#recording;
    const status = {state: 'recording', failure: '', world, time: this.time, settings};
    this.#say('status', {answers: true, nodes: [], status});
  }

  #say(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }
}
