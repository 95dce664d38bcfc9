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

function addSchema(schema) {
  schemas.set(schema.id, {...schema, type: protobufFromBinaryDescriptor(schema.data).lookupType(schema.name)});
}

function add(message) {
  const {topic, messageEncoding, schemaId} = channels.get(message.channelId);
  const {name, encoding, type} = schemas.get(schemaId);
  messages.push({
    topic,
    encoding: `${messageEncoding} ${encoding} ${name}`,
    time: Number(message.logTime),
    sequence: message.sequence,
    data: type.toObject(type.decode(message.data), {longs: String, enums: String, defaults: true}),
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
  reader.schemasById.forEach(addSchema);
  for (const [id, channel] of reader.channelsById) channels.set(id, channel);
  for await (const message of reader.readMessages()) add(message);
  for await (const record of reader.readMetadata()) note(record);
  return {chunks: reader.chunkIndexes.length, count: Number(reader.statistics.messageCount)};
}

function readAsStream() {
  const reader = new McapStreamReader({decompressHandlers, validateCrcs: true});
  reader.append(bytes);
  for (let record; (record = reader.nextRecord());) {
    if (record.type === 'Schema') addSchema(record);
    if (record.type === 'Channel') channels.set(record.id, record);
    if (record.type === 'Message') add(record);
    if (record.type === 'Metadata') note(record);
  }
  return {isWhole: reader.done()};
}

const found = options.includes('--stream') ? readAsStream() : await readByIndex();
process.stdout.write(JSON.stringify({...found, metadata, messages}));
