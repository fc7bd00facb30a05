#pragma once

namespace vrpipe::tools {

/// Of drawings that are saved from the page, where its style sheet is not.
inline constexpr const char* plot_style = R"(
svg { background: #fff; } text { font: 12px "DejaVu Sans", Arial, Helvetica, sans-serif; fill: #1d232a; }
.axis { font-size: 13px; } .strong { font-weight: 600; } .grid { stroke: #e7eaee; } .frame { fill: none; stroke: #aab3bd; }
.label { paint-order: stroke; stroke: #fff; stroke-width: 3px; } .piece { stroke: #1d232a; stroke-width: .4; }
.flow { fill: #e3e8ed; } .small { font-size: 11px; } .light { fill: #fff; }
)";

/// What a page of runs has beside page_style.
inline constexpr const char* compare_page_style = R"(
svg .strong { font-weight: 600; } svg .piece { stroke: #1d232a; stroke-width: .4; } svg .flow { fill: #e3e8ed; }
svg .small { font-size: 11px; } svg .light { fill: #fff; }
nav { margin: 10px 0 0; font-size: 14px; } nav a { margin-right: 14px; white-space: nowrap; } 
h2 { border-top: 1px solid #dfe3e8; padding-top: 18px; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: 3px 18px; margin: 10px 0; } dt { color: #5a6572; } dd { margin: 0; overflow-wrap: anywhere; }
.controls { display: flex; flex-wrap: wrap; gap: 8px 18px; align-items: center; margin: 10px 0; font-size: 14px; }
.controls input[type=range] { width: 220px; } select { font: inherit; }
.stage { position: relative; line-height: 0; background: #000; overflow: hidden; }
.stage img, .stage canvas { width: 100%; height: auto; image-rendering: auto; }
.stage .over { position: absolute; left: 0; top: 0; } .stage .edge { position: absolute; top: 0; bottom: 0; width: 2px; margin-left: -1px; background: #fff; box-shadow: 0 0 3px #000; pointer-events: none; }
.stage .tag { position: absolute; top: 8px; padding: 3px 8px; background: rgba(0,0,0,.65); color: #fff; font-size: 13px; line-height: 1.3; border-radius: 3px; }
.stage .tag.left { left: 8px; } .stage .tag.right { right: 8px; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(220px, 1fr)); gap: 12px; margin: 12px 0; }
.pictures figure, .maps figure { border: 0; padding: 0; } .pictures figure img, .maps figure img { width: 100%; display: block; }
.maps { display: grid; gap: 10px; margin: 6px 0 14px; }
table.parameters td, table.parameters th { text-align: left; } td.other { background: #fff0b8; font-weight: 600; }
pre { font-size: 12px; overflow-x: auto; } details { margin: 10px 0; } summary { cursor: pointer; font-weight: 600; }
table.effects td:last-child { white-space: normal; min-width: 320px; }
.hidden { display: none; }
@media print { nav, .controls, .links { display: none; } details > * { display: block; } h2 { break-after: avoid; } figure { break-inside: avoid; } }
)";

/// Comes before anything that may fail: what fails is kept where tests find it.
inline constexpr const char* compare_page_watch = R"js(
window.onerror = message => { document.documentElement.dataset.error = message; };
)js";

/// Runs at the end of the page.
inline constexpr const char* compare_page_script = R"js(
"use strict";
const root = document.documentElement;
const byId = id => document.getElementById(id);
function comparePictures() {
  const pictures = Array.from(document.querySelectorAll(".pictures img"));
  const left = byId("left"), right = byId("right"), view = byId("view"), wipe = byId("wipe"), gain = byId("gain");
  const under = byId("under"), over = byId("over"), canvas = byId("difference"), edge = byId("edge");
  const stage = byId("stage"), say = byId("difference-text");
  function pixels(picture) {
    const own = document.createElement("canvas");
    own.width = picture.naturalWidth;
    own.height = picture.naturalHeight;
    const context = own.getContext("2d", {willReadFrequently: true});
    context.drawImage(picture, 0, 0);
    return context.getImageData(0, 0, own.width, own.height);
  }
  function drawDifference(a, b) {
    const first = pixels(a), second = pixels(b), factor = Number(gain.value);
    const shown = new ImageData(first.width, first.height);
    let largest = 0, differing = 0;
    for (let i = 0; i < first.data.length; i += 4) {
      let here = 0;
      for (let c = 0; c < 3; ++c) {
        const difference = Math.abs(first.data[i + c] - second.data[i + c]);
        here = Math.max(here, difference);
        shown.data[i + c] = Math.min(255, difference * factor);
      }
      shown.data[i + 3] = 255;
      largest = Math.max(largest, here);
      differing += here > 0 ? 1 : 0;
    }
    canvas.width = first.width;
    canvas.height = first.height;
    canvas.getContext("2d").putImageData(shown, 0, 0);
    canvas.dataset.largest = largest;
    const share = 100 * differing * 4 / first.data.length;
    say.textContent = largest === 0 ? "No pixel of these two pictures differs." :
      "Of these two pictures " + share.toFixed(2) + " % of the pixels differ, by at most " + largest + " of 255.";
  }
  function slide() {
    over.style.clipPath = "inset(0 " + (100 - wipe.value) + "% 0 0)";
    edge.style.left = wipe.value + "%";
  }
  function update() {
    const a = pictures[left.value], b = pictures[right.value], differs = view.value === "difference";
    under.src = b.src;
    over.src = a.src;
    byId("left-tag").textContent = a.alt;
    byId("right-tag").textContent = b.alt;
    for (const each of [over, edge, byId("left-tag"), byId("right-tag"), byId("wipe-control")])
      each.classList.toggle("hidden", differs);
    for (const each of [canvas, byId("gain-control")]) each.classList.toggle("hidden", !differs);
    drawDifference(a, b);
    slide();
  }
  function drag(event) {
    if (event.buttons !== 1 || view.value === "difference") return;
    const box = stage.getBoundingClientRect();
    wipe.value = Math.min(100, Math.max(0, 100 * (event.clientX - box.left) / box.width));
    slide();
    event.preventDefault();
  }
  for (const each of [left, right, view, gain]) each.addEventListener("change", update);
  wipe.addEventListener("input", slide);
  stage.addEventListener("pointerdown", drag);
  stage.addEventListener("pointermove", drag);
  update();
}
window.addEventListener("load", () => {
  if (byId("stage")) comparePictures();
  root.dataset.pictures = document.querySelectorAll(".pictures img").length;
  root.dataset.plots = document.querySelectorAll("figure.plot svg").length;
  root.dataset.maps = document.querySelectorAll(".maps img").length;
  root.dataset.downloads = document.querySelectorAll("a[download]").length;
  root.dataset.ready = "true";
});
)js";

}  // namespace vrpipe::tools
