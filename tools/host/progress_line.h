#pragma once

#include <chrono>
#include <string>
#include <vector>

namespace vrpipe::tools {

/// One line on stderr that is redrawn and erased at the end; nothing at all where stderr is not a terminal. The cursor
/// rests at its beginning: when a terminal that has become narrower wraps the line, all of it is still below the cursor.
class ProgressLine {
 public:
  ProgressLine();
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  bool visible() const { return visible_; }
  /// Shows a text, cut to the terminal's width.
  void show(const std::string& text);
  void erase();

 private:
  bool visible_;
  bool drawn_ = false;
};

/// Share done of what has not begun.
constexpr float waiting = -1;

/// Percentages, a bar and the time left of simulations that run side by side; of more than four, how many are done and
/// the percentages of those under way. ASCII, at most `width` characters.
/// @param done             share of each that is done, 0 to 1, or `waiting`
/// @param elapsed_seconds  since they began
std::string progress_text(const std::vector<std::string>& names, const std::vector<float>& done, double elapsed_seconds,
                          unsigned width);

}  // namespace vrpipe::tools
