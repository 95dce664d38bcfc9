// Prints a recording as JSON, read by the libraries that Foxglove reads it with: messages are found by the
// index, or, with --stream, from front to end, which needs neither index nor end.
//
//   node read.mjs FILE [--stream]
import {readFile} from 'node:fs/promises';
import {createRequire} from 'node:module';

const packages = createRequire(`${process.env.TESSERA_MCAP_PACKAGES}/`);
const {McapIndexedReader, McapStreamReader} = packages('@mcap/core');
const {loadDecompressHandlers, protobufFromBinaryDescriptor} = packages('@mcap/support');

const [file, ...options] = process.argv.slice(2);
const bytes = new Uint8Array(await readFile(file));
const decompressHandlers = await loadDecompressHandlers();

const schemas = new Map();
const channels = new Map();
const messages = [];
const metadata = {};

function decode({name, data}, message) {
  const type = protobufFromBinaryDescriptor(data).lookupType(name);
  return type.toObject(type.decode(message), {longs: String, enums: String, defaults: true});
}

function add(message) {
  const {topic, messageEncoding, schemaId} = channels.get(message.channelId);
  const schema = schemas.get(schemaId);
  messages.push({
    topic,
    encoding: `${messageEncoding} ${schema.encoding} ${schema.name}`,
    time: Number(message.logTime),
    sequence: message.sequence,
    data: decode(schema, message.data),
  });
}

function note(record) {
  metadata[record.name] = Object.fromEntries(record.metadata);
}

async function readByIndex() {
  const reader = await McapIndexedReader.Initialize({
    decompressHandlers,
    readable: {
      size: async () => BigInt(bytes.length),
      read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
    },
  });
  for (const [id, schema] of reader.schemasById) schemas.set(id, schema);
  for (const [id, channel] of reader.channelsById) channels.set(id, channel);
  for await (const message of reader.readMessages()) add(message);
  for await (const record of reader.readMetadata()) note(record);
  return {chunks: reader.chunkIndexes.length, count: Number(reader.statistics.messageCount)};
}

function readAsStream() {
  const reader = new McapStreamReader({decompressHandlers, validateCrcs: true});
  reader.append(bytes);
  for (let record; (record = reader.nextRecord());) {
    if (record.type === 'Schema') schemas.set(record.id, record);
    if (record.type === 'Channel') channels.set(record.id, record);
    if (record.type === 'Message') add(record);
    if (record.type === 'Metadata') note(record);
  }
  return {isWhole: reader.done()};
}

const found = options.includes('--stream') ? readAsStream() : await readByIndex();
process.stdout.write(JSON.stringify({...found, metadata, messages}));
