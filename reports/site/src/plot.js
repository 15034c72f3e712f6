// Logarithmic or linear axes with a grid, on which charts put their curves: D3's scales and axes on one SVG, so that
// colours follow the style sheet, paper gets vectors, and a screen reader finds names.
import { axisBottom, axisLeft } from "d3-axis";
import { scaleLinear, scaleLog } from "d3-scale";
import { create } from "d3-selection";
import { symbol, symbolCircle, symbolDiamond, symbolSquare, symbolTriangle, symbolCross, symbolStar } from "d3-shape";

export const SYMBOLS = [symbolCircle, symbolSquare, symbolTriangle, symbolDiamond, symbolCross, symbolStar];
// Okabe and Ito's palette without its yellow, which is lost on white, and with a grey; the style sheet has both themes.
export const COLOURS = 8;
const ROOM = 48;  // pixels of a label
const MARGIN = { top: 12, right: 14, bottom: 46, left: 62 };

/// "1e-4", for a power of ten: short on a phone.
const power = (x) => (Number.isInteger(Math.log10(x)) || Math.abs(Math.log10(x) - Math.round(Math.log10(x))) < 1e-9
  ? `1e${Math.round(Math.log10(x))}` : "");
const decades = ([low, high], length) => {
  const first = Math.ceil(Math.log10(low) - 1e-9), last = Math.floor(Math.log10(high) + 1e-9);
  const by = Math.max(1, Math.ceil((last - first) / Math.min(8, Math.floor(length / ROOM))));
  const ticks = [];
  for (let k = first; k <= last; k += by) ticks.push(10 ** k);
  return ticks;
};
export const logDomain = (values) => {
  const positive = values.filter((x) => x > 0);
  if (!positive.length) return [0.1, 10];
  return [Math.min(...positive) / 1.6, Math.max(...positive) * 1.6];
};

/// @param beside  pixels left free on the right  @returns { svg, area, x, y }
export function axes({ width, height, label, xLabel, yLabel, xDomain, yDomain, isLogY = true, beside = 0 }) {
  const right = width - MARGIN.right - beside;
  const x = scaleLog(xDomain, [MARGIN.left, right]);
  const y = (isLogY ? scaleLog : scaleLinear)(yDomain, [height - MARGIN.bottom, MARGIN.top]);
  const svg = create("svg:svg").attr("viewBox", `0 0 ${width} ${height}`).attr("role", "group").attr("aria-label", label)
    .style("width", "100%").style("height", "auto");
  const xAxis = axisBottom(x).tickValues(decades(xDomain, right - MARGIN.left)).tickFormat(power).tickSizeOuter(0)
    .tickSizeInner(-(height - MARGIN.top - MARGIN.bottom)).tickPadding(8);
  const yAxis = axisLeft(y).tickSizeOuter(0).tickSizeInner(-(right - MARGIN.left)).tickPadding(8);
  if (isLogY) yAxis.tickValues(decades(yDomain, height - MARGIN.top - MARGIN.bottom)).tickFormat(power);
  svg.append("g").attr("class", "axis").attr("aria-hidden", "true")
    .attr("transform", `translate(0,${height - MARGIN.bottom})`).call(xAxis);
  svg.append("g").attr("class", "axis").attr("aria-hidden", "true")
    .attr("transform", `translate(${MARGIN.left},0)`).call(yAxis);
  svg.append("text").attr("class", "label").attr("x", (MARGIN.left + right) / 2).attr("y", height - 8)
    .attr("text-anchor", "middle").text(xLabel);
  svg.append("text").attr("class", "label").attr("transform", `translate(14,${(height - MARGIN.bottom) / 2}) rotate(-90)`)
    .attr("text-anchor", "middle").text(yLabel);
  return { svg, area: svg.append("g"), x, y };
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
