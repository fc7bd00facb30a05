#include "host/terminal.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

namespace vrpipe::tools {
namespace {

bool is_terminal(int descriptor) {
  const char* const type = std::getenv("TERM");
  return ::isatty(descriptor) != 0 && !(type != nullptr && std::strcmp(type, "dumb") == 0);
}

}  // namespace

TextStyle stdout_style() {
  TextStyle style;
  if (!is_terminal(STDOUT_FILENO)) return style;
  const char* const no_color = std::getenv("NO_COLOR");
  style.colors = no_color == nullptr || *no_color == '\0';
  style.unicode = true;
  return style;
}

bool stderr_is_terminal() { return is_terminal(STDERR_FILENO); }

unsigned stderr_width() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80U;
}

}  // namespace vrpipe::tools
