#include "output/page_parts.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include "image/base64.h"
#include "image/images.h"
#include "output/compare_page_style.h"
#include "output/page_style.h"

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

/// Of words: letters and digits, what is between them a line.
std::string file_name(const std::string& words) {
  std::string name;
  for (const char c : words) {
    const bool is_plain = std::isalnum(static_cast<unsigned char>(c)) != 0;
    if (is_plain) name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (!is_plain && !name.empty() && name.back() != '-') name += '-';
  }
  while (!name.empty() && name.back() == '-') name.pop_back();
  return name;
}

std::string csv_of(const Plot& plot) {
  CsvText csv({"series", plot.x.title, plot.y.title, "label", "note"});
  for (const PlotPoint& point : plot.points) {
    const auto looks_so = [&](const LegendEntry& entry) {
      return !entry.is_line && entry.color == point.color && entry.marker == point.marker;
    };
    const auto series = std::find_if(plot.legend.begin(), plot.legend.end(), looks_so);
    csv.row({series == plot.legend.end() ? "" : series->text, csv_number(point.x), csv_number(point.y), point.label,
             point.tooltip});
  }
  return csv.text();
}

std::string csv_of(const BarPlot& plot) {
  CsvText csv({"group", "series", "from", "to", "note"});
  for (const BarGroup& group : plot.groups) {
    for (const Bar& bar : group.bars) {
      const auto series = std::find_if(plot.legend.begin(), plot.legend.end(),
                                       [&](const auto& entry) { return entry.second == bar.color; });
      csv.row({group.label, series == plot.legend.end() ? "" : series->first, csv_number(bar.from), csv_number(bar.to),
               bar.tooltip});
    }
    for (const double mark : group.marks) csv.row({group.label, "mark", csv_number(mark), csv_number(mark), ""});
  }
  return csv.text();
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

std::string figure(const std::string& name, const Plot& plot, const std::string& caption) {
  return html(PageFigure{file_name(name), caption, svg(plot), csv_of(plot)});
}
std::string figure(const std::string& name, const BarPlot& plot, const std::string& caption) {
  return html(PageFigure{file_name(name), caption, svg(plot), csv_of(plot)});
}

std::string page_head(const std::string& title, const std::string& style, const std::string& script) {
  std::string text =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" +
      html_escaped(title) + "</title>\n<style>" + page_style + style + "</style>\n";
  if (!script.empty()) text += "<script>" + script + "</script>\n";
  return text + "</head>\n<body>\n";
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
