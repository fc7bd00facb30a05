#include "output/page_parts.h"

#include <cmath>

#include <fmt/format.h>

#include "image/base64.h"
#include "image/images.h"
#include "output/compare_page_style.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {
namespace {

/// What a page's style sheet says of drawings is part of one that stands alone.
std::string standalone(const std::string& svg) {
  const std::size_t end = svg.find('>') + 1;
  return svg.substr(0, end) + "\n<style>" + plot_style + "</style>" + svg.substr(end);
}

std::string link(const std::string& name, const std::string& type, const std::string& bytes, const std::string& text) {
  return fmt::format("<a download=\"{}\" href=\"data:{};base64,{}\">{}</a>", html_escaped(name), type, base64(bytes),
                     text);
}

}  // namespace

std::string csv_text(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

void CsvText::row(const std::vector<std::string>& cells) {
  for (std::size_t i = 0; i < cells.size(); ++i) text_ += (i > 0 ? "," : "") + csv_text(cells[i]);
  text_ += "\n";
}

std::string csv_link(const std::string& name, const std::string& csv) {
  return link(name + ".csv", "text/csv", csv, "data as CSV");
}

std::string html(const PageFigure& figure) {
  return fmt::format(
      "<figure class=\"plot\" id=\"{}\">\n{}<figcaption>{} <span class=\"links\">{} {}</span>"
      "</figcaption>\n</figure>\n",
      figure.name, figure.svg, figure.caption, csv_link(figure.name, figure.csv),
      link(figure.name + ".svg", "image/svg+xml", standalone(figure.svg), "plot as SVG"));
}

std::string html_table(const std::vector<std::string>& heading, const std::vector<PageRow>& rows,
                       const std::string& kind) {
  std::string text = kind.empty() ? "<div class=\"scroll\"><table>\n<tr>"
                                  : "<div class=\"scroll\"><table class=\"" + kind + "\">\n<tr>";
  for (const std::string& cell : heading) text += "<th>" + html_escaped(cell) + "</th>";
  text += "</tr>\n";
  for (const PageRow& row : rows) {
    text += row.kind.empty() ? "<tr>" : "<tr class=\"" + row.kind + "\">";
    if (row.kind == "group") {
      text += fmt::format("<td colspan=\"{}\">{}</td></tr>\n", heading.size(), html_escaped(row.cells.front()));
      continue;
    }
    for (const std::string& cell : row.cells) text += "<td>" + html_escaped(cell) + "</td>";
    text += "</tr>\n";
  }
  return text + "</table></div>\n";
}

std::string png_uri(const Picture& picture) {
  return "data:image/png;base64," + base64(encode_png(picture.width, picture.height, picture.rgb));
}

std::string csv_number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : std::string(); }

}  // namespace vrpipe::tools
