#pragma once

#include <string>
#include <utility>
#include <vector>

#include "image/picture.h"
#include "output/svg_bars.h"
#include "output/svg_plot.h"

namespace vrpipe::tools {

/// Rows of cells, as CSV of RFC 4180 writes them, with line feeds.
class CsvText {
 public:
  explicit CsvText(const std::vector<std::string>& heading) { row(heading); }
  void row(const std::vector<std::string>& cells);
  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// A plot with what it says, and links that save it: the drawing alone, and its data.
struct PageFigure {
  std::string name;     ///< of the files, and of the element
  std::string caption;  ///< HTML
  std::string svg;      ///< an <svg> element
  std::string csv;
};
std::string html(const PageFigure& figure);
/// The same of a plot, its data being what it shows. `name`: words, of which the files' names are made.
std::string figure(const std::string& name, const Plot& plot, const std::string& caption = "");
std::string figure(const std::string& name, const BarPlot& plot, const std::string& caption = "");

/// Links that save data.
std::string csv_link(const std::string& name, const std::string& csv);

/// A page up to its <body>.
/// @param title   in plain text
/// @param style   of its own, behind that of all pages
/// @param script  that runs before anything is shown
std::string page_head(const std::string& title, const std::string& style = "", const std::string& script = "");

/// A row of cells in plain text.
struct PageRow {
  std::vector<std::string> cells;
  std::string kind = {};  ///< class of the row: marked, group
};
std::string html_table(const std::vector<std::string>& heading, const std::vector<PageRow>& rows,
                       const std::string& kind = "");

/// A data URI.
std::string png_uri(const Picture& picture);

/// A text as a cell of CSV, quoted where it must be.
std::string csv_text(const std::string& text);
/// A number as CSV has it: all its digits; empty for what is none.
std::string csv_number(double value);

}  // namespace vrpipe::tools
