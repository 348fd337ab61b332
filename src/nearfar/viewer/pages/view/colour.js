// Colours as the page has them (sRGB, 8 bits) in linear light.

// The level of full white in a light.
export const WHITE_LEVEL = 65535;

export const LINEAR_OF_BYTE = Float64Array.from({ length: 256 }, (_, i) => {
  const v = i / 255;
  return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
});

export const linearColour = hex => [1, 3, 5].map(i => LINEAR_OF_BYTE[parseInt(hex.slice(i, i + 2), 16)]);
