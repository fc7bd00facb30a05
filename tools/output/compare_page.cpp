#include "output/compare_page.h"

#include <utility>
#include <vector>

#include <fmt/format.h>

#include "output/compare_page_style.h"
#include "output/compare_sections.h"
#include "output/page_parts.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

struct PageSection {
  const char* id;
  const char* title;
  std::string body;
};

}  // namespace

std::string compare_page(const JobResult& result) {
  const std::vector<PageSection> sections{{"pictures", "Pictures", pictures_section(result)},
                                          {"speedups", "Time", speedups_section(result)},
                                          {"fates", "Where quads went", funnels_section(result)},
                                          {"states", "Where cycles went", cycles_section(result)},
                                          {"course", "Over time", course_section(result)},
                                          {"heat", "Heat maps", heat_section(result)},
                                          {"spent", "Energy", energy_section(result)},
                                          {"effects", "Effects", runs_effects_section(result)},
                                          {"notes", "Anomalies and notes", notes_section(result)},
                                          {"settings", "Every parameter", parameters_section(result)}};
  const bool is_comparison = result.runs.size() > 1;
  const std::string title = (is_comparison ? "vrpipe compare: " : "vrpipe run: ") + result.scene.name;
  std::string text = page_head(title, compare_page_style, compare_page_watch) + "<h1>" +
                     html_escaped(result.scene.name) + (is_comparison ? ": GPUs compared" : ": a run") + "</h1>\n";
  text += heading_section(result) + "<nav>";
  for (const PageSection& section : sections) {
    if (!section.body.empty()) text += fmt::format("<a href=\"#{}\">{}</a>", section.id, section.title);
  }
  text += "</nav>\n";
  for (const PageSection& section : sections) {
    if (section.body.empty()) continue;
    text +=
        fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", section.id, section.title) + section.body + "</section>\n";
  }
  return text + "<p class=\"subtle\">vrpipe " + VRPIPE_VERSION + "</p>\n<script>" + compare_page_script +
         "</script>\n</body>\n</html>\n";
}

}  // namespace vrpipe::tools
