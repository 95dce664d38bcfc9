// An animated WebP of still ones, as a browser encodes them: the container format of Google's specification.

const kAnimated = 2;
const kBlendNothing = 2;  // each frame replaces the one before
const kHeaderBytes = 12;  // "RIFF", size, "WEBP"

function chunk(name, payload) {
  const head = Buffer.alloc(8);
  head.write(name, 'latin1');
  head.writeUInt32LE(payload.length, 4);
  return Buffer.concat([head, payload, Buffer.alloc(payload.length % 2)]);
}

function threeBytes(...numbers) {
  const bytes = Buffer.alloc(3 * numbers.length);
  numbers.forEach((number, n) => bytes.writeUIntLE(number, 3 * n, 3));
  return bytes;
}

// The chunk with the picture of a still WebP, lossy and without transparency.
function pictureOf(still) {
  for (let at = kHeaderBytes; at + 8 <= still.length;) {
    const size = still.readUInt32LE(at + 4);
    if (still.toString('latin1', at, at + 4) === 'VP8 ') return chunk('VP8 ', still.subarray(at + 8, at + 8 + size));
    at += 8 + size + size % 2;
  }
  throw new Error('a frame is no lossy WebP');
}

// `stills` are files of width x height pixels, each shown for `frameMs`, over and over.
export function animated(stills, width, height, frameMs) {
  const canvas = Buffer.concat([Buffer.from([kAnimated, 0, 0, 0]), threeBytes(width - 1, height - 1)]);
  const frames = stills.map((still) => chunk('ANMF', Buffer.concat([
    threeBytes(0, 0, width - 1, height - 1, frameMs), Buffer.from([kBlendNothing]), pictureOf(still),
  ])));
  const body = Buffer.concat([Buffer.from('WEBP'), chunk('VP8X', canvas), chunk('ANIM', Buffer.alloc(6)), ...frames]);
  return chunk('RIFF', body);
}
