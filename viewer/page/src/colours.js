// Colours for servers, sectors, speed and sleep. They differ for eyes that lack one kind of cones, too: the unit test
// computes how far.

export const kServerColours =
    ['#6ea8fe', '#f2a65a', '#757628', '#dbe9b5', '#8959aa', '#d0526d', '#56f3ea', '#b7849b'];
const kSectorColours = kServerColours;
const kPlain = '#a4afba';  // of what has no look, among what has one
export const kAwake = '#7ee0c4';
export const kAsleep = '#56657a';
export const kSpeeds =
    [[0, '#40587a'], [0.05, '#2f7fb5'], [0.5, '#35b39b'], [3, '#c9c54a'], [12, '#ffe9a3'], [60, '#ffffff']];

const parse = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const mix = (a, b, share) => a.map((x, n) => x + (b[n] - x) * share);

const servers = kServerColours.map(parse);
const sectors = kSectorColours.map(parse);
const speeds = kSpeeds.map(([speed, hex]) => [speed, parse(hex)]);
let still = [75, 85, 96];
const plain = parse(kPlain);
const awake = parse(kAwake);
const asleep = parse(kAsleep);
let dim = still;

// What depends on the theme: `still` for static bodies, `asleep` for what those at rest are mixed with.
export function useColours({still: ofStatic, asleep: ofAsleep}) {
  still = parse(ofStatic);
  dim = parse(ofAsleep);
}

export const serverColour = (place) => kServerColours[place % kServerColours.length];

function bySpeed(speed) {
  for (let n = 1; n < speeds.length; ++n) {
    const [low, from] = speeds[n - 1];
    const [high, to] = speeds[n];
    if (speed < high) return mix(from, to, (speed - low) / (high - low));
  }
  return speeds.at(-1)[1];
}

// Returns three bytes. `sector` is three small integers that differ between neighbouring sectors.
export function colourOf(mode, {isStatic, server, sector, speed, isAsleep}) {
  if (isStatic) return still;
  switch (mode) {
    case 'sector': {
      const [i, j, k] = sector;
      return sectors[(((i * 3 + j * 5 + k * 1) % sectors.length) + sectors.length) % sectors.length];
    }
    case 'speed':
      return bySpeed(speed);
    case 'sleep':
      return isAsleep ? asleep : awake;
    case 'look':
      return plain;
    default: {
      const colour = servers[server % servers.length];
      return isAsleep ? mix(colour, dim, 0.45) : colour;
    }
  }
}

export const kLegends = {
  server: null,  // built from the list of servers
  sector: [['neighbouring sectors', kSectorColours.slice(0, 5)]],
  speed: kSpeeds.map(([speed, hex]) => [`${speed} m/s`, [hex]]),
  look: [],
  sleep: [['awake', [kAwake]], ['asleep', [kAsleep]]],
};
