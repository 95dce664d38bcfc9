// Colours of the web UI and of the picture, light and dark: as the system has it, or as chosen here.

export const kPanelOpacity = 0.96;  // over whatever the picture shows

// Texts are readable on `panel` and `raised`; the unit test computes their contrast.
export const kThemes = {
  dark: {
    ui: {
      backdrop: '#0e1217',
      panel: '#12171d',
      raised: '#222930',
      hover: '#313942',
      chosen: '#1d3a37',
      edge: '#303841',
      control: '#7f8b98',  // outlines of inputs and swatches
      ink: '#e4e9ef',
      quiet: '#a3aebb',
      accent: '#63d2b8',
      warn: '#e3c567',
      bad: '#f58d7f',
      teal: '#63d2b8',
      blue: '#7db1ff',
      amber: '#e3c567',
    },
    picture: {
      sky: '#0e1217',
      still: '#4b5560',
      asleep: '#39424e',
      groundDim: 0.42,
      groundLine: [0.32, 0.42, 0.52],
      groundNet: '#8ba3ba',
      planet: '#141c26',
      net: '#3b5166',
      focus: '#ffffff',
      contact: ['#c98f3d', '#fff3cf'],
      sensorRay: '#8fd0ff',
    },
  },
  light: {
    ui: {
      backdrop: '#dfe7ee',
      panel: '#ffffff',
      raised: '#eaeff4',
      hover: '#d9e1e9',
      chosen: '#cfece5',
      edge: '#c9d2db',
      control: '#6b7783',
      ink: '#161c23',
      quiet: '#4b5763',
      accent: '#00614f',
      warn: '#735000',
      bad: '#a3271b',
      teal: '#00614f',
      blue: '#1c55b8',
      amber: '#8a4b00',
    },
    picture: {
      sky: '#d5e0ea',
      still: '#8f9ba7',
      asleep: '#c3ccd5',
      groundDim: 1,
      groundLine: [0.02, 0.05, 0.09],
      groundNet: '#33495c',
      planet: '#a9bccd',
      net: '#5c7a94',
      focus: '#101820',
      contact: ['#9a5b00', '#c2185b'],
      sensorRay: '#0064b7',
    },
  },
};

const kKey = 'tessera-theme';

export class Theme extends EventTarget {
  #name = null;

  // `media` tells whether the system prefers light colours; `storage` remembers a choice.
  constructor(root, storage, media) {
    super();
    Object.assign(this, {root, storage, media});
    media.addEventListener('change', () => this.#apply());
    this.#apply();
  }

  get name() { return this.#name; }
  get colours() { return kThemes[this.#name]; }

  toggle() {
    this.storage.setItem(kKey, this.#name === 'dark' ? 'light' : 'dark');
    this.#apply();
  }

  #apply() {
    const stored = this.storage.getItem(kKey);
    const name = stored in kThemes ? stored : this.media.matches ? 'light' : 'dark';
    if (name === this.#name) return;
    this.#name = name;
    this.root.dataset.theme = name;
    this.root.style.colorScheme = name;
    for (const [key, colour] of Object.entries(this.colours.ui)) this.root.style.setProperty(`--${key}`, colour);
    this.dispatchEvent(new Event('change'));
  }
}
