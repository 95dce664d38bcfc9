// The body states of a recording (tessera.v1.BodyBatch), decoded into arrays: with thousands of them in every
// tick, one object for each nested message would take most of the time.
import {BinaryReader} from '@bufbuild/protobuf/wire';

// Calls `take(field)` for each field of the message that ends at `end`; skips those for which it returns false.
function readUntil(end, reader, take) {
  while (reader.pos < end) {
    const [field, type] = reader.tag();
    if (!take(field)) reader.skip(type, field);
  }
}

const readMessage = (reader, take) => readUntil(reader.uint32() + reader.pos, reader, take);

// A message whose fields are the numbers of a vector.
function readVector(reader, values, at, width, readNumber) {
  readMessage(reader, (field) => {
    if (field > width) return false;
    values[at + field - 1] = readNumber.call(reader);
    return true;
  });
}

function countBodies(data) {
  const reader = new BinaryReader(data);
  let count = 0;
  readUntil(reader.len, reader, (field) => {
    count += field === 3;
    return false;
  });
  return count;
}

export class BodyStates {
  constructor(count) {
    this.tick = 0;
    this.count = count;
    this.ids = new Float64Array(count);
    this.sectors = new BigInt64Array(3 * count);
    this.locals = new Float64Array(3 * count);        // m
    this.orientations = new Float32Array(4 * count);  // x y z w
    this.speeds = new Float32Array(count);            // of the centre of mass, m/s
    this.asleep = new Uint8Array(count);
  }

  // An Error if the bytes are not such a message.
  static decode(data) {
    const states = new BodyStates(countBodies(data));
    const reader = new BinaryReader(data);
    let n = 0;
    readUntil(reader.len, reader, (field) => {
      if (field === 1)
        states.tick = Number(reader.uint64());
      else if (field === 3)
        states.#readBody(reader, n++);
      else
        return false;
      return true;
    });
    return states;
  }

  positionOf(n) {
    return {
      sector: [...this.sectors.subarray(3 * n, 3 * n + 3)],
      local: [...this.locals.subarray(3 * n, 3 * n + 3)],
    };
  }

  #readBody(reader, n) {
    const velocity = [0, 0, 0];
    this.orientations[4 * n + 3] = 1;
    readMessage(reader, (field) => {
      if (field === 1)
        this.ids[n] = Number(reader.uint64());
      else if (field === 2)
        this.#readPose(reader, n);
      else if (field === 3)
        readVector(reader, velocity, 0, 3, reader.double);
      else if (field === 5)
        this.asleep[n] = reader.bool();
      else
        return false;
      return true;
    });
    this.speeds[n] = Math.hypot(...velocity);
  }

  #readPose(reader, n) {
    readMessage(reader, (field) => {
      if (field === 1) {
        this.#readPosition(reader, n);
      } else if (field === 2) {
        this.orientations[4 * n + 3] = 0;  // protobuf omits zeros
        readVector(reader, this.orientations, 4 * n, 4, reader.double);
      } else {
        return false;
      }
      return true;
    });
  }

  #readPosition(reader, n) {
    readMessage(reader, (field) => {
      if (field === 1)
        readVector(reader, this.sectors, 3 * n, 3, reader.sfixed64);
      else if (field === 2)
        readVector(reader, this.locals, 3 * n, 3, reader.double);
      else
        return false;
      return true;
    });
  }
}
