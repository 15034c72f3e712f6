// Logarithmic or linear axes with a grid, on which charts put their curves: D3's scales and axes on one SVG, so that
// colours follow the style sheet, paper gets vectors, and a screen reader finds names.
import { axisBottom, axisLeft } from "d3-axis";
import { scaleLinear, scaleLog } from "d3-scale";
import { create } from "d3-selection";
import { symbol, symbolCircle, symbolDiamond, symbolSquare, symbolTriangle, symbolCross, symbolStar } from "d3-shape";

const SYMBOLS = [symbolCircle, symbolSquare, symbolTriangle, symbolDiamond, symbolCross, symbolStar];
/// Solid, dashed, dotted, dashes and dots.
export const DASHES = ["", "6 3", "2 3", "9 3 2 3"];
/// How a curve looks, as CurveLook has it (reports/curve_look.h): a number of the style sheet's palette, which is Okabe and Ito's
/// without its yellow, lost on white, and with a grey; one of a mark; dashes.
export const lookOf = ({ colour, symbol, dash, is_open }) => ({ colour, symbol, dash: DASHES[dash], isOpen: is_open });
export const markClass = ({ isOpen }) => (isOpen ? "mark open" : "mark");
const ROOM = 48, NAME_ROOM = 66, LETTER = 6.6;  // pixels of a power, of a name below an axis, and of a letter
const MARGIN = { top: 12, right: 14, bottom: 46, left: 62 };
const LANE = 7;  // pixels of one of many lanes in a band of zeros
const GAP = 8;  // pixels between a band of zeros and its axis, and from its rim to its first lane

/// "1e-4", for a power of ten: short on a phone.
const power = (x) => (Number.isInteger(Math.log10(x)) || Math.abs(Math.log10(x) - Math.round(Math.log10(x))) < 1e-9
  ? `1e${Math.round(Math.log10(x))}` : "");
const decades = (domain, length) => {
  const [low, high] = [Math.min(...domain), Math.max(...domain)];
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const by = Math.max(1, Math.ceil((last - first) / Math.min(8, Math.floor(length / ROOM))));
  const ticks = [];
  for (let k = first; k <= last; k += by) ticks.push(10 ** k);
  return ticks;
};
/// All digits of a decade have no room.
const fewOf = (ticks) => (ticks.length <= 8 ? ticks : ticks.filter((tick) => [1, 2, 5].includes(Number(tick.toExponential()[0]))));
/// Of those between the ends, as many as have room for a name.
const places = ([low, high], length) => {
  const first = Math.ceil(low), last = Math.floor(high);
  const by = Math.ceil(((last - first + 1) * NAME_ROOM) / length);
  return Array.from({ length: Math.floor((last - first) / by) + 1 }, (_, k) => last - k * by).reverse();
};
export const logDomain = (values) => {
  const positive = values.filter((x) => x > 0);
  if (!positive.length) return [0.1, 10];
  return [Math.min(...positive) / 1.6, Math.max(...positive) * 1.6];
};

/// Pixels of the band of zeros before a logarithmic axis, on which zero has no place. Many lanes share what there is.
const bandOf = (zeros, length) => (zeros ? Math.min(length / 5, Math.max(28, LANE * zeros.lanes + 2 * GAP)) : 0);

