// Films of the keyframes: the server relights each picture exactly, and puts them into a file.

import { lightAt, pictureCountOf } from './between-lights.js';
import { get, set, showFault } from './dom.js';
import { sceneName } from './file-names.js';
import { pack } from './protocol.js';
import { download, namedGains } from './saving.js';
import { CHANNELS } from './state.js';

const MAXIMUM_NAME_CHARACTERS = 120;
const TYPES = { pictures: ['application/zip', 'zip'], mp4: ['video/mp4', 'mp4'] };

export class Film {
  #page;
  #socket = null;

  constructor(page) {
    this.#page = page;
    get('film-pictures').onclick = () => this.#make('pictures');
    get('film-mp4').onclick = () => this.#make('mp4');
    get('film-cancel').onclick = () => this.#end('');
    this.#end('');
  }

  // One light is sent after the picture of the one before is done.
  #make(format) {
    if (this.#socket) return;
    showFault('', 'film');
    const { store: { state }, scenePictures: { split }, scene } = this.#page, light = this.#page.light.another(), count = pictureCountOf(state);
    const { exposure, metering, gamma, rate, seconds, keyframes, pictures, channel } = state, gains = namedGains(state, split);
    const url = new URL('film', location.href);
    Object.assign(url, { protocol: url.protocol.replace('http', 'ws'), hash: '' });
    const socket = this.#socket = new WebSocket(url), name = `${sceneName(scene)}-${keyframes.length}-keyframes`;
    socket.binaryType = 'arraybuffer';
    const send = number => {
      this.#say(`picture ${number + 1} of ${count}`);
      light.draw({ ...lightAt(keyframes, seconds, number / rate), pictures });
      const { sent: { values, shape }, colour } = light;
      socket.send(pack({ number, shape, colour, split, gains }, values));
    };
    const header = JSON.stringify({ format, name: name.slice(-MAXIMUM_NAME_CHARACTERS).replaceAll(/[^\w.-]/g, '-'), rate, count, split, metering, exposure, gamma, channel: channel ? CHANNELS.indexOf(channel) - 1 : null });
    socket.onopen = () => {
      socket.send(header);
      send(0);
    };
    socket.onmessage = ({ data }) => {
      if (typeof data === 'string') {
        const { done, fault } = JSON.parse(data);
        if (fault) {
          showFault(fault, 'film');
          this.#end('');
        } else if (done < count) send(done); else this.#say('putting the film together');
        return;
      }
      const [type, ending] = TYPES[format];
      download(new Blob([data], { type }), `${name}.${ending}`);
      this.#end(format === 'mp4' ? `film of ${count} pictures saved` : `${count} pictures saved`);
    };
    socket.onclose = ({ reason }) => {
      if (this.#socket !== socket) return;
      showFault(reason || 'The server does not answer.', 'film');
      this.#end('');
    };
    this.#show();
  }

  #end(text) {
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
    this.#say(text);
    this.#show();
  }

  #show() { get('film-cancel').hidden = !this.#socket; }

  #say(text) { set(get('film-status'), 'textContent', text); }
}
