/** Numbers as people read them. */

export function bytes(count: number): string {
  const units = ['B', 'KB', 'MB', 'GB', 'TB'];
  let power = 0;
  while (count >= 1000 && power < units.length - 1) {
    count /= 1000;
    power += 1;
  }
  return `${count >= 100 || power === 0 ? Math.round(count) : count.toPrecision(2)} ${units[power]}`;
}

export function duration(seconds: number): string {
  if (seconds < 90) return `${Math.max(1, Math.round(seconds))} s`;
  if (seconds < 5400) return `${Math.round(seconds / 60)} min`;
  if (seconds < 172800) return `${(seconds / 3600).toPrecision(2)} h`;
  return `${Math.round(seconds / 86400)} days`;
}

export function metres(length: number): string {
  if (length >= 1000) return `${(length / 1000).toPrecision(3)} km`;
  return `${Number(length.toPrecision(length >= 100 ? 3 : 2))} m`;
}

export function count(number: number): string {
  return number.toLocaleString('en');
}
