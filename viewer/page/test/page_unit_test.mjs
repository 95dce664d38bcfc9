// Positions and frames, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {decode} from '../src/frame.js';
import {between, fromJson, moved, parseSector, sectorText, toJson} from '../src/position.js';

const far = 1n << 62n;

test('sectors are read as numbers and as powers of two', () => {
  assert.deepEqual(parseSector('1, -2 3'), [1n, -2n, 3n]);
  assert.deepEqual(parseSector('(2^62,-2^62,+0)'), [far, -far, 0n]);
  assert.deepEqual(parseSector('-2^63 9223372036854775807 0'), [-(1n << 63n), (1n << 63n) - 1n, 0n]);
  for (const text of ['', '1,2', '1,2,3,4', '2^63,0,0', 'crate,0,0', '1.5,0,0', '10^400,0,0']) {
    assert.equal(parseSector(text), null, text);
  }
});

test('large sectors are written as powers of two', () => {
  assert.equal(sectorText([far, -far, 0n]), '2⁶², −2⁶², 0');
  assert.equal(sectorText([far + 3n, far - 3n, -far + 3n]), '2⁶² + 3, 2⁶² − 3, −2⁶² + 3');
  assert.equal(sectorText([-17n, 1n << 31n, (1n << 40n) + (1n << 30n)]), '-17, 2147483648, 1100585369600');
});

test('positions keep all their bits', () => {
  const place = {sector: [far + 1n, -far - 3n, (1n << 63n) - 1n], local: [0.1, -2.5, 1e-9]};
  assert.deepEqual(fromJson(JSON.parse(JSON.stringify(toJson(place)))), place);
});

test('moving and measuring are exact far away', () => {
  for (const origin of [0n, far, -far]) {
    const from = {sector: [origin, 0n, -origin], local: [63, 0, -60]};
    const to = moved(from, [2, 0.25, -10], 128);
    assert.deepEqual(to, {sector: [origin + 1n, 0n, -origin - 1n], local: [-63, 0.25, 58]});
    assert.deepEqual(between(from, to, 128), [2, 0.25, -10]);
  }
});

test('frames of bodies are read', () => {
  const buffer = new ArrayBuffer(24 + 4 + 8 + 12 + 16 + 4 + 1 + 1);
  const data = new DataView(buffer);
  data.setUint32(0, 1, true);
  data.setUint32(4, 1, true);
  data.setUint32(8, 1, true);
  data.setUint32(12, 2, true);
  data.setBigUint64(16, 99n, true);
  data.setUint32(24, 7, true);
  data.setUint32(28, 8, true);
  data.setUint32(32, 9, true);
  data.setFloat32(36, 1.5, true);
  data.setFloat32(60, 1, true);
  data.setFloat32(64, 3, true);
  data.setUint8(68, 2);
  data.setUint8(69, 1);
  const frame = decode(buffer);
  assert.equal(frame.isKey, true);
  assert.equal(frame.tick, 99);
  assert.deepEqual([...frame.ids, ...frame.gone, ...frame.positions], [7, 8, 9, 1.5, 0, 0]);
  assert.deepEqual(
      [...frame.orientations, ...frame.speeds, ...frame.servers, ...frame.asleep], [0, 0, 0, 1, 3, 2, 1]);
});
