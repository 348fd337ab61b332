// Exposure that follows the light.

// Sets the exposure by the picture that has come, where the page is to.
export function meter({ store, scenePictures, history }) {
  if (store.state.metering !== 'auto') return;
  const exposure = scenePictures.exposure(store.state);
  if (exposure !== null && exposure !== store.state.exposure) history.quietly(() => store.update({ exposure }));
}
