// Colours, keys, names and pictures, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {colourOf, kAsleep, kAwake, kServerColours, kSpeeds, useColours} from '../src/colours.js';
import {belongsToFocus} from '../src/keys.js';
import {kPanelOpacity, kThemes, Theme} from '../src/theme.js';

import {packages, sources} from './sources.mjs';
import {animated} from './webp.mjs';

const {grouped, meshOf, snapshotName} = await sources('ground.js', 'tree.js', 'worlds.js');

const culori = packages('culori');

// How colours look to eyes with all cones, and to those that lack one kind (Machado et al. 2009, at full severity).
const kVisions = {
  trichromacy: (colour) => colour,
  protanopia: culori.filterDeficiencyProt(1),
  deuteranopia: culori.filterDeficiencyDeuter(1),
  tritanopia: culori.filterDeficiencyTrit(1),
};
const distance = culori.differenceCiede2000();

// The least CIEDE2000 distance of two of these colours in any vision; 2 is just seen, 10 at a glance.
function leastDistance(colours) {
  const pairs = colours.flatMap((a, n) => colours.slice(n + 1).map((b) => [a, b]));
  return Math.min(...Object.values(kVisions).flatMap(
      (seen) => pairs.map((pair) => distance(...pair.map((colour) => seen(culori.parse(colour)))))));
}

test('distances and contrasts of colours are those of their standards', () => {
  const lab = (l, a, b) => ({mode: 'lab65', l, a, b});
  // Of the data that accompany Sharma, Wu and Dalal (2005).
  assert.ok(Math.abs(distance(lab(50, 2.6772, -79.7751), lab(50, 0, -82.7485)) - 2.0425) < 1e-4);
  assert.ok(Math.abs(distance(lab(22.7233, 20.0904, -46.694), lab(23.0331, 14.973, -42.5619)) - 2.0373) < 1e-4);
  assert.equal(culori.wcagContrast('#000', '#fff'), 21);
  const [red, green] = ['#b05a5a', '#7a7a50'].map(culori.parse);
  assert.ok(distance(red, green) > 30);
  assert.ok(distance(...[red, green].map(kVisions.deuteranopia)) < 5, 'which some cannot tell apart');
});

test('texts of both themes are readable: WCAG 2 AA, whatever the picture behind the panels shows', () => {
  for (const [name, {ui}] of Object.entries(kThemes)) {
    for (const behind of ['#000000', '#ffffff']) {
      const panel = culori.interpolate([behind, ui.panel], 'rgb')(kPanelOpacity);
      for (const text of ['ink', 'quiet', 'accent', 'warn', 'bad', 'teal', 'blue', 'amber']) {
        const contrast = culori.wcagContrast(ui[text], panel);
        assert.ok(contrast >= 4.5, `${name}: ${text} on a panel over ${behind}: ${contrast}`);
      }
      assert.ok(culori.wcagContrast(ui.control, panel) >= 3, `${name}: outlines of controls`);
    }
    for (const [text, ground] of [
           ['ink', 'raised'], ['quiet', 'raised'], ['warn', 'raised'], ['bad', 'raised'], ['blue', 'raised'],
           ['ink', 'hover'], ['accent', 'hover'], ['accent', 'chosen'], ['ink', 'backdrop'],
         ]) {
      const contrast = culori.wcagContrast(ui[text], ui[ground]);
      assert.ok(contrast >= 4.5, `${name}: ${text} on ${ground}: ${contrast}`);
    }
  }
});

test('servers, speeds and sleep are told apart by eyes that lack one kind of cones', () => {
  assert.ok(leastDistance(kServerColours) > 14, `servers: ${leastDistance(kServerColours)}`);
  const speeds = kSpeeds.map(([, colour]) => colour);
  assert.ok(leastDistance(speeds) > 11, `speeds: ${leastDistance(speeds)}`);
  const lightness = speeds.map((colour) => culori.lab65(colour).l);
  assert.deepEqual(lightness, [...lightness].sort((a, b) => a - b), 'faster is lighter');
  assert.ok(leastDistance([kAwake, kAsleep]) > 30, `sleep: ${leastDistance([kAwake, kAsleep])}`);
  for (const {picture} of Object.values(kThemes)) {
    useColours(picture);
    const asleep = kServerColours.slice(0, 4).map((_, server) => {
      const [r, g, b] = colourOf('server', {isStatic: false, server, isAsleep: true});
      return culori.formatHex({mode: 'rgb', r: r / 255, g: g / 255, b: b / 255});
    });
    assert.ok(leastDistance(asleep) > 7, `the first four servers, asleep: ${leastDistance(asleep)}`);
    assert.ok(leastDistance([picture.still, picture.sky]) > 10, 'ground and sky');
  }
});