/// @param xNames, yNames  of the places 0, 1, ... of a linear axis
/// @param beside  pixels left free on the right
/// @param zerosX, zerosY  { lanes, label } of the bands of zeros left and below, if any
/// @returns { svg, area, x, y, zeroX, zeroY }; the last two take a share, from 0 to 1, of the breadth of a band
export function axes({ width, height, label, xLabel, yLabel, xDomain, yDomain, isLogX = true, isLogY = true, xNames, yNames,
  beside = 0, zerosX, zerosY }) {
  const left = yNames ? LETTER * Math.max(...yNames.map((name) => name.length)) + 20 : MARGIN.left, right = width - (xNames ? NAME_ROOM / 2 : MARGIN.right) - beside;
  const top = MARGIN.top, bottom = height - MARGIN.bottom;
  const rimX = left + bandOf(zerosX, right - left), rimY = bottom - bandOf(zerosY, bottom - top);
  const x = (isLogX ? scaleLog : scaleLinear)(xDomain, [zerosX ? rimX + GAP : left, right]);
  const y = (isLogY ? scaleLog : scaleLinear)(yDomain, [zerosY ? rimY - GAP : bottom, top]);
  const svg = create("svg:svg").attr("viewBox", `0 0 ${width} ${height}`).attr("role", "group").attr("aria-label", label)
    .style("width", "100%").style("height", "auto");
  const zeroX = scaleLinear([0, 1], [left + GAP, rimX - GAP]), zeroY = scaleLinear([0, 1], [rimY + GAP, bottom - GAP]);
  const zeros = svg.append("g").attr("class", "axis").attr("aria-hidden", "true");
  const band = (x0, y0, x1, y1, rim) => {
    zeros.append("rect").attr("class", "zeros").attr("x", x0).attr("y", y0).attr("width", x1 - x0).attr("height", y1 - y0);
    zeros.append("path").attr("class", "rim").attr("d", rim);
  };
  if (zerosX) band(left, top, rimX, bottom, `M${rimX},${top}V${bottom}`);
  if (zerosY) band(left, rimY, right, bottom, `M${left},${rimY}H${right}`);
  const zero = (text, at, anchor) => zeros.append("text").attr("transform", `translate(${at})`).attr("dy", "0.32em")
    .attr("text-anchor", anchor).text(text);
  if (zerosX) zero(zerosX.label, [zeroX(0.5), bottom + 13], "middle");
  if (zerosY) zero(zerosY.label, [left - 8, zeroY(0.5)], "end");
  // A power whose label would touch that of the band beside it is left out.
  const isClear = (tick) => !zerosX || x(tick) - zeroX(0.5) >= ROOM / 2 + 4 * zerosX.label.length;
  const length = x.range()[1] - x.range()[0];
  const xAxis = axisBottom(x).tickSizeOuter(0).tickSizeInner(top - bottom).tickPadding(8);
  if (xNames) xAxis.tickValues(places(xDomain, length)).tickFormat((k) => xNames[k]);
  else if (isLogX) xAxis.tickValues(decades(xDomain, length).filter(isClear)).tickFormat(power);
  else xAxis.ticks(Math.max(2, Math.floor(length / NAME_ROOM)));
  const yAxis = axisLeft(y).tickSizeOuter(0).tickSizeInner(left - right).tickPadding(8);
  if (yNames) yAxis.tickValues([...yNames.keys()]).tickFormat((k) => yNames[k]);
  else if (isLogY) {
    const powers = decades(yDomain, y.range()[0] - top);
    if (powers.length > 1) yAxis.tickValues(powers).tickFormat(power);
    else yAxis.tickValues(fewOf(y.ticks(6))).tickFormat((value) => String(Number(value.toPrecision(4))));
  }
  svg.append("g").attr("class", "axis").attr("aria-hidden", "true").attr("transform", `translate(0,${bottom})`).call(xAxis);
  svg.append("g").attr("class", "axis").attr("aria-hidden", "true").attr("transform", `translate(${left},0)`).call(yAxis);
  svg.append("text").attr("class", "label").attr("x", (left + right) / 2).attr("y", height - 8)
    .attr("text-anchor", "middle").text(xLabel);
  svg.append("text").attr("class", "label").attr("transform", `translate(14,${bottom / 2}) rotate(-90)`)
    .attr("text-anchor", "middle").text(yLabel);
  return { svg, area: svg.append("g"), x, y, zeroX, zeroY };
}

export const symbolPath = (k, size = 36) => symbol(SYMBOLS[k % SYMBOLS.length], size)();

/// Charts follow the width of their figure, from a phone on.
export function drawAtWidth(place, draw) {
  let drawn = 0;
  const update = () => {
    const width = Math.max(300, Math.min(980, Math.floor(place.getBoundingClientRect().width)));
    if (width === drawn) return;
    drawn = width;
    draw(width);
  };
  new ResizeObserver(update).observe(place);
  update();
}
