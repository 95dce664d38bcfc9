// The WebSocket to tessera-viewer, reopened whenever it is lost. Requests return promises.
import {decode} from './frame.js';

const kRetryAfterMs = [250, 500, 1000, 2000];
const kAnswerTimeoutMs = 15000;

export class Connection extends EventTarget {
  #socket = null;
  #failures = 0;
  #retry = 0;
  #asked = 0;
  #open = new Map();  // pending requests

  constructor(url) {
    super();
    this.url = url;
    this.bytes = 0;
    this.#connect();
  }

  get isOpen() { return this.#socket?.readyState === WebSocket.OPEN; }
  get isAsking() { return this.#open.size > 0; }

  send(message) {
    if (this.isOpen) this.#socket.send(JSON.stringify(message));
  }

  // Closes it until open(); the server then sends all state again.
  close() {
    clearTimeout(this.#retry);
    if (!this.#socket) return;
    this.#socket.onopen = this.#socket.onmessage = this.#socket.onclose = null;
    this.#socket.close();
    this.#socket = null;
    this.#forgetQuestions();
  }

  open() {
    if (!this.#socket) this.#connect();
  }

  // Resolves to the cluster's answer; rejects with the cluster's message if it refuses.
  ask(what, details = {}, timeoutMs = kAnswerTimeoutMs) {
    const id = ++this.#asked;
    return new Promise((resolve, reject) => {
      if (!this.isOpen) return reject(new Error('not connected to tessera-viewer'));
      const timer = setTimeout(() => this.#answered({id, error: 'the request timed out'}), timeoutMs);
      this.#open.set(id, {resolve, reject, timer});
      this.send({type: 'ask', id, do: what, ...details});
    });
  }

  #answered({id, error, ...result}) {
    const question = this.#open.get(id);
    if (!question) return;
    this.#open.delete(id);
    clearTimeout(question.timer);
    if (error === undefined)
      question.resolve(result);
    else
      question.reject(new Error(error));
  }

  #connect() {
    const socket = new WebSocket(this.url);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => {
      this.#failures = 0;
      this.#emit('open');
    };
    socket.onmessage = ({data}) => {
      this.bytes += typeof data === 'string' ? data.length : data.byteLength;
      if (typeof data !== 'string') return this.#emit('frame', decode(data));
      const message = JSON.parse(data);
      if (message.type === 'answer')
        this.#answered(message);
      else
        this.#emit(message.type, message);
    };
    socket.onclose = () => {
      this.#forgetQuestions();
      this.#emit('lost');
      const wait = kRetryAfterMs[Math.min(this.#failures++, kRetryAfterMs.length - 1)];
      this.#retry = setTimeout(() => this.#connect(), wait);
    };
    this.#socket = socket;
  }

  #forgetQuestions() {
    for (const id of [...this.#open.keys()]) this.#answered({id, error: 'the connection was lost'});
  }

  #emit(type, detail) { this.dispatchEvent(new CustomEvent(type, {detail})); }
}
