// Numeric axes: where they end, where their ticks stand and what those say. An axis counts in its
// own measure: a logarithmic one in powers of ten. Knows nothing of the page.
const axes = (() => {
  "use strict";

  // Numbers beyond this are taken for missing: no measurement is so large.
  const MOST = 1e100;
  const power = (exponent) => Number(`1e${exponent}`);
  const floorLog = (value) => Math.floor(Math.log10(value) + 1e-9);

  // A value in the measure of its axis; NaN where it has no place there.
  function measured(scale, value) {
    if (typeof value !== "number" || !(Math.abs(value) <= MOST)) return NaN;
    if (scale === "log") return value >= 1 / MOST ? Math.log10(value) : NaN;
    return value;
  }

  // The least and the greatest of the numbers, or null where there are none.
  function extent(measures) {
    let range = null;
    for (const m of measures) {
      if (Number.isNaN(m)) continue;
      range = range ? [Math.min(range[0], m), Math.max(range[1], m)] : [m, m];
    }
    return range;
  }

  // An extent that is more than one point.
  function widened([low, high]) {
    const size = Math.max(Math.abs(low), Math.abs(high));
    if (high - low > 1e-9 * size && high - low > 1 / MOST) return [low, high];
    const margin = size > 1 / MOST ? 0.1 * size : 0.5;
    return [low - margin, high + margin];
  }

  // A little more on both sides, so that no mark sits on the frame.
  function padded(range, part) {
    const [low, high] = widened(range);
    const margin = part * (high - low);
    return [low - margin, high + margin];
  }

  // The smallest of 1, 2, 5 times a power of ten that cuts `span` into `most` parts or fewer.
  function niceStep(span, most) {
    const raw = span / most;
    const unit = power(Math.floor(Math.log10(raw)));
    return [1, 2, 5, 10].map((digit) => digit * unit).find((step) => step >= raw * (1 - 1e-9));
  }

  // The range that holds `range` and ends at ticks.
  function rounded(scale, range, most) {
    return scale === "log" ? roundedLog(range) : roundedLinear(range, most);
  }

  function roundedLinear(range, most) {
    let [low, high] = widened(range);
    // Zero belongs on an axis that comes near it.
    if (low > 0 && low < 0.4 * high) low = 0;
    if (high < 0 && high > 0.4 * low) high = 0;
    const step = niceStep(high - low, most);
    return [Math.floor(low / step + 1e-9) * step, Math.ceil(high / step - 1e-9) * step];
  }

  // Ends at powers of ten, or at 1, 2, 5 times one where it is less than three decades.
  function roundedLog([low, high]) {
    const digits = (high - low > 3 ? [1, 10] : [1, 2, 5, 10]).map(Math.log10);
    const around = (m) => digits.map((digit) => Math.floor(m + 1e-12) + digit);
    const below = around(low).findLast((m) => m <= low + 1e-9) ?? low;
    const above = around(high).find((m) => m >= high - 1e-9) ?? high;
    return below < above ? [below, above] : [below - Math.log10(2), above + Math.log10(2)];
  }

  const SUPERSCRIPTS = "\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079";
  const superscript = (exponent) =>
    String(exponent)
      .replace("-", "\u207b")
      .replace(/\d/g, (digit) => SUPERSCRIPTS[digit]);
  const minus = (digits) =>
    /^-[0.]*$/.test(digits) ? digits.slice(1) : digits.replace("-", "\u2212");

  // A value as mantissa times a power of ten.
  function scientific(value, digits) {
    const exponent = floorLog(Math.abs(value));
    const mantissa = String(Number((value / power(exponent)).toFixed(digits)));
    if (exponent === 0) return minus(mantissa);
    if (exponent === 1) return minus(String(Number((Number(mantissa) * 10).toFixed(digits))));
    if (mantissa === "1" || mantissa === "-1")
      return minus(mantissa.replace("1", `10${superscript(exponent)}`));
    return minus(`${mantissa}\u00d710${superscript(exponent)}`);
  }

  // What the tick of a value says where the next one is a step away, and no value is beyond `most`.
  // Powers of ten stand where all digits would be many, and few of them are needed.
  function label(value, step, most) {
    const digits = Math.max(0, -floorLog(step));
    const isLong = (digits > 5 || most >= 999999.5) && floorLog(most) - floorLog(step) <= 2;
    if (Math.abs(value) < 1e-6 * step) return isLong ? "0" : (0).toFixed(digits);
    if (!isLong) return minus(value.toFixed(digits));
    const needed = floorLog(Math.abs(value)) - floorLog(step);
    return scientific(value, Math.min(Math.max(needed, 0), 10));
  }

  // Ticks over a range: those with a label, and shorter ones without.
  function ticks(scale, [low, high], most) {
    const inside = ({ at }) => at >= low - 1e-9 * (high - low) && at <= high + 1e-9 * (high - low);
    const { major, minor } = scale === "log" ? log(low, high, most) : linear(low, high, most);
    return { major: major.filter(inside), minor: minor.filter(inside) };
  }

  function linear(low, high, most) {
    const step = niceStep(high - low, most);
    const first = Math.ceil(low / step - 1e-9);
    const count = Math.min(Math.floor(high / step + 1e-9) - first, 100) + 1;
    const values = Array.from({ length: Math.max(count, 0) }, (_, k) => (first + k) * step);
    const largest = Math.max(Math.abs(low), Math.abs(high));
    return {
      major: values.map((value) => ({ at: value, label: label(value, step, largest) })),
      minor: [],
    };
  }

  // At the powers of ten; where there is room for more, at 1, 2 and 5 or 1 and 3 times them.
  function log(low, high, most) {
    const decades = Array.from(
      { length: Math.floor(high) - Math.floor(low) + 1 },
      (_, k) => Math.floor(low) + k,
    );
    const multiples = (digits) =>
      decades
        .flatMap((exponent) =>
          digits.map((digit) => ({
            at: exponent + Math.log10(digit),
            value: digit * power(exponent),
          })),
        )
        .filter(({ at }) => at >= low - 1e-9 && at <= high + 1e-9);
    for (const digits of [[1, 2, 5], [1, 3], [1]]) {
      const marks = multiples(digits);
      if (marks.length >= 2 && marks.length <= Math.max(most, 2)) {
        return { major: told(marks), minor: multiples([1, 2, 3, 4, 5, 6, 7, 8, 9]) };
      }
    }
    if (high - low < 1) {
      const { major } = linear(10 ** low, 10 ** high, most);
      return { major: major.map((mark) => ({ ...mark, at: Math.log10(mark.at) })), minor: [] };
    }
    const tens = multiples([1]);
    const stride = Math.floor(tens.length / Math.max(most, 2)) + 1;
    return { major: told(tens.filter(({ at }) => Math.round(at) % stride === 0)), minor: tens };
  }

  function told(marks) {
    const plain = marks.every(({ value }) => value >= 0.000999 && value <= 10001);
    const say = (value) =>
      plain ? label(value, power(floorLog(value)), value) : scientific(value, 0);
    return marks.map(({ at, value }) => ({ at, label: say(value) }));
  }

  // Ticks where there are values, if they are few and far enough apart to be read.
  function ticksAt(scale, values, [low, high]) {
    const places = [...new Set(values)]
      .map((value) => ({ value, at: measured(scale, value) }))
      .filter(({ at }) => !Number.isNaN(at))
      .sort((a, b) => a.at - b.at);
    const gap = Math.min(...places.slice(1).map(({ at }, k) => at - places[k].at));
    if (places.length < 1 || places.length > 10 || gap < 0.07 * (high - low)) return null;
    return { major: places.map(({ value, at }) => ({ at, label: digits(value) })), minor: [] };
  }

  // A value for a reader: five digits tell any two measurements apart.
  function digits(value) {
    const words = String(Number(value.toPrecision(5)));
    return words.includes("e") ? scientific(value, 4) : minus(words);
  }

  return { measured, extent, padded, rounded, ticks, ticksAt, digits };
})();
