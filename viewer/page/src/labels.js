// Labels in the picture: the selected body, and places too far away to be seen.
export class Labels {
  constructor(parent) {
    this.parent = parent;
    this.free = [];
  }

  // `labels` are {text, at: [x, y] in pixels, className}.
  show(labels) {
    while (this.free.length < labels.length)
      this.free.push(this.parent.appendChild(document.createElement('span')));
    this.free.forEach((span, n) => {
      const label = labels[n];
      span.hidden = !label;
      if (!label) return;
      if (span.textContent !== label.text) span.textContent = label.text;
      span.className = label.className ?? '';
      span.style.transform =
          `translate(${Math.round(label.at[0] + 10)}px, ${Math.round(label.at[1] - 10)}px)`;
    });
  }
}
