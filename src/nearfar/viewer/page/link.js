// What the page and its server send each other; src/nearfar/viewer/messages.py tells the format.

const TYPES = { float32: Float32Array, float16: Uint16Array, uint16: Uint16Array, uint8: Uint8Array };

export function pack(words, levels) {
  const text = new TextEncoder().encode(JSON.stringify(words));
  const padding = (8 - (4 + text.length) % 8) % 8;
  const message = new Uint8Array(4 + text.length + padding + levels.byteLength);
  new DataView(message.buffer).setUint32(0, text.length + padding, true);
  message.set(text, 4);
  message.fill(32, 4 + text.length, 4 + text.length + padding);
  message.set(new Uint8Array(levels.buffer, levels.byteOffset, levels.byteLength), 4 + text.length + padding);
  return message;
}

// float16 comes as its 16 bits, which picture.js looks up.
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const words = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  let at = 4 + length;
  const arrays = words.arrays.map(({ type, shape }) => {
    const count = shape.reduce((a, b) => a * b, 1);
    const data = new TYPES[type](buffer, at, count);
    at += Math.ceil(data.byteLength / 8) * 8;
    return { shape, data };
  });
  return { words, arrays };
}

export async function ask(path, options) {
  let answer;
  try { answer = await fetch(path, options); } catch { throw new Error('The server does not answer.'); }
  if (answer.ok) return answer;
  let fault = answer.statusText;
  try { fault = (await answer.json()).fault || fault; } catch { /* no words came */ }
  throw new Error(fault);
}

export const askPacked = async (path, options) => unpack(await (await ask(path, options)).arrayBuffer());

// Lights that are under way at once: the server works at one while the page draws another.
const AHEAD = 3;

// Sends the newest light as soon as there is room for it, so that none ever queues.
export class Link {
  constructor(draw, shown, told) {
    Object.assign(this, { draw, shown, told, number: 0, answered: 0, changed: true, wait: 500 });
    this.open();
  }

  open() {
    const url = new URL('relight', location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    url.hash = '';
    this.socket = new WebSocket(url);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onopen = () => { this.answered = this.number; this.send(); };
    this.socket.onmessage = event => this.take(unpack(event.data));
    this.socket.onclose = event => {
      // What the server refused or failed at is not sent again by itself.
      this.changed = ![1007, 1008, 1009, 1011].includes(event.code);
      this.told(event.reason || (this.changed ? 'The server does not answer; trying again.' : 'The server failed at this light.'));
      setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, 8000);
    };
  }

  change() { this.changed = true; this.send(); }

  send() {
    const full = this.number - this.answered >= AHEAD;
    if (full || !this.changed || this.socket.readyState !== WebSocket.OPEN) return;
    this.changed = false;
    const { levels, shape, colour } = this.draw();
    this.socket.send(pack({ number: ++this.number, shape, colour }, levels));
  }

  take({ words, arrays }) {
    this.answered = Math.max(this.answered, words.number);
    if (this.wait > 500) this.told('');
    this.wait = 500;
    this.send();
    this.shown(words, arrays[0], words.number === this.number && !this.changed);
  }
}
