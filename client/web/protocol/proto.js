// Encodes and decodes messages of heliograph.v1 by the tables of /protocol.json, which the daemon makes from its
// descriptors. A message is an object with the names of its .proto. Unknown fields are skipped; scalars that are absent
// read as their zero, fields of a oneof (and optional ones) as undefined. Bytes are views of the message that came.

const DOUBLE = 1,
  FLOAT = 2,
  INT64 = 3,
  UINT64 = 4,
  INT32 = 5,
  FIXED64 = 6,
  FIXED32 = 7,
  BOOL = 8,
  STRING = 9;
const MESSAGE = 11,
  BYTES = 12,
  UINT32 = 13,
  ENUM = 14,
  SFIXED32 = 15,
  SFIXED64 = 16,
  SINT32 = 17,
  SINT64 = 18;

const WIRE = new Map([
  [DOUBLE, 1],
  [FIXED64, 1],
  [SFIXED64, 1],
  [FLOAT, 5],
  [FIXED32, 5],
  [SFIXED32, 5],
  [STRING, 2],
  [BYTES, 2],
  [MESSAGE, 2],
]);
const wireOf = (type) => WIRE.get(type) ?? 0;
const NOTHING = Object.freeze([]);
const text = new TextDecoder();
const utf8 = new TextEncoder();

function zeroOf(type) {
  return type === STRING ? '' : type === BOOL ? false : type === BYTES ? new Uint8Array(0) : 0;
}

class Writer {
  constructor() {
    this.bytes = new Uint8Array(1024);
    this.view = new DataView(this.bytes.buffer);
    this.at = 0;
  }

  room(bytes) {
    if (this.at + bytes <= this.bytes.length) return;
    const grown = new Uint8Array(Math.max(this.bytes.length * 2, this.at + bytes));
    grown.set(this.bytes.subarray(0, this.at));
    this.bytes = grown;
    this.view = new DataView(grown.buffer);
  }

  varint(value) {
    this.room(10);
    if (typeof value === 'number' && value >= 0 && value <= Number.MAX_SAFE_INTEGER) {
      while (value > 127) {
        this.bytes[this.at++] = (value % 128) | 128;
        value = Math.floor(value / 128);
      }
      this.bytes[this.at++] = value;
      return;
    }
    let big = BigInt.asUintN(64, BigInt(value));
    while (big > 127n) {
      this.bytes[this.at++] = Number(big & 127n) | 128;
      big >>= 7n;
    }
    this.bytes[this.at++] = Number(big);
  }

  raw(bytes) {
    this.varint(bytes.length);
    this.room(bytes.length);
    this.bytes.set(bytes, this.at);
    this.at += bytes.length;
  }

  // What `body` writes, behind its length.
  delimited(body) {
    const start = this.at;
    body();
    const length = this.at - start;
    let prefix = 1;
    while (length >= 128 ** prefix) prefix++;
    this.room(prefix);
    this.bytes.copyWithin(start + prefix, start, this.at);
    this.at = start;
    this.varint(length);
    this.at += length;
  }

  scalar(type, value) {
    this.room(10);
    switch (type) {
      case DOUBLE:
        this.view.setFloat64(this.at, value, true);
        this.at += 8;
        break;
      case FLOAT:
        this.view.setFloat32(this.at, value, true);
        this.at += 4;
        break;
      case FIXED32:
      case SFIXED32:
        this.view.setUint32(this.at, value, true);
        this.at += 4;
        break;
      case FIXED64:
      case SFIXED64:
        this.view.setBigUint64(this.at, BigInt.asUintN(64, BigInt(value)), true);
        this.at += 8;
        break;
      case BOOL:
        this.varint(value ? 1 : 0);
        break;
      case STRING:
        this.raw(utf8.encode(value));
        break;
      case BYTES:
        this.raw(value);
        break;
      case SINT32:
      case SINT64: {
        const big = BigInt(value);
        this.varint(big < 0n ? -2n * big - 1n : 2n * big);
        break;
      }
      default:
        this.varint(value);
    }
  }
}

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }

  // As a Number where it is exact, else as a BigInt.
  varint() {
    let value = 0,
      scale = 1;
    for (let i = 0; i < 7; i++) {
      const byte = this.byte();
      value += (byte & 127) * scale;
      if (byte < 128) return value;
      scale *= 128;
    }
    let big = BigInt(value),
      shift = 49n;
    for (let i = 7; i < 10; i++) {
      const byte = this.byte();
      big |= BigInt(byte & 127) << shift;
      if (byte < 128) return big <= BigInt(Number.MAX_SAFE_INTEGER) ? Number(big) : BigInt.asUintN(64, big);
      shift += 7n;
    }
    throw new Error('a varint of more than ten bytes');
  }

  byte() {
    if (this.at >= this.bytes.length) throw new Error('a message that ends too early');
    return this.bytes[this.at++];
  }

  take(length) {
    if (this.at + length > this.bytes.length) throw new Error('a message that ends too early');
    const start = this.at;
    this.at += length;
    return this.bytes.subarray(start, this.at);
  }

  scalar(type) {
    const start = this.at;
    switch (type) {
      case DOUBLE:
        this.take(8);
        return this.view.getFloat64(start, true);
      case FLOAT:
        this.take(4);
        return this.view.getFloat32(start, true);
      case FIXED32:
        this.take(4);
        return this.view.getUint32(start, true);
      case SFIXED32:
        this.take(4);
        return this.view.getInt32(start, true);
      case FIXED64:
        this.take(8);
        return narrow(this.view.getBigUint64(start, true));
      case SFIXED64:
        this.take(8);
        return narrow(this.view.getBigInt64(start, true));
      case BOOL:
        return Number(this.varint()) !== 0;
      case STRING:
        return text.decode(this.take(this.varint()));
      case BYTES:
        return this.take(this.varint());
      case INT32:
      case ENUM:
        return Number(BigInt.asIntN(32, BigInt(this.varint())));
      case INT64:
        return narrow(BigInt.asIntN(64, BigInt(this.varint())));
      case SINT32:
      case SINT64: {
        const big = BigInt(this.varint());
        return narrow(big & 1n ? -((big + 1n) >> 1n) : big >> 1n);
      }
      default:
        return this.varint();
    }
  }

  skip(wire) {
    if (wire === 0) this.varint();
    else if (wire === 1) this.take(8);
    else if (wire === 2) this.take(this.varint());
    else if (wire === 5) this.take(4);
    else throw new Error(`wire type ${wire}`);
  }
}