test('the theme follows the system until one is chosen, which is remembered', () => {
  const media = Object.assign(new EventTarget(), {matches: true});
  const stored = new Map();
  const storage = {getItem: (key) => stored.get(key) ?? null, setItem: (key, value) => stored.set(key, value)};
  const root = () => ({dataset: {}, style: {setProperty() {}}});
  const theme = new Theme(root(), storage, media);
  assert.equal(theme.name, 'light');
  media.matches = false;
  media.dispatchEvent(new Event('change'));
  assert.equal(theme.name, 'dark');
  theme.toggle();
  assert.equal(theme.name, 'light');
  assert.equal(new Theme(root(), storage, media).name, 'light');
});

test('keys belong to the control that has the focus, where it uses them', () => {
  const focused = (...names) => ({closest: (selector) => selector.split(', ').some((part) => names.includes(part)) ? {} : null});
  const [button, text, dialog, canvas] = [focused('button'), focused('textarea'), focused('dialog[open]'), focused()];
  assert.deepEqual([button, text, dialog, canvas].map((target) => belongsToFocus(' ', target)), [true, true, true, false]);
  assert.deepEqual([button, text, dialog, canvas].map((target) => belongsToFocus('g', target)), [false, true, true, false]);
});

test('an animated picture has the frames of still ones', () => {
  const still = (...bytes) => {
    const picture = Buffer.from(bytes);
    const head = Buffer.alloc(20);
    head.write('RIFF\0\0\0\0WEBPVP8 ', 'latin1');
    head.writeUInt32LE(picture.length, 16);
    return Buffer.concat([head, picture, Buffer.alloc(picture.length % 2)]);
  };
  const made = animated([still(1, 2, 3), still(4, 5)], 20, 10, 40);
  assert.equal(made.readUInt32LE(4), made.length - 8);
  assert.equal(made.toString('latin1', 8, 16), 'WEBPVP8X');
  assert.deepEqual([made.readUIntLE(24, 3), made.readUIntLE(27, 3)], [19, 9]);
  const first = made.indexOf('ANMF');
  assert.deepEqual([made.readUInt32LE(first + 4), made.readUIntLE(first + 20, 3)], [16 + 12, 40]);
  assert.deepEqual([...made.subarray(first + 32, first + 36)], [1, 2, 3, 0]);
  assert.equal(made.subarray(first + 1).indexOf('ANMF') > 0, true);
  assert.throws(() => animated([Buffer.from('RIFF    WEBPVP8L    ', 'latin1')], 1, 1, 1), /no lossy WebP/);
});

test('bodies are grouped by their models', () => {
  const names = ['arm::upper', 'ground', 'arm::lower::tip'].map((name, id) => ({id, name}));
  assert.deepEqual(grouped(names), [
    {name: 'arm', bodies: [{id: 0, name: 'arm::upper', text: 'upper'}, {id: 2, name: 'arm::lower::tip', text: 'lower::tip'}]},
    {name: 'ground', bodies: [{id: 1, name: 'ground', text: 'ground'}]},
  ]);
});

test('ground has triangles between points that are there', () => {
  const points = [0, 0, 1, 1, 0, 2, 0, 1, 3, null, null, null];
  const {positions, triangles, lines} = meshOf(2, points);
  assert.deepEqual([...positions], [0, 0, 1, 1, 0, 2, 0, 1, 3, 0, 0, 0]);
  assert.deepEqual([triangles, lines], [[], [0, 1, 0, 2]]);
  const whole = meshOf(3, Array.from({length: 27}, (_, n) => n));
  assert.equal(whole.triangles.length, 3 * 2 * 4);
  assert.equal(whole.lines.length, 2 * 12);
});

test('snapshots are named by world and tick, as names may be', () => {
  assert.equal(snapshotName('tower', 12), 'tower-12');
  assert.equal(snapshotName('../a b/é', 3), 'a-b--3');
  assert.equal(snapshotName('', 0), 'world-0');
  assert.match(snapshotName('x'.repeat(99), 2 ** 53), /^[A-Za-z0-9][A-Za-z0-9_.-]{0,63}$/);
});
