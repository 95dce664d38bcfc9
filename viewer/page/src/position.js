// Lossless positions of any size: {sector: [i, j, k] of BigInt, local: [x, y, z] in metres from its
// centre}, and `frame`, its number, where the sector is one of a frame that moves.

// In the sector and frame of another position, or of a view.
export const placed = ({sector, frame}, local = [0, 0, 0]) => frame ? {sector, local, frame} : {sector, local};

// The server's format, with indices as strings.
export const fromJson = ({sector, local, frame}) => placed({sector: sector.map(BigInt), frame}, local);
export const toJson = ({sector, local, frame}) => placed({sector: sector.map(String), frame}, local);

// Whether there is a vector between them.
export const isSameFrame = (a, b) => (a.frame ?? 0) === (b.frame ?? 0);

// The vector between two positions of one frame, in metres: exact while they are near each other.
export function between(from, to, sectorSize) {
  return to.local.map(
      (x, axis) => Number(to.sector[axis] - from.sector[axis]) * sectorSize + x - from.local[axis]);
}

// `from` moved by a vector in metres, with the displacement normalised to its new sector.
export function moved(from, way, sectorSize) {
  const sector = [...from.sector];
  const local = from.local.map((x, axis) => {
    const sum = x + way[axis];
    const sectors = Math.floor(sum / sectorSize + 0.5);
    sector[axis] = BigInt.asIntN(64, sector[axis] + BigInt(sectors));
    return sum - sectors * sectorSize;
  });
  return placed({sector, frame: from.frame}, local);
}

const kRange = 1n << 63n;

function integer(text) {
  const power = /^([+-]?)(\d+)\^(\d+)$/.exec(text);
  const value = power ?
      (power[1] === '-' ? -1n : 1n) * BigInt(power[2]) ** BigInt(Math.min(Number(power[3]), 64)) :
      /^[+-]?\d+$/.test(text) ? BigInt(text.replace('+', '')) :
                                null;
  return value !== null && value >= -kRange && value < kRange ? value : null;
}

// "I, J, K", each in decimal digits or as a power ("-2^62"); null for other text and beyond 64 bits.
export function parseSector(text) {
  const parts = text.trim().replace(/^[([]|[)\]]$/g, '').split(/[\s,;]+/).filter(Boolean).map(integer);
  return parts.length === 3 && !parts.includes(null) ? parts : null;
}

const superscript = (number) => [...String(number)].map((digit) => '⁰¹²³⁴⁵⁶⁷⁸⁹'[digit]).join('');

// A large index as a power of two plus or minus the rest.
function indexText(index) {
  const size = index < 0n ? -index : index;
  if (size < 1n << 32n) return String(index);
  const bits = size.toString(2).length;
  for (const exponent of [bits - 1, bits]) {
    const rest = size - (1n << BigInt(exponent));
    if (rest > -(1n << 20n) && rest < 1n << 20n) {
      const sign = index < 0n ? '−' : '';
      if (rest === 0n) return `${sign}2${superscript(exponent)}`;
      const outer = (rest > 0n) === (index > 0n) ? ' + ' : ' − ';
      return `${sign}2${superscript(exponent)}${outer}${rest < 0n ? -rest : rest}`;
    }
  }
  return String(index);
}

export const sectorText = (sector) => sector.map(indexText).join(', ');
