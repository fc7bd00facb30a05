#include "host/progress_line.h"

#include <algorithm>
#include <cstdio>

#include <fmt/format.h>

#include <vrpipe/component/printable.h>

#include "host/process_setup.h"
#include "host/terminal.h"

namespace vrpipe::tools {

namespace {

/// A terminal that has gone is no reason to fail.
void put(const std::string& text) {
  std::fputs(text.c_str(), stderr);
  std::fflush(stderr);
}

}  // namespace

ProgressLine::ProgressLine() : visible_(stderr_is_terminal()) {}

ProgressLine::~ProgressLine() { erase(); }

void ProgressLine::show(const std::string& text) {
  if (!visible_) return;
  // The last column stays free: some terminals wrap as soon as it is written.
  note_progress_line(true);
  put("\r\x1b[J" + printable(text).substr(0, stderr_width() - 1) + "\r");
  drawn_ = true;
}

void ProgressLine::erase() {
  if (!drawn_) return;
  put("\r\x1b[J");
  note_progress_line(false);
  drawn_ = false;
}

std::string progress_text(const std::vector<std::string>& names, const std::vector<float>& done, double elapsed_seconds,
                          unsigned width) {
  const bool many = names.size() > 4;
  std::string text;
  double share = 0;
  std::size_t finished = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const double part = std::clamp(static_cast<double>(done[i]), 0.0, 1.0);
    share += part / static_cast<double>(names.size());
    finished += part >= 1 ? 1U : 0U;
    if (!many && done[i] < 0) {
      text += names[i] + " waiting  ";
    } else if (!many || (part > 0 && part < 1)) {
      text += fmt::format("{} {:3.0f}%  ", names[i], 100 * part);
    }
  }
  if (many) text = fmt::format("{}/{}  ", finished, names.size()) + text;
  std::string time;
  // The first percents say little about the rest.
  if (share > 0.03) {
    const auto left = static_cast<unsigned long>(elapsed_seconds * (1 - share) / share + 0.5);
    time = fmt::format(" {}:{:02} left", left / 60, left % 60);
  }
  const std::size_t around = text.size() + time.size() + 2;
  if (width > around + 10) {
    const std::size_t length = std::min<std::size_t>(40, width - around - 1);
    const auto full = static_cast<std::size_t>(share * static_cast<double>(length) + 0.5);
    text += '[' + std::string(full, '=') + std::string(length - full, ' ') + ']';
  }
  text += time;
  return text.substr(0, width);
}

}  // namespace vrpipe::tools
