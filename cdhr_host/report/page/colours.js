// Colour maps that read the same for every kind of eye: viridis, and cividis for margins.
const MAPS = {
  viridis: ["440154", "481f70", "443983", "3b528b", "31688e", "287c8e", "21918c", "20a486", "35b779", "5ec962",
    "90d743", "c8e020", "fde725"],
  cividis: ["00224e", "003170", "2a3f6d", "434e6c", "575d6d", "6a6c71", "7d7c78", "918b78", "a59c74", "bcae6c",
    "d2c060", "e9d34e", "fee838"],
};
const OUTSIDE = [213, 94, 0];
const mapOf = (quantity) => MAPS[quantity === "margin" ? "cividis" : "viridis"];

// 0..1 -> [r, g, b], 0..255
function colourAt(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const at = Math.min(Math.floor(place), stops.length - 2);
  const part = (stop, k) => parseInt(stop.slice(2 * k, 2 * k + 2), 16);
  return [0, 1, 2].map((k) => part(stops[at], k) * (1 - place + at) + part(stops[at + 1], k) * (place - at));
}

// 256 texels of four bytes
function colourTable(stops) {
  const texels = new Uint8ClampedArray(1024);
  for (let i = 0; i < 256; i++) texels.set([...colourAt(stops, i / 255), 255], 4 * i);
  return texels;
}