function narrow(big) {
  const number = Number(big);
  return Number.isSafeInteger(number) ? number : big;
}

export class Codec {
  constructor(tables) {
    this.enums = tables.enums;
    this.messages = new Map();
    for (const [name, rows] of Object.entries(tables.messages)) {
      const fields = rows.map(([number, field, type, repeated, of, oneof]) => ({
        number,
        name: field,
        type,
        repeated: !!repeated,
        of,
        oneof,
        wire: wireOf(type),
      }));
      const zeros = {};
      for (const field of fields) {
        if (field.repeated) zeros[field.name] = NOTHING;
        else if (!field.oneof && field.type !== MESSAGE) zeros[field.name] = zeroOf(field.type);
      }
      this.messages.set(name, { fields, byNumber: new Map(fields.map((f) => [f.number, f])), zeros });
    }
  }

  // Numbers of an enum by name: codec.enum('Mode').MODE_PT.
  enum(name) {
    return this.enums[`heliograph.v1.${name}`] ?? {};
  }

  nameOf(name, number) {
    return Object.entries(this.enum(name)).find(([, value]) => value === number)?.[0] ?? `${number}`;
  }

  encode(name, message) {
    const writer = new Writer();
    this.#write(writer, this.messages.get(name), message);
    return writer.bytes.subarray(0, writer.at);
  }

  decode(name, bytes) {
    return this.#read(this.messages.get(name), bytes);
  }

  #write(writer, type, message) {
    for (const field of type.fields) {
      const value = Object.hasOwn(message, field.name) ? message[field.name] : undefined;
      if (value === undefined || value === null) continue;
      if (field.repeated && field.wire !== 2) {
        if (!value.length) continue;
        writer.varint(field.number * 8 + 2);
        writer.delimited(() => value.forEach((item) => writer.scalar(field.type, item)));
      } else {
        for (const item of field.repeated ? value : [value]) this.#writeOne(writer, field, item);
      }
    }
  }

  #writeOne(writer, field, value) {
    if (field.type !== MESSAGE && !field.repeated && !field.oneof && !value && !Object.is(value, -0)) return;
    writer.varint(field.number * 8 + field.wire);
    if (field.type === MESSAGE) {
      writer.delimited(() => this.#write(writer, this.messages.get(field.of), value));
    } else {
      writer.scalar(field.type, value);
    }
  }

  #read(type, bytes) {
    const message = Object.create(type.zeros);
    const reader = new Reader(bytes);
    while (reader.at < bytes.length) {
      const key = reader.varint();
      const wire = key % 8;
      const field = type.byNumber.get((key - wire) / 8);
      const packed = field?.repeated && wire === 2 && field.wire !== 2;
      if (!field || (wire !== field.wire && !packed)) {
        reader.skip(wire);
        continue;
      }
      if (field.repeated && !Object.hasOwn(message, field.name)) message[field.name] = [];
      if (packed) {
        const inner = new Reader(reader.take(reader.varint()));
        while (inner.at < inner.bytes.length) message[field.name].push(inner.scalar(field.type));
        continue;
      }
      const value =
        field.type === MESSAGE
          ? this.#read(this.messages.get(field.of), reader.take(reader.varint()))
          : reader.scalar(field.type);
      if (field.repeated) message[field.name].push(value);
      else message[field.name] = value;
    }
    return message;
  }
}
