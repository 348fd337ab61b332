// The WebSocket that lights are sent over and frames come back on.

import { pack, unpack } from './protocol.js';

// Lights without a frame yet: the server relights one while the page draws the frame of another.
const MAXIMUM_LIGHTS_UNDER_WAY = 3;
const SECOND = 1000;
const FIRST_RETRY_MILLISECONDS = 500;
const LAST_RETRY_MILLISECONDS = 8000;
// Close codes of a light that the server refused or failed at: it is not sent again by itself.
const CODES_OF_A_BAD_LIGHT = [1007, 1008, 1009, 1011];

// Sends the newest light as soon as fewer than the maximum are under way; older ones are never queued.
export class Connection {
  #socket;
  #sent = 0;
  #received = 0;
  #changed = true;
  // When lights were sent, by number; when the newest frame was drawn; and what the server is told of it.
  #times = new Map();
  #drawn = 0;
  #measured = { took: null, level: 0 };
  // Seconds from the newest light that has been drawn to its frame.
  #delay = 0;
  #retryDelay = FIRST_RETRY_MILLISECONDS;
  #light;
  #onFrame;
  #onFault;

  // light() gives { sent, colour, split }; onFrame(header, parts, isNewest); onFault(text), '' for none.
  constructor({ light, onFrame, onFault }) {
    this.#light = light;
    this.#onFrame = onFrame;
    this.#onFault = onFault;
    this.#open();
  }

  lightChanged() { this.#changed = true; this.#send(); }

  #open() {
    const url = new URL('relight', location.href);
    url.protocol = url.protocol.replace('http', 'ws');
    url.hash = '';
    this.#socket = new WebSocket(url);
    this.#socket.binaryType = 'arraybuffer';
    this.#socket.onopen = () => { this.#received = this.#sent; this.#send(); };
    this.#socket.onmessage = event => this.#receive(unpack(event.data));
    this.#socket.onclose = event => {
      this.#changed = !CODES_OF_A_BAD_LIGHT.includes(event.code);
      this.#onFault(event.reason || (this.#changed ? 'The server does not answer; trying again.' : 'The server failed at this light.'));
      setTimeout(() => this.#open(), this.#retryDelay);
      this.#retryDelay = Math.min(2 * this.#retryDelay, LAST_RETRY_MILLISECONDS);
    };
  }

  #send() {
    const full = this.#sent - this.#received >= MAXIMUM_LIGHTS_UNDER_WAY;
    if (full || !this.#changed || this.#socket.readyState !== WebSocket.OPEN) return;
    this.#changed = false;
    this.#sent += 1;
    const { sent: { values, shape, block }, colour, split } = this.#light();
    this.#times.set(this.#sent, performance.now());
    this.#socket.send(pack({ number: this.#sent, shape, block, colour, split, ...this.#measured }, values));
  }

  #receive({ header, arrays }) {
    this.#received = Math.max(this.#received, header.number);
    if (this.#retryDelay > FIRST_RETRY_MILLISECONDS) this.#onFault('');
    this.#retryDelay = FIRST_RETRY_MILLISECONDS;
    this.#send();
    this.#onFrame({ ...header, delay: this.#delay }, arrays[0], header.number === this.#sent && !this.#changed);
    this.#measure(header);
  }

  // How long the frame took from its light to the screen; of a light at rest only the first frame tells.
  #measure({ number, level }) {
    const sent = this.#times.get(number), now = performance.now();
    if (sent !== undefined) {
      this.#measured = { took: (now - Math.max(sent, this.#drawn)) / SECOND, level };
      this.#delay = (now - sent) / SECOND;
      // For those who drive the page by a program.
      document.body.dataset.delay = this.#delay.toFixed(4);
    }
    for (const older of this.#times.keys()) if (older <= number) this.#times.delete(older);
    this.#drawn = now;
  }
}
