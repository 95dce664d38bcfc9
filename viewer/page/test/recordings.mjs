// Small recordings, written with Foxglove's own libraries.
import {execFileSync} from 'node:child_process';
import {mkdtempSync, readFileSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {dirname, join} from 'node:path';
import {fileURLToPath} from 'node:url';

import {packages} from './sources.mjs';

const {McapWriter} = packages('@mcap/core');
const {create, createFileRegistry, fromBinary, toBinary} = packages('@bufbuild/protobuf');
const {FileDescriptorSetSchema} = packages('@bufbuild/protobuf/wkt');

function describeMessages() {
  const sources = join(dirname(fileURLToPath(import.meta.url)), '..', '..', '..', 'proto');
  const folder = mkdtempSync(join(tmpdir(), 'tessera-proto-'));
  const output = join(folder, 'tessera.binpb');
  try {
    execFileSync(
        'protoc', ['-I', sources, '--include_imports', `--descriptor_set_out=${output}`, 'tessera.proto']);
    return readFileSync(output);
  } finally {
    rmSync(folder, {recursive: true});
  }
}

const definition = describeMessages();
const registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, definition));

export const kTopics = {
  '/tessera/bodies': 'tessera.v1.BodyBatch',
  '/tessera/static_bodies': 'tessera.v1.BodyBatch',
  '/tessera/contacts': 'tessera.v1.ContactBatch',
  '/tessera/catalogue': 'tessera.v1.FoundBodies',
};
export const kTimeStep = 1 / 60;

// A zstd frame of uncompressed blocks.
function stored(data) {
  const kBlock = 1 << 17;
  const head = Buffer.from([0x28, 0xb5, 0x2f, 0xfd, 0xa0, 0, 0, 0, 0]);
  head.writeUInt32LE(data.length, 5);
  const parts = [head];
  for (let at = 0; at < data.length; at += kBlock) {
    const block = data.subarray(at, at + kBlock);
    const isLast = at + kBlock >= data.length;
    const size = Buffer.alloc(4);
    size.writeUInt32LE(block.length * 8 + isLast);
    parts.push(size.subarray(0, 3), block);
  }
  return Buffer.concat(parts);
}

class Bytes {
  parts = [];
  size = 0n;
  position() { return this.size; }
  async write(part) {
    this.parts.push(part.slice());
    this.size += BigInt(part.length);
  }
}

// A File with these messages, as [tick, topic, content], ascending by tick.
export async function recordingOf(
    messages, {topics = kTopics, metadata = {}, settings = {}, chunkSize = 1 << 16} = {}) {
  const writable = new Bytes();
  const writer = new McapWriter(
      {writable, chunkSize, compressChunk: (data) => ({compression: 'zstd', compressedData: stored(data)})});
  await writer.start({profile: '', library: 'test'});
  const said = {
    world: 'test',
    settings:
        JSON.stringify({sector_size: 128, time_step: kTimeStep, uniform_gravity: {z: -9.81}, ...settings}),
    anchor: '0,0,0',
    sector: '0,0,0',
    every_ticks: '1',
    ...metadata,
  };
  if (metadata !== null) await writer.addMetadata({name: 'tessera', metadata: new Map(Object.entries(said))});
  const channels = {};
  for (const [topic, name] of Object.entries(topics)) {
    const schemaId = await writer.registerSchema({name, encoding: 'protobuf', data: definition});
    channels[topic] =
        await writer.registerChannel({topic, schemaId, messageEncoding: 'protobuf', metadata: new Map()});
  }
  for (const [tick, topic, content] of messages) {
    const time = BigInt(Math.round(tick * kTimeStep * 1e9));
    const type = registry.getMessage(topics[topic]);
    const data = toBinary(type, create(type, content));
    await writer.addMessage(
        {channelId: channels[topic], sequence: tick, logTime: time, publishTime: time, data});
  }
  await writer.end();
  return fileOf(...writable.parts);
}

export const fileOf = (...parts) => Object.assign(new Blob(parts), {name: 'test.mcap'});
