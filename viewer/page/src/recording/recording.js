// A recording of tessera-record: an MCAP file, of which only the requested data is read.
import {createFileRegistry, fromBinary, fromJsonString} from '@bufbuild/protobuf';
import {FileDescriptorSetSchema} from '@bufbuild/protobuf/wkt';
import {hasMcapPrefix, MCAP_MAGIC, McapIndexedReader} from '@mcap/core';
import {ZSTDDecoder} from 'zstddec';

import {BodyStates} from './body_states.js';
import {bodyOf, partsOf} from './words.js';

export const kBodies = '/tessera/bodies';
export const kStatics = '/tessera/static_bodies';
export const kContacts = '/tessera/contacts';
const kCatalogue = '/tessera/catalogue';

const kTypes = {
  [kBodies]: 'tessera.v1.BodyBatch',
  [kStatics]: 'tessera.v1.BodyBatch',
  [kContacts]: 'tessera.v1.ContactBatch',
  [kCatalogue]: 'tessera.v1.FoundBodies',
};
const kMetadata = 'tessera';

// Adapts a file to the reader's interface and counts the bytes read.
class ReadableBlob {
  constructor(blob) {
    this.blob = blob;
    this.bytes = 0;
  }
  async size() { return BigInt(this.blob.size); }
  async read(offset, size) {
    this.bytes += Number(size);
    return new Uint8Array(await this.blob.slice(Number(offset), Number(offset + size)).arrayBuffer());
  }
  async hasMagic(offset) {
    const bytes = await this.blob.slice(offset, offset + MCAP_MAGIC.length).arrayBuffer();
    return hasMcapPrefix(new DataView(bytes));
  }
}

async function readerOf(file) {
  const readable = new ReadableBlob(file);
  if (!await readable.hasMagic(0)) throw new Error(`${file.name} is not an MCAP file`);
  if (!await readable.hasMagic(Math.max(0, file.size - MCAP_MAGIC.length)))
    throw new Error(`${file.name} is truncated and has no index: "mcap recover" adds one`);
  const decoder = new ZSTDDecoder();
  await decoder.init();
  try {
    const reader = await McapIndexedReader.Initialize({
      readable,
      decompressHandlers: {zstd: (bytes, size) => decoder.decode(bytes, Number(size))},
    });
    return {reader, readable};
  } catch (error) {
    throw new Error(`${file.name} is damaged: ${error.message}`);
  }
}

// The types of the messages of each topic, and that of the settings; an Error if a required one differs.
function typesOf(reader) {
  const channels = [...reader.channelsById.values()];
  const types = {};
  for (const [topic, name] of Object.entries(kTypes)) {
    const channel = channels.find((one) => one.topic === topic);
    const schema = channel && reader.schemasById.get(channel.schemaId);
    if (!schema) throw new Error(`it has no ${topic}`);
    if (schema.encoding !== 'protobuf' || schema.name !== name)
      throw new Error(`${topic} has ${schema.name}, not ${name}`);
    const registry = createFileRegistry(fromBinary(FileDescriptorSetSchema, schema.data));
    types[topic] = registry.getMessage(name);
    types.settings = registry.getMessage('tessera.v1.WorldSettings');
  }
  return types;
}

async function metadataOf(reader) {
  for await (const {metadata} of reader.readMetadata({name: kMetadata})) return metadata;
  throw new Error(`it has no metadata named ${kMetadata}`);
}

export class Recording {
  #reader;
  #readable;
  #types;
  #unnamed = new Set();  // bodies that were not found

  // `file` is a File, or a Blob with a name. An Error with its name and the reason if it is not a recording,
  // is truncated, or has other contents.
  static async open(file) {
    const {reader, readable} = await readerOf(file);
    const recording = new Recording();
    recording.file = file;
    recording.#reader = reader;
    recording.#readable = readable;
    try {
      await recording.#begin();
    } catch (error) {
      throw new Error(`${file.name} is not a recording of a world: ${error.message}`);
    }
    return recording;
  }

  async #begin() {
    this.#types = typesOf(this.#reader);
    const said = await metadataOf(this.#reader);
    this.world = said.get('world');
    this.everyTicks = Number(said.get('every_ticks'));
    this.settings = fromJsonString(this.#types.settings, said.get('settings'), {ignoreUnknownFields: true});
    this.bodies = new Map();  // the requested ones, by id
    this.shapes = new Map();  // and their shapes: parts by id
    const topics = [kBodies];
    const first = await this.#one({topics});
    if (!first) throw new Error('it has no ticks');
    this.first = first.tick;
    this.last = (await this.#one({topics, reverse: true})).tick;
  }

  get sectorSize() { return this.settings.sectorSize; }  // m
  get bytesRead() { return this.#readable.bytes; }
  timeOf(tick) { return tick * this.settings.timeStep; }  // s

  // The messages of these topics after a tick, as {topic, tick, data}, ascending.
  async * after(tick, topics) { yield* this.#messages({topics, startTime: this.#nanoseconds(tick + 0.5)}); }

  // The last message of a topic at or before a tick; undefined if there is none.
  lastAt(topic, tick) {
    return this.#one({topics: [topic], endTime: this.#nanoseconds(tick + 0.5), reverse: true});
  }

  // The recorded tick next to one; undefined at the end.
  async nextTick(tick) {
    return (await this.#one({topics: [kBodies], startTime: this.#nanoseconds(tick + 0.5)}))?.tick;
  }

  // Decodes a message: the states of bodies, or a protobuf object.
  read({topic, data}) {
    if (topic === kBodies || topic === kStatics) return BodyStates.decode(data);
    return fromBinary(this.#types[topic], data);
  }

  // Reads names, properties and shapes of the bodies at a tick.
  async learn(ids, tick) {
    const missing = new Set(ids.filter((id) => !this.bodies.has(id) && !this.#unnamed.has(id)));
    if (missing.size === 0) return;
    const endTime = this.#nanoseconds(tick + 0.5);
    for await (const message of this.#messages({topics: [kCatalogue], endTime, reverse: true})) {
      const {bodies, shapes} = this.read(message);
      for (const [id, shape] of Object.entries(shapes)) this.shapes.set(Number(id), partsOf(shape));
      for (const body of bodies.map(bodyOf)) {
        this.bodies.set(body.id, body);
        missing.delete(body.id);
      }
      if (missing.size === 0) return;
    }
    for (const id of missing) this.#unnamed.add(id);
  }

  async #one(range) {
    for await (const message of this.#messages(range)) return message;
    return undefined;
  }

  async * #messages(range) {
    for await (const {channelId, logTime, data} of this.#reader.readMessages(range)) {
      const {topic} = this.#reader.channelsById.get(channelId);
      yield {topic, tick: Math.round(Number(logTime) / (1e9 * this.settings.timeStep)), data};
    }
  }

  #nanoseconds(tick) { return BigInt(Math.max(0, Math.round(tick * this.settings.timeStep * 1e9))); }
}
