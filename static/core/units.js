/** Numbers as people read them. Millimetres and seconds come in, text goes out. */

/** '3.42 m'; the minus sign is a true one. */
export const metres = (m) => `${metresNumber(m)} m`;

/**
 * '3.42', or a dash while the distance is not known. Rounded from whole tenths of a millimetre, as
 * the API states them, so that a track row and a defect at the same place read the same.
 */
export function metresNumber(m) {
  if (m === null) return '–';
  const hundredths = Math.round(Math.round(m * 10000) / 100);
  return (hundredths / 100).toFixed(2).replace('-0.00', '0.00').replace('-', '−');
}

/** 95 % half-width of a normal error with this standard deviation, in metres. */
export const u95FromSigma = (sigmaMm) => (1.96 * sigmaMm) / 1000;

/** '± 0.01 m', rounded up: the stated interval is never narrower than the true one. */
export const plusMinus = (u95M) =>
  u95M === null ? '' : `± ${(Math.ceil(u95M * 100 - 1e-9) / 100).toFixed(2)} m`;

/** '0:03.42', or '1:02:03.42' above an hour. */
export function timecode(seconds, decimals = 2) {
  const scale = 10 ** decimals;
  const total = Math.round(Math.max(0, seconds) * scale) / scale;
  const hours = Math.floor(total / 3600);
  const minutes = Math.floor((total % 3600) / 60);
  const rest = (total % 60).toFixed(decimals).padStart(decimals ? 3 + decimals : 2, '0');
  return hours ? `${hours}:${String(minutes).padStart(2, '0')}:${rest}` : `${minutes}:${rest}`;
}

/** 'less than 10 s', '40 s', '3 min', '1 h 5 min'. */
export function duration(seconds) {
  if (seconds < 10) return 'less than 10 s';
  if (seconds < 90) return `${Math.round(seconds / 5) * 5} s`;
  const minutes = Math.round(seconds / 60);
  return minutes < 60 ? `${minutes} min` : `${Math.floor(minutes / 60)} h ${minutes % 60} min`;
}

const BYTE_UNITS = ['B', 'kB', 'MB', 'GB', 'TB'];

/** '12.3 MB' (decimal units). */
export function bytes(count) {
  const power = Math.min(Math.floor(Math.log10(Math.max(count, 1)) / 3), BYTE_UNITS.length - 1);
  return `${(count / 1000 ** power).toFixed(power ? 1 : 0)} ${BYTE_UNITS[power]}`;
}

/** '6 o’clock': whole hours, as pipe inspectors write them. */
export const clockHour = (hours) => `${Math.round(hours) % 12 || 12} o’clock`;

const DATE = new Intl.DateTimeFormat(undefined, { dateStyle: 'medium', timeStyle: 'short' });

export const date = (iso) => DATE.format(new Date(iso));
