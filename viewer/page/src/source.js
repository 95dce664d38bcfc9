// Where what is shown comes from: the cluster, by the connection, or a recording. Both hear and say the same
// messages, so whoever listens here need not know which of them speaks.
const kMessages = ['open', 'lost', 'hello', 'world', 'view', 'bodies', 'frame', 'seams', 'status'];

export class Source extends EventTarget {
  #current;
  #forward = ({type, detail}) => this.dispatchEvent(new CustomEvent(type, {detail}));

  constructor(first) {
    super();
    this.use(first);
  }

  get current() { return this.#current; }
  get isOpen() { return this.#current.isOpen; }
  get bytes() { return this.#current.bytes; }

  // From now on nothing is heard of the one before.
  use(next) {
    for (const message of kMessages) {
      this.#current?.removeEventListener(message, this.#forward);
      next.addEventListener(message, this.#forward);
    }
    this.#current = next;
  }

  send(message) { this.#current.send(message); }
  ask(what, details = {}) { return this.#current.ask(what, details); }
}
