// Positions, frames, levels of detail and recordings, without a browser.
import assert from 'node:assert/strict';
import {test} from 'node:test';

import {decode} from '../src/frame.js';
import {between, fromJson, isSameFrame, moved, parseSector, sectorText, toJson} from '../src/position.js';

import {fileOf, kTimeStep, kTopics, recordingOf} from './recordings.mjs';
import {sources} from './sources.mjs';

// Node.js 18 has Event but no CustomEvent.
globalThis.CustomEvent ??= class extends Event {
  constructor(type, {detail}) {
    super(type);
    this.detail = detail;
  }
};

const {Bodies, Camera, Playback, Recording, plottable, programFacts} =
    await sources('bodies.js', 'camera.js', 'details.js', 'recording/playback.js', 'recording/recording.js');

const far = 1n << 62n;

test('sectors are parsed as numbers and as powers of two', () => {
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

test('programs are a row each, with their numbers or why they were stopped', () => {
  const walks = {kind: 'character', inputs: {x: 1.5, y: 0}, values: {grounded: 1, slope: 0.123456}, fault: ''};
  const stopped = {...walks, kind: 'wander', fault: 'tick 7: a value is not finite'};
  assert.deepEqual(programFacts([walks, stopped, {kind: 'pad', inputs: {}, values: {count: 2}, fault: ''}]), [
    ['character', 'x 1.5, y 0; grounded 1, slope 0.1235'],
    ['wander', 'stopped: tick 7: a value is not finite'],
    ['pad', 'count 2'],
  ]);
  const ranges = Object.fromEntries(Array.from({length: 40}, (_, n) => [`range_${n}`, n]));
  const [[title, numbers]] = programFacts([{kind: 'ranger', name: 'front', inputs: {}, values: ranges, fault: ''}]);
  assert.equal(title, 'ranger front');
  assert.match(numbers, /^range_0 0, .*range_15 15, \.\.\. 40 numbers$/);
});

test('what a body and its programs measure can be plotted', () => {
  const joints = [
    {name: 'arm::elbow', axes: [{position: 0.5, unit: 'rad'}]},
    {name: 'arm::ball', axes: [{position: null, unit: 'rad'}, {position: 1, unit: 'm'}]},
  ];
  assert.deepEqual([...plottable({speed: 3}, [], joints)], [
    ['speed, m/s', 3], ['joint elbow, rad', 0.5], ['joint ball axis 2, m', 1],
  ]);
  const programs = [
    {kind: 'imu', name: 'front', inputs: {}, values: {x: 1, y: 2}},
    {kind: 'pid', name: '', inputs: {set_point: 0.5}, values: {error: 0.25}},
  ];
  assert.deepEqual([...plottable({speed: 3}, programs)], [
    ['speed, m/s', 3], ['front: x', 1], ['front: y', 2], ['pid: set_point', 0.5], ['pid: error', 0.25],
  ]);
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

test('positions stay in their frame', () => {
  const aboard = {sector: [far, 0n, 0n], local: [1, 2, 3], frame: 2};
  assert.deepEqual(fromJson(toJson(aboard)), aboard);
  assert.deepEqual(moved(aboard, [16, 0, 0], 16), {...aboard, sector: [far + 1n, 0n, 0n]});
  assert.ok(isSameFrame(aboard, moved(aboard, [1, 1, 1], 16)));
  assert.ok(!isSameFrame(aboard, {sector: [far, 0n, 0n], local: [1, 2, 3]}));
  assert.ok(!('frame' in toJson({sector: [0n, 0n, 0n], local: [0, 0, 0]})));
});

test('a camera that rides along keeps up at any speed, and what is left of the way fades', () => {
  const camera = new Camera({addEventListener() {}});
  camera.sectorSize = 16;
  camera.jump({sector: [far, 0n, 0n], local: [0, 0, 0]}, 10);
  const body = {sector: [far, 0n, 0n], local: [4, 0, 0]};
  const away = () => Math.hypot(...between(camera.focus, body, 16));
  camera.ride(body);
  assert.equal(away(), 4, 'at first it stays where it is');
  for (let n = 0; n < 60; ++n) {
    Object.assign(body, moved(body, [130, 0, 0], 16));  // 7.8 km/s
    camera.advance(1 / 60);
    camera.ride(body);
  }
  assert.ok(away() < 1e-3, `${away()} m`);
  Object.assign(body, moved(body, [1e6, 0, 0], 16));
  camera.stopRiding();
  camera.ride(body);
  assert.equal(away(), 0, 'what is far away is jumped to');
});

test('frames of bodies are decoded', () => {
  const buffer = new ArrayBuffer(24 + 8 + 16 + 12 + 16 + 4 + 1 + 1);
  const data = new DataView(buffer);
  data.setUint32(0, 1, true);
  data.setUint32(4, 1, true);
  data.setUint32(8, 1, true);
  data.setUint32(12, 2, true);
  data.setBigUint64(16, 99n, true);
  data.setFloat64(24, 7, true);
  data.setFloat64(32, 8, true);
  data.setFloat64(40, 9, true);
  data.setFloat32(48, 1.5, true);
  data.setFloat32(72, 1, true);
  data.setFloat32(76, 3, true);
  data.setUint8(80, 2);
  data.setUint8(81, 3);
  const frame = decode(buffer);
  assert.equal(frame.isKey, true);
  assert.equal(frame.tick, 99);
  assert.deepEqual([...frame.ids, ...frame.gone, ...frame.positions], [7, 8, 9, 1.5, 0, 0]);
  assert.deepEqual(
      [...frame.orientations, ...frame.speeds, ...frame.servers, ...frame.asleep, ...frame.aboard],
      [0, 0, 0, 1, 3, 2, 1, 1]);
});

// A row of bodies along x, of different distances and kinds.
const kRow = [
  {id: 1, x: 2, shape: {kind: 'sphere', radius: 0.5}},
  {id: 2, x: 100, shape: {kind: 'sphere', radius: 0.5}},
  {id: 3, x: 5000, shape: {kind: 'sphere', radius: 0.5}},
  {id: 4, x: 5001, shape: {kind: 'box', size: [1, 2, 3]}},
  {id: 5, x: 5002, shape: {kind: 'box', size: [1, 2, 3]}, motion: 'static'},
];

function rowOfBodies(aboard = []) {
  const bodies = new Bodies();
  bodies.introduce({
    bodies: kRow.map(({id, motion = 'dynamic'}) => ({id, shape: id, motion})),
    shapes: Object.fromEntries(
        kRow.map(({id, shape}) => [id, [{...shape, position: [0, 0, 0], orientation: [0, 0, 0, 1]}]])),
  });
  const count = kRow.length;
  const frame = {
    isKey: true,
    tick: 1,
    count,
    gone: [],
    ids: kRow.map(({id}) => id),
    positions: kRow.flatMap(({x}) => [x, 0, 0]),
    orientations: kRow.flatMap(() => [0, 0, 0.6, 0.8]),
    speeds: kRow.map(() => 1),
    servers: kRow.map(() => 0),
    asleep: kRow.map(() => 0),
    aboard: kRow.map(({id}) => Number(aboard.includes(id))),
  };
  bodies.apply(frame, {sector: [0n, 0n, 0n], low: [0, 0, 0], sector_size: 128});
  return bodies;
}

// The number of bodies drawn as meshes and as points.
function drawn({group}) {
  const counts = {meshes: 0, points: 0};
  for (const {isPoints, geometry} of group.children) {
    if (isPoints)
      counts.points += geometry.drawRange.count;
    else
      counts.meshes += geometry.instanceCount;
  }
  return counts;
}

test('what is aboard of a frame that moves is hit where it is drawn', () => {
  const ray = {sector: ['0', '0', '0'], local: [100, 5, 0], direction: [0, -1, 0], length: 20};
  assert.deepEqual(rowOfBodies().pickAboard(ray), {hit: false}, 'the server looks for the others');
  const bodies = rowOfBodies([2, 3]);
  const hit = bodies.pickAboard(ray);
  assert.equal(hit.body, 2);
  assert.ok(Math.abs(hit.distance - 4.5) < 0.02 && hit.normal[1] > 0.95, `${hit.distance} ${hit.normal}`);
  assert.deepEqual(hit.drawn.position, {sector: [0n, 0n, 0n], local: [100, 0, 0]});
  assert.deepEqual(bodies.pickAboard({...ray, local: [2, 5, 0]}), {hit: false}, 'it is in the world');
  // Half way to where the next frame has it.
  const frame = {
    isKey: false, tick: 2, count: 1, gone: [], ids: [2], positions: [110, 0, 0], orientations: [0, 0, 0, 1],
    speeds: [0], servers: [0], asleep: [0], aboard: [1],
  };
  bodies.apply(frame, bodies.view);
  bodies.blend(performance.now() + bodies.frameMs / 2);
  const {drawn} = bodies.pickAboard({...ray, local: [105, 5, 0]});
  assert.ok(Math.abs(drawn.position.local[0] - 105) < 0.5, drawn.position.local);
  bodies.blend(performance.now() + 1000);
  assert.equal(bodies.pickAboard({...ray, local: [110, 5, 0]}).body, 2);
});

test('distant bodies are drawn as points, except static ones', () => {
  const bodies = rowOfBodies();
  for (const [x, meshes, points] of [[0, 2, 3], [5000, 3, 2], [100, 2, 3], [1e6, 1, 4], [0, 2, 3]]) {
    bodies.prepare({position: {x, y: 0, z: 0}, fov: 50}, 800);
    assert.deepEqual(drawn(bodies), {meshes, points}, `from ${x} m`);
  }
});

test('bodies keep their poses and colours at every level of detail', () => {
  const bodies = rowOfBodies();
  const look = () => kRow.map(({id}) => bodies.look(id));
  const before = look();
  assert.deepEqual(before.map(({position}) => position.local[0]), kRow.map(({x}) => x));
  for (const x of [0, 5000, 1e6, 100, 2]) {
    bodies.prepare({position: {x, y: 0, z: 0}, fov: 50}, 800);
    assert.deepEqual(look(), before, `from ${x} m`);
  }
});

test('triggers are translucent, cast no shadow, and hide nothing at any distance', () => {
  const part = {kind: 'box', size: [1, 1, 1], position: [0, 0, 0], orientation: [0, 0, 0, 1]};
  const bodies = new Bodies();
  const motion = 'kinematic';
  bodies.introduce({
    bodies: [{id: 1, shape: 1, motion}, {id: 2, shape: 1, motion, trigger: true}, {id: 3, shape: 2, motion}],
    shapes: {1: [part], 2: [{...part, trigger: true}]},
  });
  const frame = {
    isKey: true,
    tick: 1,
    count: 3,
    gone: [],
    ids: [1, 2, 3],
    positions: [0, 0, 0, 5, 0, 0, 0, 5, 0],
    orientations: [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1],
    speeds: [0, 0, 0],
    servers: [0, 0, 0],
    asleep: [0, 0, 0],
  };
  bodies.apply(frame, {sector: [0n, 0n, 0n], low: [0, 0, 0], sector_size: 128});
  for (const [z, points] of [[3, 0], [1e5, 1]]) {
    bodies.prepare({position: {x: 0, y: 0, z}, fov: 50}, 800);
    assert.deepEqual(drawn(bodies), {meshes: 3 - points, points}, `from ${z} m`);
    const clear = bodies.group.children.filter(({material}) => material.transparent);
    assert.deepEqual(clear.map(({geometry}) => geometry.instanceCount).filter((count) => count > 0), [2]);
    for (const {material, castShadow} of clear)
      assert.deepEqual([material.opacity < 0.5, material.depthWrite, castShadow], [true, false, false]);
  }
});

test('bodies are drawn by their looks, in their own colours or in those of a mode', () => {
  const part = {kind: 'box', size: [1, 1, 1], position: [0, 0, 0], orientation: [0, 0, 0, 1]};
  const bodies = new Bodies();
  assert.equal(bodies.hasLooks, false);
  bodies.introduce({
    bodies: [{id: 1, shape: 1, motion: 'dynamic', look: 0}, {id: 2, shape: 1, motion: 'static'}],
    shapes: {1: [part]},
    looks: {0: [{...part, colour: 0xff0000}, {...part, position: [0, 0, 1], colour: 0x0000ff}]},
  });
  assert.equal(bodies.hasLooks, true);
  const frame = {
    isKey: true,
    tick: 1,
    count: 2,
    gone: [],
    ids: [1, 2],
    positions: [0, 0, 0, 5, 0, 0],
    orientations: [0, 0, 0, 1, 0, 0, 0, 1],
    speeds: [0, 0],
    servers: [0, 0],
    asleep: [0, 0],
  };
  bodies.apply(frame, {sector: [0n, 0n, 0n], low: [0, 0, 0], sector_size: 128});
  bodies.prepare({position: {x: 0, y: 0, z: 3}, fov: 50}, 800);
  const batch = bodies.group.children.find(({geometry}) => geometry.attributes.colour);
  assert.ok(batch, 'the look has colours');
  const {array} = batch.geometry.attributes.colour;
  assert.deepEqual([...array.slice(0, 3)], [255, 0, 0]);
  assert.deepEqual([...array.slice(-3)], [0, 0, 255]);
  const tint = () => [...batch.geometry.attributes.tint.array.slice(0, 3)];
  assert.notDeepEqual(tint(), [0, 0, 0], 'by server');
  bodies.mode = 'look';
  assert.deepEqual(tint(), [0, 0, 0], 'its own colours, not lit up');
  bodies.prepare({position: {x: 1e6, y: 0, z: 0}, fov: 50}, 800);
  const points = bodies.group.children.find(({isPoints}) => isPoints);
  assert.deepEqual([...points.geometry.attributes.tint.array.slice(0, 3)], [127, 0, 127], 'their mean');
  assert.deepEqual(bodies.look(1).parts, [part], 'what is said of it is its shape');
  bodies.clear();
  assert.equal(bodies.hasLooks, false);
});

// --- recordings: a ball that falls 1 cm per tick above a plane, 2^62 sectors away, and a crate added later ---

const kBall = 5;
const kCrate = 9;
const kGround = 2;
const kCrateComes = 60;
const kTicks = 120;
const home = {
  i: far,
  j: -far,
  k: 0n
};

const stateOf = (id, x, z, more = {}) =>
    ({id: BigInt(id), pose: {position: {sector: home, local: {x, y: 0, z}}}, ...more});
const shapeOf = (kind, value) => ({parts: [{geometry: {kind: {case: kind, value}}}]});
const described = (id, name, shape, motion = 0) =>
    ({id: BigInt(id), name, properties: {shape, motion, mass: 3}});

const heightAt = (tick) => 10 - tick / 100;

function fallingBall({ticks = kTicks, every = 1, weight = 0} = {}) {
  const ballast = 'x'.repeat(weight);
  const messages = [
    [
      0, '/tessera/catalogue', {
        bodies: [described(kGround, 'ground', 1, 1), described(kBall, 'ball' + ballast, 2)],
        shapes: {1: shapeOf('plane', {normal: {z: 1}}), 2: shapeOf('sphere', {radius: 0.5})},
      }
    ],
    [0, '/tessera/static_bodies', {tick: 0n, bodies: [stateOf(kGround, 30, 0)]}],
  ];
  for (let tick = 0; tick <= ticks; tick += every) {
    const ball = stateOf(kBall, 1, heightAt(tick), {linearVelocity: {x: 3, z: -4}, asleep: tick > 90});
    const crate = stateOf(kCrate, -70, 0, {
      pose: {
        position: {sector: home, local: {x: -63, y: 1}},
        orientation: {z: 1},
      }
    });
    if (tick === kCrateComes) {
      messages.push([
        tick, '/tessera/catalogue', {
          bodies: [described(kCrate, 'crate', 3)],
          shapes: {3: shapeOf('box', {size: {x: 1, y: 2, z: 3}})},
        }
      ]);
    }
    messages.push([
      tick, '/tessera/bodies', {tick: BigInt(tick), bodies: tick >= kCrateComes ? [ball, crate] : [ball]}
    ]);
    const contact = {
      phase: 1,
      position: {sector: home, local: {x: 1, z: heightAt(tick)}},
      normal: {z: 1},
      impulse: tick,
    };
    messages.push(
        [tick, '/tessera/contacts', {tick: BigInt(tick), contacts: [contact, {...contact, phase: 2}]}]);
  }
  return messages;
}

// A stand-in for the web UI that keeps the last message of each type.
async function playbackOf(messages, options) {
  const playback =
      new Playback(await Recording.open(await recordingOf(messages, options)), () => ({hit: false}));
  const heard = {frames: [], bodies: [], failures: []};
  for (const type of ['hello', 'world', 'view', 'status'])
    playback.addEventListener(type, ({detail}) => heard[type] = detail);
  playback.addEventListener('bodies', ({detail}) => heard.bodies.push(detail));
  playback.addEventListener('failed', ({detail}) => heard.failures.push(detail.message));
  playback.addEventListener('frame', ({detail}) => heard.frames.push(detail));
  await playback.start();
  return {playback, heard, last: () => heard.frames.at(-1)};
}

const lookHome = (playback, half = 100) =>
    playback.send({type: 'look', sector: [String(far), String(-far), '0'], local: [0, 0, 0], half});
const placeOf = (frame, id) => {
  const n = frame.ids.indexOf(id);
  return n < 0 ? null : [...frame.positions.subarray(3 * n, 3 * n + 3)];
};

test('a recording names its world and starts at its first tick', async () => {
  const {playback, heard, last} = await playbackOf(fallingBall());
  assert.deepEqual([heard.world, heard.hello], [{world: 'test'}, {read_only: true}]);
  assert.equal(heard.status.status.state, 'recording');
  assert.deepEqual(
      heard.bodies.flatMap(({bodies}) => bodies).map(({id, name, motion, mass}) => [id, name, motion, mass]),
      [[kBall, 'ball', 'dynamic', 3], [kGround, 'ground', 'static', 3]]);
  assert.deepEqual(
      heard.bodies[0].shapes[2],
      [{kind: 'sphere', radius: 0.5, position: [0, 0, 0], orientation: [0, 0, 0, 1]}]);
  lookHome(playback);
  assert.deepEqual(heard.view, {sector: [String(far), String(-far), '0'], sector_size: 128, up: [-0, -0, 1]});
  const frame = last();
  assert.deepEqual(
      [frame.kind, frame.isKey, frame.tick, [...frame.ids]], ['bodies', true, 0, [kBall, kGround]]);
  assert.deepEqual(placeOf(frame, kBall), [1, 0, 10]);
  assert.deepEqual(placeOf(frame, kGround), [0, 0, 0], 'a plane is below the camera');
  assert.deepEqual(
      [frame.speeds[0], frame.asleep[0], ...frame.orientations.subarray(0, 4)], [5, 0, 0, 0, 0, 1]);
  assert.deepEqual(playback.counts, {bodies: 1, awake: 1, statics: 1});
});

test('any tick is reached from any other, with the bodies of that tick', async () => {
  const {playback, heard, last} = await playbackOf(fallingBall(), {chunkSize: 1000});
  lookHome(playback);
  for (const tick of [77, 3, kTicks, 59, kCrateComes, 0]) {
    await playback.seek(tick);
    const frame = last();
    assert.deepEqual([frame.tick, playback.tick, frame.isKey], [tick, tick, true]);
    assert.equal(placeOf(frame, kBall)[2], Math.fround(heightAt(tick)));
    assert.deepEqual(placeOf(frame, kCrate), tick < kCrateComes ? null : [-63, 1, 0]);
    assert.equal(playback.time, tick * kTimeStep);
  }
  await playback.seek(100);
  assert.equal(last().asleep[last().ids.indexOf(kBall)], 1);
  assert.deepEqual([...last().orientations.subarray(4, 8)], [0, 0, 1, 0]);
  await playback.seek(10);
  assert.deepEqual(last().gone, [kCrate]);
  assert.deepEqual(
      heard.bodies.flatMap(({bodies}) => bodies).map(({id}) => id), [kBall, kGround, kCrate], 'once');
  assert.deepEqual(heard.failures, []);
});

test('steps go to recorded ticks', async () => {
  const {playback, last} = await playbackOf(fallingBall({every: 4}), {metadata: {every_ticks: '4'}});
  lookHome(playback);
  await playback.seek(50);
  assert.equal(last().tick, 48);
  await playback.step(1);
  assert.equal(last().tick, 52);
  await playback.step(-1);
  await playback.step(-1);
  assert.equal(last().tick, 44);
  await playback.seek(0);
  await playback.step(-1);
  assert.equal(last().tick, 0);
  await playback.seek(kTicks);
  await playback.step(1);
  assert.equal(last().tick, kTicks);
});

test('plays at its speed to the end, then again from the beginning', async () => {
  const {playback, heard, last} = await playbackOf(fallingBall(), {chunkSize: 3000});
  lookHome(playback);
  const moved = (until) => new Promise((done) => playback.addEventListener('moved', () => until() && done()));
  const go = async (seconds) => {
    const to = playback.tick + Math.round(seconds * playback.speed / kTimeStep);
    const arrived = moved(() => playback.tick >= Math.min(to, kTicks));
    playback.advance(seconds);
    await arrived;
    await new Promise(setImmediate);  // until it waits for more time
  };
  playback.play();
  await go(0.1);
  assert.deepEqual([last().tick, last().isKey], [6, false]);
  playback.speed = 2;
  await go(0.2);
  assert.equal(last().tick, 30);
  playback.speed = 10;
  heard.frames.length = 0;
  const ended = moved(() => !playback.isPlaying);
  await go(0.25);
  await ended;
  assert.deepEqual([last().tick, heard.frames.length], [kTicks, 1], 'intermediate ticks are skipped');
  playback.play();
  await playback.seek(0);
  assert.deepEqual([playback.isPlaying, last().tick], [true, 0]);
});

test('only what is near is visible, and the view moves with the camera', async () => {
  const {playback, heard, last} = await playbackOf(fallingBall());
  lookHome(playback);
  await playback.seek(kTicks);
  lookHome(playback, 20);
  assert.deepEqual([[...last().ids], last().gone, last().isKey], [[kBall, kGround], [kCrate], false]);
  playback.send({type: 'look', sector: [String(far + 1n), String(-far), '0'], local: [-60, 0, 0], half: 100});
  assert.equal(heard.view.sector[0], String(far + 1n));
  assert.deepEqual([last().isKey, placeOf(last(), kBall)], [true, [-127, 0, Math.fround(heightAt(kTicks))]]);
});

test('contacts are those of the tick', async () => {
  const {playback, last} = await playbackOf(fallingBall());
  lookHome(playback);
  playback.send({type: 'contacts', on: true});
  await playback.seek(33);
  const {kind, count, positions, impulses} = last();
  assert.deepEqual([kind, count, impulses[0]], ['contacts', 1, 33]);
  assert.deepEqual([...positions], [1, 0, Math.fround(heightAt(33))]);
});

test('places and bodies are found, and nothing can be changed', async () => {
  const {playback} = await playbackOf(fallingBall());
  await playback.seek(kTicks);
  const sector = [String(far), String(-far), '0'];
  const {places} = await playback.ask('places');
  assert.deepEqual(
      places,
      [{sector, local: [-31, 0.5, heightAt(kTicks) / 2], half: 32, bodies: 2, sectors: 1, name: 'ball'}]);
  for (const body of ['crate', kCrate]) {
    assert.deepEqual(
        await playback.ask('find', {body}), {sector, local: [-63, 1, 0], body: kCrate, name: 'crate'});
  }
  await assert.rejects(playback.ask('find', {body: 'nobody'}), /no body is called "nobody"/);
  await assert.rejects(playback.ask('push', {body: kBall}), /recordings cannot be changed/);
});

test('only the shown part of a large file is read', async () => {
  const messages = fallingBall({ticks: 2400, weight: 10_000});
  const file = await recordingOf(messages, {chunkSize: 10_000});
  const recording = await Recording.open(file);
  const playback = new Playback(recording, () => null);
  await playback.start();
  const before = recording.bytesRead;
  await playback.seek(600);
  const read = [before, recording.bytesRead - before];
  assert.ok(Math.max(...read) < file.size / 4, `${read} of ${file.size} bytes`);
});

test('files that are not recordings are refused, with their name', async () => {
  const refuses = async (file, message) => assert.rejects(Recording.open(await file), {message});
  await refuses(fileOf(), 'test.mcap is not an MCAP file');
  await refuses(fileOf('precious'), 'test.mcap is not an MCAP file');
  const whole = await recordingOf(fallingBall());
  for (const size of [8 + 1, whole.size >> 1, whole.size - 1])
    await refuses(
        fileOf(whole.slice(0, size)), 'test.mcap is truncated and has no index: "mcap recover" adds one');
  const {'/tessera/bodies': bodies, ...others} = kTopics;
  const kNoWorld = 'test.mcap is not a recording of a world';
  await refuses(recordingOf([], {topics: others}), `${kNoWorld}: it has no /tessera/bodies`);
  await refuses(
      recordingOf([], {topics: {...kTopics, '/tessera/contacts': bodies}}),
      `${kNoWorld}: /tessera/contacts has tessera.v1.BodyBatch, not tessera.v1.ContactBatch`);
  await refuses(recordingOf([], {metadata: null}), `${kNoWorld}: it has no metadata named tessera`);
  await refuses(recordingOf([]), `${kNoWorld}: it has no ticks`);
});

test('damage within a recording is reported when it is reached', async () => {
  const whole = new Uint8Array(await (await recordingOf(fallingBall(), {chunkSize: 2000})).arrayBuffer());
  const damaged = whole.slice();
  damaged.fill(0, whole.length >> 1, (whole.length >> 1) + 2000);
  const playback = new Playback(await Recording.open(fileOf(damaged)), () => null);
  const failures = [];
  playback.addEventListener('failed', ({detail}) => failures.push(detail.message));
  await playback.start();
  assert.deepEqual(failures, []);
  for (let tick = 0; tick <= kTicks && failures.length === 0; tick += 5) await playback.seek(tick);
  assert.equal(failures.length, 1);
  await playback.seek(kTicks);
  assert.equal(playback.tick, kTicks, 'the rest can be shown');
  const foot = whole.slice();
  foot.fill(0, whole.length - 200, whole.length - 100);
  await assert.rejects(Recording.open(fileOf(foot)), /^Error: test.mcap is damaged: /);
});
