// The photos of the capture: each is compared with the scene under the light that it was taken under.

import { BackgroundJob } from './background.js';
import { get, set } from './dom.js';
import { pictureOf } from './picture.js';
import { requestMessage } from './protocol.js';

export const photoUrl = number => `photo:${number}`;
export const PHOTO_URL = /^photo:(\d{1,6})$/;

// The photo whose light the page has; -1 for none.
function numberOf({ kind, pictures, shown, blend }) {
  const found = kind === 'picture' && !blend && PHOTO_URL.exec(pictures[shown]?.url ?? '');
  return found ? Number(found[1]) : -1;
}

export class PhotoSeries {
  #page;
  #job = new BackgroundJob(text => set(get('photo-status'), 'textContent', text === 'computing' ? 'reading' : text));
  // The photo that is compared with, { number, picture }, and the number that the page's light has.
  #photo = null;
  #shown = -1;

  constructor(page) {
    this.#page = page;
    const { photos } = page.scene, slider = get('photo-number');
    get('photo-series').hidden = get('photo-line').hidden = !photos.length;
    slider.max = Math.max(0, photos.length - 1);
    slider.oninput = () => this.#tell(slider.valueAsNumber);
    slider.onchange = () => this.#choose(slider.valueAsNumber);
    get('next-held-out').onclick = () => this.#choose(this.#nextHeldOut());
    get('next-held-out').disabled = !photos.some(photo => photo.is_held_out);
  }

  // Follows the light: another one has no photo, and that of a photo, after an undo or from the address, has its own.
  show(state) {
    const number = numberOf(state), isChosenNow = [get('photo-number'), get('photo-output')].includes(document.activeElement);
    if (number !== this.#shown || !isChosenNow) this.#tell(number);
    if (number === this.#shown) return;
    this.#shown = number;
    if (number >= 0 && number < this.#page.scene.photos.length) this.#choose(number);
    else if (this.#photo && this.#page.scenePictures.isReference(this.#photo.picture)) this.#page.scenePictures.removeReference();
  }

  #nextHeldOut() {
    const { photos } = this.#page.scene, places = photos.map((_, i) => (this.#shown + 1 + i) % photos.length);
    return places.find(i => photos[i].is_held_out);
  }

  #tell(number) {
    const photo = this.#page.scene.photos[number];
    if (photo) get('photo-number').value = String(number);
    set(get('photo-output'), 'textContent', photo ? String(number) : 'none');
    set(get('photo-purpose'), 'textContent', photo ? `taken for ${photo.purpose}` + (photo.is_held_out ? ', used by no estimate' : '') : '');
  }

  #choose(number) { this.#job.ask([signal => this.#compare(number, signal)]); }

  async #compare(number, signal) {
    const { header, arrays: [levels, photo] } = await requestMessage(`photo/${number}`, { signal });
    const { store, light, scenePictures } = this.#page, url = photoUrl(number), { pictures } = store.state;
    const place = pictures.findIndex(each => each.url === url), isNew = place < 0;
    this.#photo = { number, picture: pictureOf(photo, header.scale) };
    this.#shown = number;
    this.#tell(number);
    scenePictures.compareWith(this.#photo.picture, `photo ${number}`);
    store.update({
      kind: 'picture', blend: null, pictures: isNew ? [...pictures, light.addLinear(levels.data, url)] : pictures, shown: isNew ? pictures.length : place,
    });
  }
}
