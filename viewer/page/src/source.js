// The source of what is shown: the connection to the cluster, or a recording. Both accept and send the same
// messages, so listeners need not know which is in use.
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

  // Switches to another source and detaches the previous one.
  use(next) {
    for (const message of kMessages) {
      this.#current?.removeEventListener(message, this.#forward);
      next.addEventListener(message, this.#forward);
    }
    this.#current = next;
  }

  send(message) { this.#current.send(message); }
  ask(...question) { return this.#current.ask(...question); }
}
