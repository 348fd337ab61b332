// The light under which the scene looks like a wanted picture; it becomes the light of the page.

import { BackgroundJob } from './background.js';
import { WHITE_LEVEL } from './colour.js';
import { get, set } from './dom.js';
import { isLinear, readByServer, showingFaultsOf } from './files.js';
import { levelsOfPicture } from './light.js';
import { exposureFor, pictureOf } from './picture.js';
import { pack, requestMessage } from './protocol.js';
import { Strip } from './strip.js';

const DARK = 0.25;
// A map is not exposed.
const AS_IT_IS = { exposure: 0, gamma: 1 };

export class Compensation {
  #page;
  #job;
  #strip = new Strip();
  // Which of the pictures of the strip is shown in place of the scene; '' for none.
  #shown = '';

  constructor(page) {
    this.#page = page;
    this.#job = new BackgroundJob(text => set(get('tool-status'), 'textContent',
      text === 'computing' ? 'Looking for the light. This takes as long as some hundred pictures.' : text));
    get('wanted').onchange = async event => {
      await this.want(event.target.files[0]);
      event.target.value = '';
    };
  }

  close() {
    this.#job.cancel();
    this.#strip.show([]);
    this.#shown = '';
  }

  label() { return this.#shown; }

  show(state) { this.#strip.draw(state); }

  // The light was changed by hand, or by the one that was found.
  lightChanged() { this.#choose(''); }

  // Takes a file for what the scene is to look like.
  async want(file) { if (file) await showingFaultsOf(file, () => this.#want(file)); }

  async #want(file) {
    const { scene: { camera: [height, width] } } = this.#page;
    const levels = await isLinear(file) ? (await readByServer('wanted', file)).arrays[0].data : await this.#levelsOf(file, width, height);
    this.#job.ask([signal => this.#find({ levels, height, width }, signal)]);
  }

  async #levelsOf(file, width, height) {
    try { return (await levelsOfPicture(file, width, height)).levels; } catch { throw new Error(`${file.name} is no picture that the browser knows.`); }
  }

  async #find({ levels, height, width }, signal) {
    const body = pack({ shape: [height, width, 3], colour: [1, 1, 1] }, levels);
    const { header, arrays: [found, expected, far] } = await requestMessage('tool/compensation', { method: 'POST', body, signal });
    const { store, light, scenePictures } = this.#page, { said } = header;
    const pictures = [...store.state.pictures, light.addLinear(found.data)];
    const wanted = { height, width, colours: 3, values: Float32Array.from(levels, level => said.scale * level / WHITE_LEVEL) };
    const picture = pictureOf(expected, header.scale);
    scenePictures.compareWith(wanted, 'wanted');
    store.update({ kind: 'picture', shown: pictures.length - 1, pictures, wipe: 50, exposure: exposureFor(wanted) });
    const share = (100 * said.out_of_reach_share).toFixed(1);
    this.#strip.show([
      this.#item('wanted', '', wanted), this.#item('expected', errorOf(said), picture),
      this.#item('out of reach', `${share} % of the camera pixels`, marked(picture, far.data, this.#page.scene.mark, 2 ** store.state.exposure), AS_IT_IS),
    ]);
    this.#strip.draw(store.state);
  }

  #item(title, detail, picture, look = null) {
    const onClick = () => this.#choose(this.#shown === title ? '' : title, picture, look);
    return { title, detail, picture, look, isPressed: () => this.#shown === title, onClick };
  }

  // Shows a picture of the strip in place of the scene; the relit scene if there is none.
  #choose(title, picture = null, look = null) {
    if (this.#shown === title) return;
    this.#shown = title;
    this.#page.scenePictures.replace(picture, true, this.#page.store.state, { look });
    this.#page.store.update({});
  }
}

const decibels = value => value === null ? 'exact' : `${value.toFixed(1)} dB`;

function errorOf({ expected_rmse: rmse, psnr_dB: psnr, psnr_of_direct_dB: ofDirect }) {
  return `off by ${(100 * rmse).toPrecision(2)} % of full scale (${decibels(psnr)}); ${decibels(ofDirect)} if only direct light were counted`;
}

// A picture, dark, with some of its pixels in a colour of 8 bits.
function marked({ height, width, colours, values }, marks, colour, brightness) {
  const result = new Float32Array(3 * height * width);
  for (let i = 0; i < height * width; i++)
    for (let c = 0; c < 3; c++)
      result[3 * i + c] = marks[i] ? (colour[c] / 255) ** 2.2 : DARK * brightness * values[i * colours + (colours === 3 ? c : 0)];
  return { height, width, colours: 3, values: result };
}
