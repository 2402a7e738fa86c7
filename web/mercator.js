// Positions on the square world: x, y in [0, 1], x from the antimeridian eastwards, y from the north.

export const EQUATOR_M = 40075016.685578488;

export function world(longitude_deg, latitude_deg) {
  const sin = Math.sin(latitude_deg * Math.PI / 180);
  return [longitude_deg / 360 + 0.5, 0.5 - Math.log((1 + sin) / (1 - sin)) / (4 * Math.PI)];
}

export function degrees([x, y]) {
  const latitude = Math.atan(Math.sinh(Math.PI * (1 - 2 * y))) * 180 / Math.PI;
  return [(((x % 1) + 1) % 1) * 360 - 180, latitude];
}

// Ground metres in one width of the world, at a height on it (sphere: good enough for a scale bar and a marker).
export function metresAcross(y) {
  return EQUATOR_M / Math.cosh(Math.PI * (1 - 2 * y));
}
