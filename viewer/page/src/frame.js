// Decodes binary frames of tessera-viewer; viewer/frame_encoder.h describes their layout.

const kHeaderBytes = 24;
const kKeyFrame = 1;

// The bits of each body as arrays.
const flags = (bits) => ({asleep: bits.map((set) => set & 1), aboard: bits.map((set) => set >> 1 & 1)});

export function decode(buffer) {
  const header = new DataView(buffer);
  const count = header.getUint32(8, true);
  const gone = header.getUint32(12, true);
  const tick = Number(header.getBigUint64(16, true));
  let place = kHeaderBytes;
  const array = (Type, length) => {
    const view = new Type(buffer, place, length);
    place += view.byteLength;
    return view;
  };
  if (header.getUint32(0, true) === 2) {
    return {
      kind: 'contacts',
      tick,
      count,
      positions: array(Float32Array, 3 * count),
      normals: array(Float32Array, 3 * count),
      impulses: array(Float32Array, count),
    };
  }
  return {
    kind: 'bodies',
    tick,
    count,
    isKey: (header.getUint32(4, true) & kKeyFrame) !== 0,
    ids: array(Float64Array, count),
    gone: array(Float64Array, gone),
    positions: array(Float32Array, 3 * count),
    orientations: array(Float32Array, 4 * count),
    speeds: array(Float32Array, count),
    servers: array(Uint8Array, count),
    ...flags(array(Uint8Array, count)),
  };
}
