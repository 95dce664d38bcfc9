// Colours for servers, sectors, speed and sleep.

export const kServerColours = [
  '#6ea8fe', '#f2a65a', '#7ccf9a', '#d58bd6', '#e3c567', '#6fc7d6', '#e58080', '#a99cf0', '#b5c77a', '#e89ac0'
];
const kSectorColours =
    ['#6ea8fe', '#f2a65a', '#7ccf9a', '#d58bd6', '#e3c567', '#6fc7d6', '#e58080', '#a99cf0'];
const kStatic = '#4b5560';
const kPlain = '#a4afba';  // of what has no look, among what has one
const kAwake = '#63d2b8';
const kAsleep = '#56657a';
const kSpeeds =
    [[0, '#4d5f7a'], [0.05, '#4f8fba'], [0.5, '#63d2b8'], [3, '#e3c567'], [12, '#e5735f'], [60, '#ff5c8a']];

const parse = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const mix = (a, b, share) => a.map((x, n) => x + (b[n] - x) * share);

const servers = kServerColours.map(parse);
const sectors = kSectorColours.map(parse);
const speeds = kSpeeds.map(([speed, hex]) => [speed, parse(hex)]);
const still = parse(kStatic);
const plain = parse(kPlain);
const awake = parse(kAwake);
const asleep = parse(kAsleep);
const dim = parse('#39424e');

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
