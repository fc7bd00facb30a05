#include "output/effects_page.h"

#include "output/effects_report.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

/// Why, once for all runs that give the same reason, which are named where there are several reasons.
std::string reasons_html(const std::vector<const RunResult*>& runs, std::size_t effect) {
  std::vector<std::pair<std::string, std::string>> variants_of;  // by reason
  for (const RunResult* run : runs) {
    const std::string& reason = run->effects[effect].reason;
    auto found = variants_of.begin();
    while (found != variants_of.end() && found->first != reason) ++found;
    if (found == variants_of.end()) {
      variants_of.emplace_back(reason, name_of(run->request));
    } else {
      found->second += ", " + name_of(run->request);
    }
  }
  if (variants_of.size() == 1) return html_escaped(variants_of.front().first);
  std::string text;
  for (const auto& [reason, variants] : variants_of) {
    text += (text.empty() ? "" : "<br>") + html_escaped(variants + ": " + reason);
  }
  return text;
}

}  // namespace

std::string effects_html(const std::vector<const RunResult*>& runs) {
  std::string text = "<div class=\"scroll\"><table class=\"effects\">\n<tr><th>effect</th>";
  for (const RunResult* run : runs) text += "<th>" + html_escaped(name_of(run->request)) + "</th>";
  text += "<th>reason</th></tr>\n";
  for (std::size_t i = 0; i < runs.front()->effects.size(); ++i) {
    text += "<tr><td>" + html_escaped(runs.front()->effects[i].name) + "</td>";
    for (const RunResult* run : runs) {
      const EffectReport& effect = run->effects[i];
      text += (effect.omitted ? "<td>" : "<td class=\"active\">") + state_of(*run, effect) + "</td>";
    }
    text += "<td>" + reasons_html(runs, i) + "</td></tr>\n";
  }
  return text + "</table></div>\n";
}

}  // namespace vrpipe::tools
