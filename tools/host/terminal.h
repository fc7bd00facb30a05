#pragma once

#include <string>

namespace vrpipe::tools {

/// How text may look on stdout: plain ASCII without colours unless it is a terminal.
struct TextStyle {
  bool colors = false;  ///< a terminal, and the environment does not say NO_COLOR (no-color.org)
  bool unicode = false;

  std::string bold(const std::string& text) const { return colors ? "\x1b[1m" + text + "\x1b[0m" : text; }
  std::string dim(const std::string& text) const { return colors ? "\x1b[2m" + text + "\x1b[0m" : text; }
  std::string good(const std::string& text) const { return colors ? "\x1b[32m" + text + "\x1b[0m" : text; }
};

TextStyle stdout_style();

/// Whether a line on stderr can be redrawn.
bool stderr_is_terminal();
/// Of the terminal on stderr, in characters.
unsigned stderr_width();

}  // namespace vrpipe::tools
