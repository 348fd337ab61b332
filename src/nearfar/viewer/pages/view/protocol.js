// Requests to the server, and the binary messages of src/nearfar/viewer/messages.py.

const ARRAY_TYPES = { float32: Float32Array, float16: Uint16Array, uint16: Uint16Array, uint8: Uint8Array };
const ALIGNMENT = 8;
const LENGTH_BYTES = 4;

// A message of a JSON header and the levels of a light.
export function pack(header, levels) {
  const text = new TextEncoder().encode(JSON.stringify(header));
  const padding = (ALIGNMENT - (LENGTH_BYTES + text.length) % ALIGNMENT) % ALIGNMENT;
  const headerEnd = LENGTH_BYTES + text.length + padding;
  const message = new Uint8Array(headerEnd + levels.byteLength);
  new DataView(message.buffer).setUint32(0, text.length + padding, true);
  message.set(text, LENGTH_BYTES);
  message.fill(' '.charCodeAt(0), LENGTH_BYTES + text.length, headerEnd);
  message.set(new Uint8Array(levels.buffer, levels.byteOffset, levels.byteLength), headerEnd);
  return message;
}

// The header and the arrays of a message. float16 stays as its 16 bits: picture.js has their values.
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, LENGTH_BYTES, length)));
  let offset = LENGTH_BYTES + length;
  const arrays = header.arrays.map(({ type, shape }) => {
    const count = shape.reduce((a, b) => a * b, 1);
    const data = new ARRAY_TYPES[type](buffer, offset, count);
    offset += Math.ceil(data.byteLength / ALIGNMENT) * ALIGNMENT;
    return { shape, data };
  });
  return { header, arrays };
}

export async function request(path, options) {
  let response;
  try { response = await fetch(path, options); } catch { throw new Error('The server does not answer.'); }
  if (response.ok) return response;
  let fault = response.statusText;
  try { fault = (await response.json()).fault || fault; } catch { /* the response is not JSON */ }
  throw new Error(fault);
}

export const requestMessage = async (path, options) => unpack(await (await request(path, options)).arrayBuffer());
