// The keyboard: what each key does, and the help that lists them. Keys act where the focus is: on a button that has it,
// Space presses that button; in a text, keys are letters.

const kPressedBySpace = 'button, a[href], summary, [role=button], [role=radio], [role=treeitem], input, select, textarea';
const kTakesLetters = 'input:not([type=checkbox]):not([type=range]), select, textarea, [contenteditable]';

// Whether a control that has the focus keeps the key for itself.
export function belongsToFocus(key, target) {
  if (target.closest?.('dialog[open]')) return true;
  if (target.closest?.(kTakesLetters)) return true;
  return key === ' ' && target.closest?.(kPressedBySpace) !== null;
}

// `commands` are {keys, names, text, run}; `run(key)` is called for one of the keys.
export class Keys {
  constructor(commands, help, table) {
    this.help = help;
    const byKey = new Map(commands.flatMap((command) => command.keys.map((key) => [key, command])));
    addEventListener('keydown', (event) => {
      const {key, target} = event;
      if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
      const command = byKey.get(key);
      if (!command?.run || belongsToFocus(key, target)) return;
      command.run(key);
      event.preventDefault();
    });
    table.replaceChildren(...commands.map(({names, text}) => {
      const row = document.createElement('tr');
      const keys = row.insertCell();
      for (const name of names) keys.append(Object.assign(document.createElement('kbd'), {textContent: name}), ' ');
      row.insertCell().textContent = text;
      return row;
    }));
  }

  showHelp() {
    if (!this.help.open) this.help.showModal();
  }
}
