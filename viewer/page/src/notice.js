// A message that stands over the picture for a while.

const kShownMs = 4000;
const kShownWithActionMs = 15000;

export class Notice {
  #timer = 0;

  constructor(element) { this.element = element; }

  // `action` is {text, run}: a button beside the message, which then stands for longer.
  show(text, isBad = false, action = null) {
    this.element.textContent = text;
    this.element.className = isBad ? 'on bad' : 'on';
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#hide(), action ? kShownWithActionMs : kShownMs);
    if (!action) return;
    const button = this.element.appendChild(document.createElement('button'));
    button.textContent = action.text;
    button.onclick = () => {
      this.#hide();
      action.run();
    };
  }

  #hide() { this.element.className = ''; }
}
