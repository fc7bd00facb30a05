#pragma once

namespace vrpipe::tools {

/// The style sheet of pages.
inline constexpr const char* page_style = R"(
:root { color-scheme: light; }
body { margin: 0 auto; padding: 28px 24px 60px; max-width: 1080px; background: #fff; color: #1d232a;
       font: 15px/1.5 system-ui, "Segoe UI", "DejaVu Sans", sans-serif; }
h1 { font-size: 26px; margin: 0 0 4px; } h2 { font-size: 20px; margin: 44px 0 6px; } p { margin: 6px 0; max-width: 860px; }
.verdict { font-size: 17px; } code { font-size: 13px; overflow-wrap: anywhere; }
.subtle { color: #5a6572; } .notice { background: #fff4d6; border-left: 4px solid #d99a00; padding: 8px 12px; }
ul { margin: 6px 0; padding-left: 20px; }
svg { width: 100%; height: auto; margin: 10px 0; }
svg text { font: 12px system-ui, "Segoe UI", "DejaVu Sans", sans-serif; fill: #1d232a; }
svg .label { paint-order: stroke; stroke: #fff; stroke-width: 3px; } svg .axis { font-size: 13px; } svg .grid { stroke: #e7eaee; } svg .frame { fill: none; stroke: #aab3bd; }
svg .leader { stroke: #aab3bd; stroke-width: .8; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; font-size: 13px; font-variant-numeric: tabular-nums; white-space: nowrap; }
th, td { padding: 3px 9px; text-align: right; } th { border-bottom: 2px solid #aab3bd; vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; padding-left: 4px; }
tr.group td { font-weight: 600; padding-top: 10px; border-bottom: 1px solid #e7eaee; }
tr.marked td { background: #e6f4ea; }
table.effects th, table.effects td { text-align: left; vertical-align: top; } td.active { font-weight: 600; }
.cards { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: 18px; margin-top: 14px; }
figure { margin: 0; border: 1px solid #dfe3e8; border-radius: 6px; padding: 10px; }
figure .pair { display: flex; gap: 8px; } figure img { width: calc(50% - 4px); height: auto; }
figcaption { font-size: 13px; margin-bottom: 6px; } figcaption b { font-size: 14px; }
figure.plot { border: 0; padding: 0; margin: 8px 0 18px; } figure.plot figcaption { color: #3b4652; max-width: 900px; }
a { color: #0b5394; } .links { white-space: nowrap; } .links a { margin-left: 6px; font-size: 12px; }
figure.reference { max-width: 420px; } figure.reference img { width: 100%; }
.scale { display: flex; align-items: center; gap: 8px; font-size: 13px; margin: 8px 0; }
.scale i { display: inline-block; width: 260px; height: 14px; border-radius: 2px; }
)";

}  // namespace vrpipe::tools
