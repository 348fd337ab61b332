// Values under the pointer of maps, and pictures enlarged by a click. Without it pages read as well.

// Colours of a map that are no values: where there is none, and where photos are saturated.
const NO_VALUE = [128, 128, 128];
const SATURATED = [214, 40, 90];

const isSame = (colour, other) => colour.every((part, i) => part === other[i]);

// The share of the way along the stops of a colour scale at which a colour lies.
function shareOf(colour, stops) {
  let best = { distance: Infinity, share: 0 };
  for (let i = 0; i + 1 < stops.length; i += 1) {
    const along = stops[i + 1].map((end, k) => end - stops[i][k]);
    const length = along.reduce((sum, part) => sum + part * part, 0);
    const dot = along.reduce((sum, part, k) => sum + part * (colour[k] - stops[i][k]), 0);
    const t = Math.min(1, Math.max(0, dot / length));
    const distance = colour.reduce((sum, c, k) => sum + (c - stops[i][k] - t * along[k]) ** 2, 0);
    if (distance < best.distance) best = { distance, share: (i + t) / (stops.length - 1) };
  }
  return best.share;
}

function textOf(colour, map) {
  if (isSame(colour, NO_VALUE)) return "no value";
  if (isSame(colour, SATURATED)) return "saturated";
  const [low, high] = [Number(map.dataset.low), Number(map.dataset.high)];
  const value = low + (high - low) * shareOf(colour, JSON.parse(map.dataset.stops));
  return `${value.toPrecision(3)} ${map.dataset.unit}`.trim();
}

function readOnHover(map) {
  const image = map.querySelector("img");
  const shown = map.querySelector(".under-pointer");
  let drawn = null;
  const pixels = () => {
    if (drawn === null) {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
      drawn = canvas.getContext("2d", { willReadFrequently: true });
      drawn.drawImage(image, 0, 0);
    }
    return drawn;
  };
  image.addEventListener("pointermove", (event) => {
    const box = image.getBoundingClientRect();
    const x = Math.floor(((event.clientX - box.left) / box.width) * image.naturalWidth);
    const y = Math.floor(((event.clientY - box.top) / box.height) * image.naturalHeight);
    const step = Number(map.dataset.step);
    const colour = Array.from(pixels().getImageData(x, y, 1, 1).data.slice(0, 3));
    shown.textContent = `(${y * step}, ${x * step}): ${textOf(colour, map)}`;
  });
  image.addEventListener("pointerleave", () => (shown.textContent = ""));
}

function enlargeOnClick(image, dialog) {
  const open = () => {
    const large = image.cloneNode();
    const caption = document.createElement("p");
    caption.textContent = image.alt;
    dialog.replaceChildren(large, caption);
    dialog.showModal();
  };
  image.tabIndex = 0;
  image.setAttribute("role", "button");
  image.addEventListener("click", open);
  image.addEventListener("keydown", (event) => {
    if (event.key === "Enter" || event.key === " ") {
      event.preventDefault();
      open();
    }
  });
}

const dialog = document.createElement("dialog");
dialog.addEventListener("click", () => dialog.close());
document.body.append(dialog);
for (const image of document.querySelectorAll("main img")) enlargeOnClick(image, dialog);
for (const map of document.querySelectorAll("figure[data-stops]")) readOnHover(map);
